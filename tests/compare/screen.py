"""Measures pictures in which voxels are smaller than pixels, and pictures by functions with sharp
edges: error against the mean over each pixel's area, time, and share of the voxels that are drawn.
Started by ./screen."""
import argparse
import json
import os
import re
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections import namedtuple

import numpy as np

import accuracy
import contenders
import pictures
import plots
import prepare
import scenes

sys.path.insert(0, os.path.join(scenes.HERE, "..", "cli"))
from exr import read_exr  # noqa: E402

PROMISES = {"draft": 4, "normal": 1, "high": 0.3}  # mean error, of 255
QUALITIES = {name: ["--quality", name] for name in ("draft", "normal", "high", "exact")}
FINEST = ["--lod", "0"]
MANY_RAYS = 16  # along each side of a pixel, for functions with edges
VTK_PX = 2048  # greatest edge of VTK's pictures

Volume = namedtuple("Volume", "name file voxels_per_px")
VOLUMES = [
    Volume("bonsai", "bonsai.nii.gz", 4),
    Volume("ch2better", "ch2better.nii.gz", 5),
    Volume("aneurism", "aneurism_256x256x256_uint8.nhdr", 4),
    Volume("smoke", "smoke.vdb", 3),
    Volume("tooth", "tooth.nhdr", 2),
    Volume("stent", "stent.nrrd", 2),
]
FRONT = ["bonsai", "brain-translucent", "aneurism", "porous"]

NOTES = {
    "truth": "The truth is the mean over each pixel's area: the mean of 8 x 8 rays of the integral "
             "renderer (tolerance %g), or of 4 x 4 rays where a voxel is wider than %g of a pixel. "
             "For volumes of more than 100 million voxels, the rays are by `--quality exact`." %
             (accuracy.TOLERANCE, accuracy.MANY_RAYS_PX),
    "error": "Errors are means of 255 in red, green, blue (premultiplied) and opacity, over the "
             "pixels where either opacity is above 1/255.",
    "drawn": "Drawn: voxels that the frame reads at all levels, as a share of `--lod 0`.",
    "view": "The view is the default of `render`. Voxels a pixel count where the eye looks.",
    "time": "A time is the median of all frames of one view but the first, in one process. The "
            "first frame stands beside it. VTK has the volume in memory, Triptych reads files.",
    "vtk": "vtk-S-R: vtkFixedPointVolumeRayCastMapper, a sample every S voxels, R x R rays per "
           "pixel. It draws a picture of R times the size, at most %d px, and the mean of R x R "
           "pixels counts. "
           "triptych-S-R-L: S samples per sheet, R x R rays, --lod L." % VTK_PX,
}


def log(text):
    print("screen: " + text, file=sys.stderr, flush=True)


def run(command):
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          errors="replace", check=False)
    if done.returncode:
        raise SystemExit("screen: %s: %s" % (" ".join(command), done.stdout.strip()))
    return done.stdout


def function_text(kind, lowest, highest):
    """Returns a transfer function over the range of the data. A value is 1/255 of the range."""
    def at(value):
        return lowest + (highest - lowest) * value / 255
    colours = "0.9 0.5 0.2", "0.3 0.6 0.9"
    if kind == "gentle":
        points = [(at(20), 0, 0), (at(255), 0.1, 1)]
    elif kind == "step":
        points = [(at(80), 0, 0), (at(80), 0.9999, 0), (at(255), 0.9999, 1)]
    elif kind == "peak":
        points = [(at(99), 0, 0), (at(100), 0.9, 0), (at(101), 0, 0)]
    else:
        points = []
        for n, first in enumerate(range(24, 256, 16)):
            points += [(at(first), 0, n % 2), (at(first), 0.3, n % 2), (at(first + 8), 0.3, n % 2),
                       (at(first + 8), 0, n % 2)]
    return "values data\nunit voxel\n" + "".join(
        "%.9g %s %g\n" % (value, colours[colour], opacity) for value, opacity, colour in points)


FUNCTIONS = "gentle", "step", "peak", "stripes"


def write_path(folder, keys):
    """Writes a camera path with a frame each second and returns its name."""
    path = os.path.join(folder, "path.json")
    with open(path, "w", encoding="utf-8") as file:
        json.dump({"triptych_path": 1, "frames_per_second": 1, "keys": [
            {"seconds": second, "eye": view["eye"], "look": view["look"], "up": view["up"],
             "fov": view["fov_degrees"]} for second, view in keys]}, file)
    return path


