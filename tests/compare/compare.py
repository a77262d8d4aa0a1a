"""Compares Triptych with other volume renderers: for each scene, prepares the data, draws in turns,
and writes a table and pictures. Started by ./compare."""
import argparse
import json
import os
import platform
import re
import statistics
import subprocess
import sys
import tempfile

import accuracy
import check
import contenders
import pictures
import plots
import scenes
from contenders import Unavailable
from prepare import Prepared

BASE = "triptych-cpu"
PICTURE_SIZE = 512

NOTES = [
    "A frame is the wall time of one view from the volume in memory to the finished picture in "
    "memory. Only the figures of vdb_render include the disk.",
    "triptych-cpu, triptych-gl: planning, drawing and merging. For gl, also copying bricks to its "
    "own memory and reading the picture back (triptych bench renderers).",
    "vtk-cpu: Render() of a window that shows one volume by vtkFixedPointVolumeRayCastMapper, "
    "with one sample per voxel, one ray per pixel and no automatic coarsening. The time includes "
    "showing the finished picture by OpenGL (the display time).",
    "vtk-gpu: Render() of a window with vtkOpenGLGPUVolumeRayCastMapper, on Mesa's software "
    "OpenGL if there is no other. The picture stays in the window.",
    "vdb_render: a whole process that reads the grid and writes a PNG. Its own time is the one "
    "that it reports for ray tracing. It has no transfer function, so its grid holds the "
    "extinction of every voxel. It shows the same opacity, in grey and unlit, without shadows "
    "(-shadowstep 1e9). It stops a ray at 4 % transmittance, VTK's ray caster at 0.8 %, Triptych "
    "at 0.2 % (post) and 0.012 % (pre).",
    "triptych-post-1, -2, -4: triptych-cpu with --classify post and 1, 2 or 4 samples per sheet. "
    "triptych-cpu and triptych-gl use --classify pre. vtk-cpu-half: vtk-cpu with a sample every "
    "half voxel. VTK's ray caster gets a view wider by a pixel, which it needs to show the same.",
    "Errors: of 255, against the mean over each pixel's area of the integral through the source "
    "volume (8 x 8 rays per pixel, or 4 x 4 if a voxel is wider than %g of a pixel; "
    "linear interpolation, tolerance %g, 8 bits per channel), as the mean over the measured views. The "
    "last two columns are against one ray per pixel. For volumes of more than 100 million voxels, "
    "the rays are by `--quality exact`. Errors cover the "
    "pixels where either opacity is above 1/255, in red, green, blue (premultiplied) and opacity, "
    "and in opacity alone. Light does not change opacity. VTK has its own gradients and lights "
    "flat regions, so its error of colour includes that difference." %
    (accuracy.MANY_RAYS_PX, accuracy.TOLERANCE),
    "triptych-draft, -normal, -high: `triptych render --quality` along a path with these views. The "
    "time includes reading the data set from files.",
    "vdb_render, triptych-cpu and triptych-gl apply the transfer function to voxels, VTK and "
    "triptych-post to interpolated values.",
    "Triptych leaves flat regions unlit; VTK lights them like all others.",
    "Medians are over the rounds at each view, then over views.",
]


def log(text):
    print("compare: " + text, file=sys.stderr, flush=True)


def first_line(command, pattern):
    try:
        text = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                              errors="replace", check=False).stdout
    except OSError:
        return None
    found = re.search(pattern, text)
    return found.group(1).strip() if found else None


def machine(triptych):
    with open("/proc/cpuinfo", encoding="utf-8") as file:
        model = re.search(r"model name\s*: (.*)", file.read())
    with open("/proc/meminfo", encoding="utf-8") as file:
        memory = int(re.search(r"MemTotal:\s*(\d+)", file.read()).group(1)) * 1024
    return {
        "cpu": model.group(1) if model else platform.machine(),
        "cores": len(os.sched_getaffinity(0)),
        "memory_bytes": memory,
        "system": "%s %s" % (platform.system(), platform.release()),
        "distribution": first_line(["cat", "/etc/os-release"], r'PRETTY_NAME="(.*)"'),
        "load_before": os.getloadavg()[0],
        "triptych": first_line([triptych, "--version"], r"(.+)"),
        "source": first_line(["git", "-C", scenes.HERE, "describe", "--always", "--dirty"], r"(.+)"),
        "openvdb": first_line(["vdb_render", "-version"], r"library version: (\S+)"),
    }


