"""Measures the error of each program's pictures. The truth is the mean of the emission-absorption
integral through the source volume over the area of each pixel: `triptych render --renderer integral
--field source`."""
import os
import subprocess
import tempfile

import numpy as np

import pictures
from contenders import Unavailable

TOLERANCE = 4e-3  # the mean error is about a hundred times smaller


def _numbers(values):
    return ",".join(repr(float(v)) for v in values)


def truth(prepared, view, size, threads, path):
    """Writes the truth of a view to `path`, as a PNG with the alpha of the programs' pictures."""
    command = [prepared.triptych, "render", prepared.volume, "-o", path, "--renderer", "integral",
               "--field", "source", "--tolerance", str(TOLERANCE),
               "--tf", prepared.function_path, "--threads", str(threads), "--size", "%dx%d" % (size, size),
               "--eye=" + _numbers(view["eye"]), "--look=" + _numbers(view["look"]),
               "--up=" + _numbers(view["up"]), "--fov", repr(view["fov_degrees"]),
               "--background", "none"]
    if not prepared.scene.shading:
        command.append("--no-shading")
    cache = dict(os.environ, XDG_CACHE_HOME=os.path.abspath(os.path.join(prepared.work, "cache")))
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          env=cache, check=False)
    if done.returncode:
        raise Unavailable((done.stdout.strip().splitlines() or ["failed"])[-1])


def load(path, name):
    """Returns the picture of the program `name`, premultiplied."""
    image = pictures.load(path, is_opacity=name == "vdb_render")
    return pictures.premultiply(image) if name.startswith(("triptych-", "integral")) else image


def measure(options, prepared, field, views, size, log):
    """Returns the mean of pictures.distance() over the views for each program, or {} if the
    integral cannot be drawn."""
    apart = {one.name: [] for one in field}
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "picture.png")
        for view in views:
            try:
                truth(prepared, view, size, options.threads, path)
            except Unavailable as why:
                log("%s: the integral failed: %s" % (prepared.scene.name, why))
                return {}
            exact = load(path, "integral")
            for one in field:
                try:
                    one.picture(view, size, path)
                except Unavailable as why:
                    log("%s: drawing failed: %s" % (one.name, why))
                    continue
                picture = load(path, one.name)
                apart[one.name].append(pictures.distance(picture, exact))
    return {name: {key: float(np.mean([each[key] for each in every])) for key in every[0]}
            for name, every in apart.items() if every}


def table(result, size):
    """Returns a table of time and error of each program for one scene."""
    lines = ["%s: %s, %d px" % (result["scene"], result["shows"], size), "",
             "| program | median ms | error: median | mean | 99 % | maximum | of opacity: median "
             "| mean |",
             "|---|--:|--:|--:|--:|--:|--:|--:|"]
    times = {row["program"]: row["ms"] for row in result["rows"] if row["size"] == size}
    for name, error in result["errors"].get(str(size), {}).items():
        lit = ("median", "mean", "percentile_99", "max")
        cells = ["-" if name == "vdb_render" else "%.2f" % error[key] for key in lit]
        cells += ["%.2f" % error[key] for key in ("opacity_median", "opacity_mean")]
        lines.append("| %s | %s | %s |" % (
            name, "%.1f" % times[name] if name in times else "-", " | ".join(cells)))
    return "\n".join(lines)
