"""The compared programs with a common interface. `draw(view, size)` returns milliseconds, and
`picture(view, size, path)` writes the picture. Triptych times views itself, with `time_views`."""
import json
import os
import re
import subprocess
import sys
import tempfile
import time

from prepare import DENSITY_SCALE

HERE = os.path.dirname(os.path.abspath(__file__))


class Unavailable(Exception):
    """Raised if a program cannot draw a scene; the message gives the reason."""


def _run(command, **options):
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          errors="replace", **options)
    if done.returncode:
        last = (done.stdout.strip().splitlines() or ["exit status %d" % done.returncode])[-1]
        raise Unavailable(last.strip())
    return done.stdout


def _environment(threads):
    """Returns the environment with the number of threads for Mesa's software OpenGL."""
    return dict(os.environ, LP_NUM_THREADS=str(threads))


def _numbers(values):
    return ",".join(repr(float(v)) for v in values)


class Triptych:
    """Runs `triptych bench renderers`, which draws each frame from the data set in memory."""

    # `bench renderers` draws one ray per pixel at the finest level, and has no options for others.
    ONE_RAY = "--samples", "1", "--lod", "0"

    def __init__(self, prepared, renderer, threads, name=None, look=()):
        self.prepared, self.renderer, self.threads = prepared, renderer, threads
        self.name = name or "triptych-" + renderer
        look = list(look) if "--classify" in look else ["--classify", "pre", *look]
        self.look = look + ([] if prepared.scene.shading else ["--no-shading"])
        self.device = None

    def time_views(self, size, views):
        text = _run([self.prepared.triptych, "bench", "renderers", self.prepared.dataset,
                     "--renderer", self.renderer, "--threads", str(self.threads), "--size",
                     "%dx%d" % (size, size), "--views", str(views), "--no-counts", "--json"] +
                    self.look, env=_environment(self.threads))
        report = json.loads(text[text.index("{"):])
        rows = report["tables"]["renderers"]["rows"]
        if not rows:
            raise Unavailable(report["limits"][-1])
        self.device = rows[0]["device"]
        return rows[0]["each_view"]

    def picture(self, view, size, path):
        _run([self.prepared.triptych, "render", self.prepared.dataset, "-o", path, "--renderer",
              self.renderer, "--threads", str(self.threads), "--size", "%dx%d" % (size, size),
              "--eye=" + _numbers(view["eye"]), "--look=" + _numbers(view["look"]),
              "--up=" + _numbers(view["up"]), "--fov", repr(view["fov_degrees"]), "--background",
              "none", *self.ONE_RAY] + self.look)

    def close(self):
        pass


class Quality(Triptych):
    """Runs `triptych render --quality NAME` along a path with a key for each view. The first view is
    drawn twice, and its first frame does not count."""
    ONE_RAY = ()

    def __init__(self, prepared, quality, threads):
        super().__init__(prepared, "cpu", threads, "triptych-" + quality,
                         ["--classify", "auto", "--quality", quality])

    def time_views(self, size, views):
        views = Triptych(self.prepared, "cpu", self.threads).time_views(64, views)
        with tempfile.TemporaryDirectory() as folder:
            path, stats = os.path.join(folder, "path.json"), os.path.join(folder, "stats.json")
            keys = [{"seconds": second, "eye": view["eye"], "look": view["look"],
                     "up": view["up"], "fov": view["fov_degrees"]}
                    for second, view in enumerate(views[:1] + views)]
            with open(path, "w", encoding="utf-8") as file:
                json.dump({"triptych_path": 1, "frames_per_second": 1, "keys": keys}, file)
            _run([self.prepared.triptych, "render", self.prepared.dataset, "-o",
                  os.path.join(folder, "p.png"), "--path", path, "--stats", stats, "--in-flight",
                  "1", "--renderer", "cpu", "--threads", str(self.threads), "--size",
                  "%dx%d" % (size, size)] + self.look)
            with open(stats, encoding="utf-8") as file:
                report = json.load(file)
        self.device = report["device"]
        return [dict(view, ms=[frame["ms"]]) for view, frame in zip(views, report["frames"][1:])]


