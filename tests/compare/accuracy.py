"""Measures the error of each program's pictures against the emission-absorption integral through
the source volume: against its mean over each pixel's area, and against one ray per pixel."""
import os
import subprocess
import tempfile

import numpy as np

import pictures
from contenders import Unavailable

TOLERANCE = 1e-3
MANY_RAYS_PX = 0.35  # voxels narrower than this get 8 x 8 rays per pixel, others 4 x 4
LARGE_VOXELS = 100e6  # the integral would take 12 bytes a voxel and minutes for a picture


def _numbers(values):
    return ",".join(repr(float(v)) for v in values)


def voxel_px(info, view, size):
    """Returns the width of a voxel in pixels where the eye looks."""
    voxel = abs(np.linalg.det(np.array(info["index_to_world"])[:, :3])) ** (1 / 3)
    distance = np.linalg.norm(np.array(view["eye"]) - np.array(view["look"]))
    return float(voxel * size / (2 * distance * np.tan(np.radians(view["fov_degrees"] / 2))))


def rays_of_area(info, view, size):
    """Returns N for N x N rays per pixel."""
    return 8 if voxel_px(info, view, size) < MANY_RAYS_PX else 4


def is_large(info):
    return float(np.prod(info["dims"])) > LARGE_VOXELS


def method(info):
    """Returns the options of `render` for one true ray: the integral renderer, or for large volumes
    the quality `exact`."""
    if is_large(info):
        return ["--quality", "exact", "--lod", "0"]
    return ["--renderer", "integral", "--tolerance", str(TOLERANCE)]


def true_picture(prepared, view, size, threads, path, rays):
    """Writes the mean of N x N rays per pixel to `path`, as a PNG with the alpha of the programs'
    pictures."""
    source = ([prepared.dataset] if is_large(prepared.info) else
              [prepared.volume, "--field", "source", "--tf", prepared.function_path])
    command = [prepared.triptych, "render", *source, "-o", path, *method(prepared.info),
               "--samples", str(rays), "--threads", str(threads), "--size", "%dx%d" % (size, size),
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
    """Returns the mean of pictures.distance() over the views for each program, or {} if the true
    picture cannot be drawn. Distances are from the mean over each pixel's area. "ray_mean" and
    "ray_opacity_mean" are from one ray per pixel."""
    apart = {one.name: [] for one in field}
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "picture.png")
        for view in views:
            truths = []
            try:
                for rays in rays_of_area(prepared.info, view, size), 1:
                    true_picture(prepared, view, size, options.threads, path, rays)
                    truths.append(load(path, "integral"))
            except Unavailable as why:
                log("%s: the integral failed: %s" % (prepared.scene.name, why))
                return {}
            for one in field:
                try:
                    one.picture(view, size, path)
                except Unavailable as why:
                    log("%s: drawing failed: %s" % (one.name, why))
                    continue
                picture = load(path, one.name)
                area, ray = (pictures.distance(picture, truth) for truth in truths)
                apart[one.name].append(dict(area, ray_mean=ray["mean"],
                                            ray_opacity_mean=ray["opacity_mean"]))
    return {name: {key: float(np.mean([each[key] for each in every])) for key in every[0]}
            for name, every in apart.items() if every}


def table(result, size):
    """Returns a table of time and error of each program for one scene."""
    lines = ["%s: %s, %d px" % (result["scene"], result["shows"], size), "",
             "| program | median ms | error: median | mean | 99 % | maximum | of opacity: median "
             "| mean | of one ray: mean | opacity |",
             "|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|"]
    times = {row["program"]: row["ms"] for row in result["rows"] if row["size"] == size}
    for name, error in result["errors"].get(str(size), {}).items():
        lit = ("median", "mean", "percentile_99", "max")
        cells = ["-" if name == "vdb_render" else "%.2f" % error[key] for key in lit]
        cells += ["%.2f" % error[key] for key in ("opacity_median", "opacity_mean")]
        cells += ["-" if name == "vdb_render" else "%.2f" % error["ray_mean"],
                  "%.2f" % error["ray_opacity_mean"]]
        lines.append("| %s | %s | %s |" % (
            name, "%.1f" % times[name] if name in times else "-", " | ".join(cells)))
    return "\n".join(lines)