class Data:
    """A bricked volume. `info` is the output of `triptych info --json`."""

    def __init__(self, options, path, name, function=None):
        self.options, self.name = options, name
        self.dataset = os.path.join(options.work, name + ".trip")
        if not os.path.exists(os.path.join(self.dataset, "index.trip")):
            with_function = ["--tf", function] if function else []
            run([options.triptych, "brick", path, "-o", self.dataset, "--quiet", *with_function])
        self.info = json.loads(run([options.triptych, "info", "--json", self.dataset]))
        self.camera, self.look = [], []
        self.camera = self._camera()

    def _camera(self):
        """Returns the options of the default view, without the size."""
        stats = self.draw(16, [])[1]
        return re.sub(r" --size \S+", "", stats["frames"][0]["camera"]).split()

    def view(self):
        named = dict(zip(self.camera[::2], self.camera[1::2]))
        view = {name: [float(v) for v in named["--" + name].split(",")]
                for name in ("eye", "look", "up")}
        return dict(view, fov_degrees=float(named["--fov"]))

    def voxel_px(self, size):
        return accuracy.voxel_px(self.info, self.view(), size)

    def size_of(self, voxels_per_px):
        return max(8, round(1 / (voxels_per_px * self.voxel_px(1))))

    def draw(self, size, setting, frames=1):
        """Returns the first picture, premultiplied, and the statistics of `render`. Frames have one
        view."""
        keys = [(second, self.view()) for second in (0, frames - 1)] if frames > 1 else []
        drawn, stats = self.draw_path(size, setting, keys)
        return drawn[0], stats

    def draw_path(self, size, setting, keys):
        """Returns the pictures at each second of a path, and the statistics. `keys` are pairs of a
        second and a view. Without keys, the camera's view is drawn."""
        with tempfile.TemporaryDirectory() as folder:
            stats, out = os.path.join(folder, "stats.json"), os.path.join(folder, "p.exr")
            view = self.camera
            if keys:
                view = ["--path", write_path(folder, keys), "--in-flight", "1"]
            run([self.options.triptych, "render", self.dataset, "-o", out, "--stats", stats,
                 "--size", "%dx%d" % (size, size), "--threads", str(self.options.threads),
                 *view, *self.look, *setting])
            drawn = [read_exr(os.path.join(folder, name)) for name in sorted(os.listdir(folder))
                     if name.endswith(".exr")]
            with open(stats, encoding="utf-8") as file:
                return drawn, json.load(file)

    def truth(self, size, rays=0):
        """Returns the mean over each pixel's area, by N x N rays. The work folder keeps it."""
        rays = rays or accuracy.rays_of_area(self.info, self.view(), size)
        flat = "-flat" if self.look else ""
        path = os.path.join(self.options.work, "%s-%d-%d%s.npy" % (self.name, size, rays, flat))
        if not os.path.exists(path):
            log("%s, %d px: truth by %d x %d rays" % (self.name, size, rays, rays))
            by = accuracy.method(self.info) + ["--samples", str(rays)]
            np.save(path, self.draw(size, by)[0])
        return np.load(path)


def voxels_read(stats):
    return sum(one["splats_read"] for one in stats["frames"][0]["lists"].values())


def error_of(picture, truth):
    """Returns the mean error, or None if the picture and the truth are empty."""
    covered = np.maximum(picture[..., 3], truth[..., 3]) > 1 / 255
    return pictures.distance(picture, truth)["mean"] if covered.any() else None


def find(options, file):
    for folder in [options.data, scenes.INCLUDED]:
        for root, below, files in os.walk(folder) if folder else ():
            below.sort()
            if file in files:
                return os.path.join(root, file)
    return None


def volumes(options, usual):
    """Yields the volumes of --volumes, or else the first `usual` volumes, with their paths."""
    chosen = ([one for one in VOLUMES if one.name in options.volumes] if options.volumes else
              VOLUMES[:usual])
    for volume in chosen:
        path = find(options, volume.file)
        if path:
            yield volume, path
        else:
            log("%s: skipped: %s is not in --data" % (volume.name, volume.file))


def number(value, digits=2):
    return "-" if value is None else "%.*f" % (digits, value)


def table(head, rows):
    lines = ["| " + " | ".join(head) + " |", "|---" + "|--:" * (len(head) - 1) + "|"]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


def notes(*names):
    return "\n" + "\n".join("- " + NOTES[name] for name in names) + "\n"