class Vtk:
    """Runs accuracy/vtk_worker.py, a process that keeps the volume and the window."""

    def __init__(self, prepared, mapper, threads, name=None, step=1):
        self.name = name or "vtk-" + mapper
        job = {"mapper": mapper, "step": step, "volume": prepared.array(), "threads": threads,
               "index_to_world": prepared.info["index_to_world"],
               "function": prepared.function, "shading": prepared.scene.shading}
        self.process = subprocess.Popen(
            [sys.executable, os.path.join(HERE, "..", "..", "accuracy", "vtk_worker.py")], stdin=subprocess.PIPE,
            stdout=subprocess.PIPE, text=True, env=_environment(threads))
        about = self._ask(job)
        self.version = about["version"]
        self.device = about["device"] if mapper == "gpu" else "CPU, %d threads" % threads
        self.display_ms = []

    def _ask(self, what):
        try:
            print(json.dumps(what), file=self.process.stdin, flush=True)
        except BrokenPipeError:
            pass
        return self._answer()

    def _answer(self):
        line = self.process.stdout.readline()
        if not line:
            raise Unavailable("VTK ended with status %d" % self.process.wait())
        return json.loads(line)

    def draw(self, view, size):
        result = self._ask(dict(view, size=size))
        self.display_ms.append(result["display_ms"])
        return {"ms": result["ms"]}

    def picture(self, view, size, path):
        self._ask(dict(view, size=size, picture=path))
        self._answer()

    def close(self):
        self.process.stdin.close()
        self.process.wait()


class VdbRender:
    """Runs vdb_render, one process per picture, and also stores the ray tracing time that it
    reports."""

    def __init__(self, prepared, threads):
        self.name = "vdb_render"
        if not prepared.voxels_are_cubes():
            raise Unavailable("it draws only grids with cubic voxels")
        self.grid, self.threads = prepared.grid(), threads
        self.scratch = os.path.join(prepared.work, "vdb_render.png")
        self.device = "CPU, %d threads" % threads

    def _command(self, view, size, path):
        # With scattering alone, in white light without shadows, the picture equals the opacity. A
        # shadow ray with steps of 10^9 voxels takes no sample.
        scatter = _numbers([1 / DENSITY_SCALE] * 3)
        return ["vdb_render", self.grid, path, "-translate", _numbers(view["eye"]), "-lookat",
                _numbers(view["look"]), "-up", _numbers(view["up"]), "-fov",
                repr(view["fov_degrees"]), "-res", "%dx%d" % (size, size), "-cpus",
                str(self.threads), "-absorb", "0,0,0", "-scatter", scatter, "-light",
                "0,0,1,1,1,1", "-shadowstep", "1e9", "-step", "1", "-v"]

    def draw(self, view, size):
        start = time.perf_counter()
        text = _run(self._command(view, size, self.scratch))
        whole = (time.perf_counter() - start) * 1e3
        traced = re.search(r"ray-tracing.*?completed in ([0-9.e+-]+) sec", text, re.S)
        return {"ms": whole, "own_ms": float(traced.group(1)) * 1e3 if traced else whole}

    def picture(self, view, size, path):
        _run(self._command(view, size, path))

    def close(self):
        pass


POST = "triptych-post-"  # followed by the samples per sheet
QUALITIES = ["draft", "normal", "high"]
NAMES = ["triptych-cpu", *["triptych-" + quality for quality in QUALITIES], POST + "1", POST + "2", POST + "4", "triptych-gl", "vtk-cpu",
         "vtk-cpu-half", "vtk-gpu", "vdb_render"]


def make(name, prepared, threads):
    if name.startswith(POST):
        return Triptych(prepared, "cpu", threads, name,
                        ["--classify", "post", "--samples-per-sheet", name[len(POST):]])
    if name[len("triptych-"):] in QUALITIES:
        return Quality(prepared, name[len("triptych-"):], threads)
    if name == "vtk-cpu-half":
        return Vtk(prepared, "cpu", threads, name, 0.5)
    if name.startswith("triptych-"):
        return Triptych(prepared, name[len("triptych-"):], threads)
    if name.startswith("vtk-"):
        return Vtk(prepared, name[len("vtk-"):], threads)
    return VdbRender(prepared, threads)