class Race:
    """Times one scene at one size. times[name][view] holds the milliseconds of each round."""

    def __init__(self, options, size, field):
        self.options, self.size, self.field = options, size, field
        self.times = {one.name: [] for one in field}
        self.own, self.views = {}, None

    def run(self):
        for turn in range(self.options.rounds):
            for one in list(self.field):
                if turn == 0 or self._seconds(one.name) < self.options.patience:
                    self._round(one)

    def _seconds(self, name):
        """Returns the seconds of the last round."""
        return sum(view[-1] for view in self.times[name] if view) / 1e3

    def _round(self, one):
        try:
            if isinstance(one, contenders.Triptych):
                self._time_triptych(one)
            else:
                self._time_other(one)
        except Unavailable as why:
            log("%s, %d px: skipped: %s" % (one.name, self.size, why))
            self.field.remove(one)
            del self.times[one.name]

    def _time_triptych(self, one):
        views = one.time_views(self.size, self.options.views)
        self.views = self.views or [{key: view[key] for key in ("eye", "look", "up", "fov_degrees")}
                                    for view in views]
        times = self.times[one.name]
        times.extend([] for _ in range(len(views) - len(times)))
        for view, took in zip(times, views):
            view.append(statistics.median(took["ms"]))

    def _time_other(self, one):
        times = self.times[one.name]
        if not times:
            times.extend([] for _ in self.views)
            warm = one.draw(self.views[-1], self.size)["ms"]
            self.times[one.name + " step"] = self._step(one.draw(self.views[-1], self.size), warm)
        for index in range(0, len(self.views), self.times[one.name + " step"]):
            took = one.draw(self.views[index], self.size)
            times[index].append(took["ms"])
            if "own_ms" in took:
                self.own.setdefault(index, []).append(took["own_ms"])

    def _step(self, took, warm):
        """Returns the step between views: slow programs draw every fourth view."""
        return 4 if min(took["ms"], warm) > self.options.slow * 1e3 else 1

    def rows(self):
        base = self._medians(self.times[BASE]) if self.times.get(BASE) else None
        for one in self.field:
            views = self._medians(self.times[one.name])
            row = {"program": one.name, "device": one.device, "size": self.size,
                   "views": len(views), "rounds": max(len(v) for v in self.times[one.name]),
                   "ms": statistics.median(views.values()),
                   "ms_min": min(views.values()), "ms_max": max(views.values())}
            if base:
                row["ratio"] = row["ms"] / statistics.median(base[i] for i in views)
            if one.name == "vdb_render":
                own = {i: statistics.median(v) for i, v in self.own.items()}
                row["own_ms"] = statistics.median(own.values())
                if base:
                    row["own_ratio"] = row["own_ms"] / statistics.median(base[i] for i in own)
            if getattr(one, "display_ms", None) and one.name == "vtk-cpu":
                row["display_ms"] = statistics.median(one.display_ms)
            row["each_view_ms"] = {i: self.times[one.name][i] for i in views}
            yield row

    @staticmethod
    def _medians(times):
        return {i: statistics.median(rounds) for i, rounds in enumerate(times) if rounds}


def make_field(options, prepared):
    field, left_out = [], {}
    for name in options.programs:
        try:
            field.append(contenders.make(name, prepared, options.threads))
        except Unavailable as why:
            left_out[name] = str(why)
            log("%s: %s: skipped: %s" % (prepared.scene.name, name, why))
    return field, left_out


def draw_pictures(options, prepared, field, view, path):
    """Draws one view with each program. Returns the differences from the first picture."""
    names, images, result = [], [], []
    with tempfile.TemporaryDirectory() as folder:
        for one in field:
            own = os.path.join(folder, one.name + ".png")
            try:
                one.picture(view, PICTURE_SIZE, own)
            except Unavailable as why:
                log("%s: drawing failed: %s" % (one.name, why))
                continue
            image = pictures.load(own, is_opacity=one.name == "vdb_render")
            if one.name.startswith("triptych-"):
                image = pictures.premultiply(image)
            names.append(one.name)
            images.append(image)
    title = "%s: %s. One view by %s; %d x %d px, %s." % (
        prepared.scene.name, prepared.scene.shows, ", ".join(names), PICTURE_SIZE, PICTURE_SIZE,
        "lit from the eye (vdb_render unlit)" if prepared.scene.shading else "unlit")
    pictures.side_by_side(path, title, names, images)
    for name, image in zip(names[1:], images[1:]):
        result.append({"program": name, "colour": pictures.difference(image[..., :3],
                                                                      images[0][..., :3]),
                       "opacity": pictures.difference(image[..., 3], images[0][..., 3])})
    return result


def views_of(prepared, options):
    triptych = contenders.Triptych(prepared, "cpu", options.threads)
    return triptych.time_views(64, options.views)