def pixels(options):
    """Error by pixels, and the share of voxels drawn."""
    settings = dict({"default": []}, **{name: QUALITIES[name] for name in ("draft", "high", "exact")})
    settings["2 x 2 rays"] = FINEST + ["--samples", "2"]
    settings["coarse, 2 x 2 rays"] = ["--lod", "0.55", "--samples", "2"]
    result, rows = [], []
    for volume, path in volumes(options, 4):
        data = Data(options, path, volume.name)
        for ratio in options.voxels_per_px or [volume.voxels_per_px]:
            size = data.size_of(ratio)
            truth = data.truth(size)
            finest = voxels_read(data.draw(size, FINEST)[1])
            one = {"volume": volume.name, "voxels_per_px": ratio, "size": size, "errors": {},
                   "drawn": {}}
            for name, setting in settings.items():
                picture, stats = data.draw(size, setting)
                one["errors"][name] = error_of(picture, truth)
                one["drawn"][name] = voxels_read(stats) / finest if finest else None
            result.append(one)
            rows.append(["%s (%g)" % (volume.name, ratio), "%d" % size] +
                        ["%s, %s" % (number(one["errors"][name]), number(one["drawn"][name]))
                         for name in settings])
            log("%s (%g): default %s" % (volume.name, ratio, rows[-1][2]))
    print("Mean error of 255, and share of voxels drawn:\n")
    print(table(["volume (voxels a pixel)", "pixels", *settings], rows))
    print(notes("truth", "error", "view", "drawn"))
    return result


def by_functions(options):
    """Error by functions, and how often qualities keep their promises."""
    result, rows = [], []
    for volume, path in volumes(options, 6):
        # The whole volume has this range, whatever the function keeps.
        values = Data(options, path, volume.name).info
        for kind in options.functions:
            function = os.path.join(options.work, "%s-%s.tf" % (volume.name, kind))
            with open(function, "w", encoding="utf-8") as file:
                file.write(function_text(kind, values["value_min"], values["value_max"]))
            data = Data(options, path, "%s-%s" % (volume.name, kind), function)
            for size in options.sizes:
                truth = data.truth(size, MANY_RAYS)
                errors = {name: error_of(data.draw(size, setting)[0], truth)
                          for name, setting in QUALITIES.items()}
                result.append({"volume": volume.name, "function": kind, "size": size,
                               "voxel_px": data.voxel_px(size), "errors": errors})
                rows.append([volume.name, kind, "%d" % size, number(data.voxel_px(size))] +
                            [number(errors[name]) for name in QUALITIES])
                log(" ".join(rows[-1]))
    print("Mean error of 255:\n")
    print(table(["volume", "function", "pixels", "voxel, pixels", *QUALITIES], rows) + "\n")
    for name, most in PROMISES.items():
        errors = [one["errors"][name] for one in result if one["errors"][name] is not None]
        print("%s promises %g: kept in %d of %d cases, greatest mean error %s." %
              (name, most, sum(e <= most for e in errors), len(errors),
               number(max(errors, default=None))))
    print("The truth is the mean of %d x %d rays of the integral renderer (tolerance %g).\n" %
          (MANY_RAYS, MANY_RAYS, accuracy.TOLERANCE))
    print(notes("error", "view"))
    return result


def front_settings():
    for name, setting in QUALITIES.items():
        yield "triptych-" + name, setting
    for slices in 1, 2:
        for rays in 1, 2:
            for lod in "0", "0.55":
                yield "triptych-%d-%d-%s" % (slices, rays, lod), [
                    "--samples-per-sheet", str(slices), "--samples", str(rays), "--lod", lod]


def vtk_points(options, prepared, data, size, truth):
    """Yields name, milliseconds and error of VTK's settings."""
    view = data.view()
    with tempfile.TemporaryDirectory() as folder:
        for step in 1, 0.5, 0.25:
            name = "vtk-%g" % step
            try:
                one = contenders.Vtk(prepared, "cpu", options.threads, name, step)
            except contenders.Unavailable as why:
                log("%s: skipped: %s" % (name, why))
                return
            for rays in [n for n in (1, 2, 4) if n * size <= VTK_PX]:
                times = [one.draw(view, size * rays)["ms"] for _ in range(options.frames)]
                path = os.path.join(folder, "p.png")
                one.picture(view, size * rays, path)
                picture = mean_of_squares(pictures.load(path), rays)
                yield {"name": "%s-%d" % (name, rays), "first_ms": times[0],
                       "ms": statistics.median(times[1:]), "error": error_of(picture, truth)}
            one.close()


def mean_of_squares(picture, edge):
    height, width, channels = picture.shape
    return picture.reshape(height // edge, edge, width // edge, edge, channels).mean((1, 3))


def front(options):
    """Time and error of many settings, without shading."""
    result = []
    for name in options.scenes:
        scene = next(one for one in scenes.SCENES if one.name == name)
        path = scenes.find(scene, [options.data] if options.data else [scenes.INCLUDED],
                           options.work, options.triptych)
        if not path:
            log("%s: skipped: %s is not in --data" % (name, scene.file))
            continue
        flat = scene._replace(shading=False)
        work = os.path.join(options.work, "scenes")
        os.makedirs(work, exist_ok=True)
        prepared = prepare.Prepared(flat, path, work, options.triptych)
        data = Data(options, path, "scenes/" + name)
        data.look = ["--no-shading"]
        for ratio in options.voxels_per_px or (1, 2, 4):
            size = data.size_of(ratio)
            truth, points = data.truth(size), []
            for setting, given in front_settings():
                picture, stats = data.draw(size, given, options.frames)
                times = [frame["ms"] for frame in stats["frames"]]
                points.append({"name": setting, "first_ms": times[0],
                               "ms": statistics.median(times[1:]),
                               "error": error_of(picture, truth)})
            points += vtk_points(options, prepared, data, size, truth)
            one = {"scene": name, "voxels_per_px": ratio, "size": size, "points": points,
                   "load": os.getloadavg()[0]}
            result.append(one)
            write_front(options, one)
    print(notes("truth", "error", "view", "time", "vtk"))
    return result


def write_front(options, one):
    title = "%s, %g voxels a pixel, %d x %d px, unlit" % (one["scene"], one["voxels_per_px"],
                                                         one["size"], one["size"])
    points = sorted(one["points"], key=lambda p: p["ms"])
    least, rows = float("inf"), []
    for p in points:
        best = p["error"] < least
        least = min(least, p["error"])
        rows.append([p["name"] + (" *" if best else ""), number(p["ms"], 1),
                     number(p["first_ms"], 1), number(p["error"])])
    print("%s, load %.1f. No setting with * is beaten in time and error.\n" % (title, one["load"]))
    print(table(["setting", "ms", "first frame", "error"], rows) + "\n", flush=True)
    path = os.path.join(options.out, "front-%s-%g.svg" % (one["scene"], one["voxels_per_px"]))
    with open(path, "w", encoding="utf-8") as file:
        file.write(plots.svg(title, {"colour and opacity": [
            (p["name"], p["ms"], p["error"]) for p in points]}))


def turntable(options):
    """Seconds of a turntable of 60 pictures, of the whole process."""
    path = find(options, "ch2better.nii.gz")
    if not path:
        raise SystemExit("screen: ch2better.nii.gz is not in --data")
    data, result = Data(options, path, "ch2better"), []
    for memory in "64M", "1G":
        with tempfile.TemporaryDirectory() as folder:
            before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
            run([options.triptych, "render", data.dataset, "-o", os.path.join(folder, "turn.png"),
                 "--orbit", "60", "--size", "512x512", "--memory", memory, "--threads",
                 str(options.threads)])
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            result.append({"memory": memory, "seconds": time.perf_counter() - start,
                           "processor_seconds": after.ru_utime + after.ru_stime -
                           before.ru_utime - before.ru_stime})
    print("60 pictures of ch2better once around, 512 x 512 px; load %.1f:\n" % os.getloadavg()[0])
    print(table(["--memory", "seconds", "processor-seconds"],
                [[one["memory"], number(one["seconds"], 1), number(one["processor_seconds"], 1)]
                 for one in result]) + "\n")
    return result


def zoom(options):
    """Jumps of the picture while the lens zooms in, beyond the motion's own."""
    path = find(options, options.zoom)
    if not path:
        raise SystemExit("screen: %s is not in --data" % options.zoom)
    data, size = Data(options, path, "zoom-" + options.zoom.split(".")[0]), 96
    widths = 0.125 * 80 ** np.linspace(0, 1, options.steps + 1)  # of a voxel, in pixels
    keys = []
    for second, width in enumerate(widths):
        half = np.tan(np.radians(data.view()["fov_degrees"] / 2)) * data.voxel_px(size) / width
        keys.append((second, dict(data.view(), fov_degrees=float(np.degrees(2 * np.arctan(half))))))
    true = data.draw_path(size, ["--quality", "exact", "--samples", "8", *FINEST], keys)[0]
    drawn = data.draw_path(size, [], keys)[0]

    def changes(frames):
        return np.array([255 * np.abs(b - a).mean() for a, b in zip(frames, frames[1:])])
    jumps = changes(drawn) - changes(true)
    errors = [error_of(a, b) or 0 for a, b in zip(drawn, true)]
    worst = int(np.argmax(jumps))
    print("%s, %d x %d px, %d steps from 8 voxels a pixel to a tenth:\n" %
          (options.zoom, size, size, options.steps))
    print(table(["greatest jump, mean of all pixels, of 255", "at voxels a pixel", "median jump",
                 "greatest mean error"],
                [[number(jumps[worst]), number(1 / widths[worst]), number(np.median(jumps)),
                  number(max(errors))]]))
    print("\nA jump is the mean change from a picture to the next, less the change of the true "
          "pictures (`--quality exact --samples 8 --lod 0`).\n")
    return {"widths_px": widths.tolist(), "jumps": jumps.tolist(), "errors": errors}


TABLES = {"pixels": pixels, "functions": by_functions, "front": front, "turntable": turntable,
          "zoom": zoom}


def parse_options():
    def comma(of, allowed=None):
        def parse(text):
            items = [of(item) for item in text.split(",")]
            for item in items:
                if allowed and item not in allowed:
                    raise argparse.ArgumentTypeError("unknown %r; use %s" %
                                                     (item, ", ".join(allowed)))
            return items
        return parse

    names = [volume.name for volume in VOLUMES]
    parser = argparse.ArgumentParser(prog="tests/compare/screen", description=__doc__)
    parser.add_argument("table", nargs="*", choices=[[], *TABLES], metavar="TABLE",
                        help="tables to print (default: all): " + ", ".join(TABLES))
    parser.add_argument("--data", metavar="FOLDER", help="folder with volumes, also in its subfolders")
    parser.add_argument("--out", default="screen-results", metavar="FOLDER",
                        help="folder for results.json and plots (default: %(default)s)")
    parser.add_argument("--work", metavar="FOLDER", help="folder that keeps data sets and true "
                        "pictures (default: OUT/work)")
    parser.add_argument("--triptych", required=True, metavar="PROGRAM",
                        help="the program (default: built here, preset release)")
    parser.add_argument("--volumes", type=comma(str, names), metavar="NAME[,..]",
                        help="volumes of the tables pixels (default: the first "
                        "four) and functions (default: all): " + ", ".join(names))
    parser.add_argument("--functions", type=comma(str, FUNCTIONS), default=FUNCTIONS,
                        metavar="NAME[,..]", help="functions: " + ", ".join(FUNCTIONS))
    parser.add_argument("--sizes", type=comma(int), default=[64, 160, 256], metavar="N[,..]",
                        help="edges of the pictures of the table functions (default: 64,160,256)")
    parser.add_argument("--voxels-per-px", type=comma(float), metavar="X[,..]",
                        help="voxels a pixel of the tables pixels (default: by the volume) and "
                        "front (default: 1,2,4)")
    parser.add_argument("--scenes", type=comma(str, [one.name for one in scenes.SCENES]),
                        default=FRONT, metavar="NAME[,..]",
                        help="scenes of the table front (default: %s)" % ",".join(FRONT))
    parser.add_argument("--frames", type=int, default=6, metavar="N",
                        help="frames of each setting of the table front (default: 6)")
    parser.add_argument("--zoom", default="ch2better.nii.gz", metavar="FILE",
                        help="volume of the table zoom (default: %(default)s)")
    parser.add_argument("--steps", type=int, default=200, metavar="N",
                        help="steps of the table zoom (default: 200)")
    parser.add_argument("--threads", type=int, default=min(4, len(os.sched_getaffinity(0))),
                        help="threads of each program (default: %(default)s)")
    options = parser.parse_args()
    if options.frames < 2 or options.threads < 1:
        parser.error("--frames must be at least 2, --threads at least 1")
    options.table = options.table or list(TABLES)
    options.work = options.work or os.path.join(options.out, "work")
    return options


def main():
    options = parse_options()
    os.makedirs(options.out, exist_ok=True)
    os.makedirs(options.work, exist_ok=True)
    results = {}
    for name in options.table:
        print("## %s\n" % TABLES[name].__doc__.split("\n")[0].rstrip("."))
        results[name] = TABLES[name](options)
        with open(os.path.join(options.out, "results.json"), "w", encoding="utf-8") as file:
            json.dump(results, file, indent=1)


if __name__ == "__main__":
    main()