def run_scene(options, scene, volume):
    log("%s: preparing" % scene.name)
    prepared = Prepared(scene, volume, os.path.join(options.out, "work"), options.triptych)
    field, left_out = make_field(options, prepared)
    result = {"scene": scene.name, "shows": scene.shows, "kind": scene.kind, "file": scene.file,
              "dims": prepared.info["dims"], "kept": prepared.info["kept"],
              "shading": scene.shading, "function": prepared.function, "left_out": left_out,
              "rows": []}
    try:
        for size in options.sizes if options.rounds else []:
            log("%s: %d x %d px" % (scene.name, size, size))
            race = Race(options, size, list(field))
            race.run()
            result["rows"].extend(race.rows())
        path = os.path.join(options.out, scene.name + ".png")
        views = views_of(prepared, options)
        view = views[1 % options.views]
        result["errors"] = {
            str(size): accuracy.measure(options, prepared, field, views[:options.error_views], size,
                                        log) for size in options.sizes}
        result["pictures"] = path
        result["differences"] = draw_pictures(options, prepared, field, view, path)
    finally:
        for one in field:
            one.close()
        if options.tidy:
            prepared.remove()
    return result


def table(results):
    """Returns a Markdown table of the scenes: milliseconds, and the ratio to Triptych's cpu
    frame."""
    lines = ["| scene | kind | voxels kept | px | %s | its own time |" % " | ".join(contenders.NAMES),
             "|---|---|--:|--:|" + "--:|" * (len(contenders.NAMES) + 1)]
    for result in results:
        sizes = sorted({row["size"] for row in result["rows"]})
        for size in sizes:
            rows = {row["program"]: row for row in result["rows"] if row["size"] == size}
            cells = [_cell(rows.get(name), name == BASE) for name in contenders.NAMES]
            own = rows.get("vdb_render", {})
            cells.append("%.0f (%.1f x)" % (own["own_ms"], own["own_ratio"])
                         if "own_ratio" in own else "-")
            lines.append("| %s | %s | %.2f M of %.1f M | %d | %s |" % (
                result["scene"], result["kind"], result["kept"] * 1e-6,
                result["dims"][0] * result["dims"][1] * result["dims"][2] * 1e-6, size,
                " | ".join(cells)))
    return "\n".join(lines)


def _cell(row, is_base):
    if not row:
        return "-"
    text = "%.1f" % row["ms"] if row["ms"] < 100 else "%.0f" % row["ms"]
    if not is_base and "ratio" in row:
        text += " (%.1f x)" % row["ratio"]
    return text


def scene_text(result, whole):
    """Returns the tables of one scene, with the notes."""
    settings, out = whole["settings"], []
    for size in settings["sizes"]:
        out += [accuracy.table(result, size), ""]
    out += ["%d views around the object, %d rounds, %d threads; errors of %d of the views. Load "
            "%.1f before, %.1f after. Times compare within a table, but not between tables." %
            (settings["views"], settings["rounds"], settings["threads"], settings["error_views"],
             result["load_before"], result["load_after"]), ""]
    out += ["- " + note for note in NOTES]
    out += ["- skipped %s: %s." % item for item in result["left_out"].items()]
    return "\n".join(out) + "\n"


def panels_of(result, size):
    """Returns the points for plots.svg(): the programs with a time and an error. vdb_render has an
    error of opacity alone, and its own time counts."""
    errors, panels = result["errors"].get(str(size), {}), {"colour": [], "opacity": []}
    for row in result["rows"]:
        error = errors.get(row["program"])
        if row["size"] != size or not error:
            continue
        ms = row.get("own_ms", row["ms"])
        if row["program"] != "vdb_render":
            panels["colour"].append((row["program"], ms, error["mean"]))
        panels["opacity"].append((row["program"], ms, error["opacity_mean"]))
    return {what: points for what, points in panels.items() if points}


def write_scene(options, result, whole):
    """Writes SCENE.md, and SCENE-SIZE.svg for each size."""
    with open(os.path.join(options.out, result["scene"] + ".md"), "w", encoding="utf-8") as file:
        file.write(scene_text(result, whole))
    for size in options.sizes:
        panels = panels_of(result, size)
        if not panels:
            continue
        path = os.path.join(options.out, "%s-%d.svg" % (result["scene"], size))
        title = "%s, %d x %d px, %d views: time and error" % (result["scene"], size, size,
                                                              options.views)
        with open(path, "w", encoding="utf-8") as file:
            file.write(plots.svg(title, panels))
        result.setdefault("plots", []).append(path)


def report(whole):
    out = ["Median ms per frame (ratio to triptych-cpu), %d views around the object, %d threads" %
           (whole["settings"]["views"], whole["settings"]["threads"]), "", table(whole["scenes"]), ""]
    for result in whole["scenes"]:
        if result["errors"]:
            for size in whole["settings"]["sizes"]:
                out += [accuracy.table(result, size), ""]
    out += ["- " + note for note in NOTES]
    for result in whole["scenes"]:
        out += ["- %s: skipped %s: %s." % (result["scene"], name, why)
                for name, why in result["left_out"].items()]
    out += ["", "Machine", ""]
    out += ["- %s: %s" % item for item in whole["machine"].items()]
    out += ["", "Settings", ""]
    out += ["- %s: %s" % item for item in whole["settings"].items()]
    out += ["", "Pictures", ""]
    for result in whole["scenes"]:
        out += ["- " + path for path in [result["pictures"], *result.get("plots", [])]]
    return "\n".join(out)


def parse_options():
    parser = argparse.ArgumentParser(prog="compare", description=__doc__)
    names = [scene.name for scene in scenes.SCENES]

    def comma(kind, allowed=None):
        def parse(text):
            items = [kind(item) for item in text.split(",")]
            for item in items:
                if allowed and item not in allowed:
                    raise argparse.ArgumentTypeError("invalid value %s; use %s" %
                                                     (item, ", ".join(allowed)))
            return items
        return parse

    parser.add_argument("--data", metavar="FOLDER",
                        help="folder with volumes, also in its subfolders; the included ones are "
                        "always found")
    parser.add_argument("--out", default="compare-results", metavar="FOLDER",
                        help="folder for pictures and results.json (default: %(default)s); "
                        "FOLDER/work keeps the prepared volumes")
    parser.add_argument("--triptych", required=True, metavar="PROGRAM",
                        help="the program (default: built here, preset release)")
    parser.add_argument("--scene", "--scenes", dest="scenes", type=comma(str, names), metavar="NAME[,..]",
                        help="scenes (default: all with a volume): " + ", ".join(names))
    parser.add_argument("--programs", type=comma(str, contenders.NAMES), default=contenders.NAMES,
                        metavar="NAME[,..]", help="programs to compare: " +
                        ", ".join(contenders.NAMES) + "; " + BASE + " always runs")
    parser.add_argument("--size", "--sizes", dest="sizes", type=comma(int), default=[512, 1024], metavar="N[,..]",
                        help="edges of the pictures in pixels (default: 512,1024)")
    parser.add_argument("--views", type=int, default=20,
                        help="number of views around the object (default: 20)")
    parser.add_argument("--threads", type=int, default=min(4, len(os.sched_getaffinity(0))),
                        help="threads of each program (default: %(default)s)")
    parser.add_argument("--rounds", type=int, default=3, help="turns of every program at all "
                        "views; 0 draws only pictures (default: 3)")
    parser.add_argument("--error-views", type=int, default=3, metavar="N", help="number of views "
                        "to measure errors of, at every size (default: 3)")
    parser.add_argument("--patience", type=float, default=60, metavar="SECONDS",
                        help="a program that needs longer for a round gets no other (default: 60)")
    parser.add_argument("--slow", type=float, default=3, metavar="SECONDS",
                        help="programs slower per frame draw every fourth view (default: 3)")
    parser.add_argument("--no-alignment", action="store_true", help="skip the check that all "
                        "programs show the same view")
    parser.add_argument("--tidy", action="store_true",
                        help="remove the prepared volumes of each scene")
    parser.add_argument("--json", action="store_true", help="print results.json instead of tables")
    options = parser.parse_args()
    if options.views < 1 or options.rounds < 0 or options.threads < 1:
        parser.error("--views and --threads must be at least 1, --rounds at least 0")
    options.programs = [BASE] + [name for name in options.programs if name != BASE]
    return options


def choose_scenes(options):
    folders = ([options.data] if options.data else []) + [scenes.INCLUDED]
    for scene in scenes.SCENES:
        if options.scenes and scene.name not in options.scenes:
            continue
        volume = scenes.find(scene, folders, os.path.join(options.out, "work"),
                             options.triptych)
        if volume:
            yield scene, volume
        else:
            log("%s: skipped: %s is not in %s" % (scene.name, scene.file, " or ".join(folders)))


def main():
    options = parse_options()
    os.makedirs(os.path.join(options.out, "work"), exist_ok=True)
    whole = {"machine": machine(options.triptych),
             "settings": {"views": options.views, "threads": options.threads,
                          "sizes": options.sizes, "rounds": options.rounds,
                          "error_views": min(options.views, options.error_views),
                          "patience_s": options.patience, "slow_s": options.slow},
             "notes": NOTES, "scenes": []}
    if not options.no_alignment:
        whole["alignment"] = check.cameras_agree(options, log)
    path = os.path.join(options.out, "results.json")
    for scene, volume in choose_scenes(options):
        load = os.getloadavg()[0]
        result = run_scene(options, scene, volume)
        result["load_before"], result["load_after"] = load, os.getloadavg()[0]
        write_scene(options, result, whole)
        whole["scenes"].append(result)
        whole["machine"]["load_after"] = result["load_after"]
        with open(path, "w", encoding="utf-8") as file:
            json.dump(whole, file, indent=1)
        log("so far\n" + table(whole["scenes"]))
    print(json.dumps(whole, indent=1) if options.json else report(whole))


if __name__ == "__main__":
    main()
