"""Tests that the JSON, the CSV and the page of `triptych accuracy` agree with one another. Also
compares them with figures computed here from the pictures of the report. FLIP is implemented a
second time from the paper, with two-dimensional kernels. SSIM is computed window by window."""
import csv
import html.parser
import json
import math
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time

import numpy

import program

SMALL = ["--size", "40x32", "--views", "2", "--repeat", "1", "--tolerance", "4e-3", "--quiet"]
STEPS = ("total", "pixel", "rays", "storage", "model", "method", "level", "precision")


def covered_errors(picture, truth):
    """Returns the errors in 255ths, for all channels of pixels that either picture covers."""
    covered = numpy.maximum(picture[..., 3], truth[..., 3]) > numpy.float32(1 / 255)
    return 255 * numpy.abs(picture - truth)[covered].ravel()


def promised(picture, truth):
    """Returns the error that 99 % of the covered pixels do not exceed in any channel, rounded up to
    hundredths."""
    pixels = numpy.sort(covered_errors(picture, truth).reshape(-1, 4).max(axis=1))
    return math.ceil(100 * pixels[math.ceil(0.99 * pixels.size) - 1]) / 100


def plain_ssim(a, b):
    """Returns the mean over windows of 11 x 11 pixels, for luminance over black."""
    weights = numpy.exp(-((numpy.arange(11) - 5) ** 2) / (2 * 1.5**2))
    weights = numpy.outer(weights, weights) / weights.sum() ** 2
    x, y = (p[..., :3] @ (0.299, 0.587, 0.114) for p in (a, b))
    values = []
    for j in range(x.shape[0] - 10):
        for i in range(x.shape[1] - 10):
            u, v = x[j : j + 11, i : i + 11], y[j : j + 11, i : i + 11]
            mu, mv = (weights * u).sum(), (weights * v).sum()
            uu, vv = (weights * (u - mu) ** 2).sum(), (weights * (v - mv) ** 2).sum()
            uv = (weights * (u - mu) * (v - mv)).sum()
            values.append((2 * mu * mv + 1e-4) * (2 * uv + 9e-4)
                          / ((mu**2 + mv**2 + 1e-4) * (uu + vv + 9e-4)))
    return numpy.mean(values)


def convolve(plane, kernel):
    """Convolves a plane. Edges are repeated."""
    reach = kernel.shape[0] // 2
    padded = numpy.pad(plane, reach, mode="edge")
    out = numpy.zeros_like(plane)
    for j in range(kernel.shape[0]):
        for i in range(kernel.shape[1]):
            out += kernel[j, i] * padded[j : j + plane.shape[0], i : i + plane.shape[1]]
    return out


def grid(reach):
    return numpy.meshgrid(*2 * (numpy.arange(-reach, reach + 1),))


XYZ = numpy.array([[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750],
                   [0.0193339, 0.1191920, 0.9503041]])
WHITE = XYZ.sum(axis=1)
PPD = 67


def relative(rgb):
    return rgb @ XYZ.T / WHITE


def hunt_lab(rgb):
    t, d = relative(rgb), 6 / 29
    f = numpy.where(t > d**3, numpy.cbrt(t), t / (3 * d * d) + 4 / 29)
    light = 116 * f[..., 1] - 16
    return numpy.stack([light, 5 * light * (f[..., 0] - f[..., 1]),
                        2 * light * (f[..., 1] - f[..., 2])], axis=-1)


def distance(a, b):
    d = numpy.abs(a - b)
    return d[..., 0] + numpy.hypot(d[..., 1], d[..., 2])


def seen(rgb):
    """Returns the colours after the contrast sensitivity of the eye."""
    t = relative(rgb)
    opponent = [116 * t[..., 1] - 16, 500 * (t[..., 0] - t[..., 1]), 200 * (t[..., 1] - t[..., 2])]
    curves = [(1, 0.0047, 0, 1e-5), (1, 0.0053, 0, 1e-5), (34.1, 0.04, 13.5, 0.025)]
    x, y = grid(math.ceil(3 * math.sqrt(0.04 / (2 * math.pi**2)) * PPD))
    squares = (x**2 + y**2) / PPD**2
    for c, (a1, b1, a2, b2) in enumerate(curves):
        kernel = sum(a * math.sqrt(math.pi / b) * numpy.exp(-math.pi**2 * squares / b)
                     for a, b in ((a1, b1), (a2, b2)))
        opponent[c] = convolve(opponent[c], kernel / kernel.sum())
    y = (opponent[0] + 16) / 116
    t = numpy.stack([opponent[1] / 500 + y, y, y - opponent[2] / 200], axis=-1)
    return numpy.clip(t * WHITE @ numpy.linalg.inv(XYZ).T, 0, 1)


def features(rgb, points):
    sigma = 0.5 * 0.082 * PPD
    x, y = grid(math.ceil(3 * sigma))
    kernel = numpy.exp(-(x**2 + y**2) / (2 * sigma**2)) * (x**2 / sigma**2 - 1 if points else x)
    kernel = numpy.where(kernel > 0, kernel / kernel[kernel > 0].sum(),
                         kernel / -kernel[kernel < 0].sum())
    light = relative(rgb)[..., 1]
    return numpy.hypot(convolve(light, kernel), convolve(light, kernel.T))


def plain_flip(a, b):
    rgb = [numpy.clip(p[..., :3], 0, 1) for p in (a, b)]
    rgb = [numpy.where(p <= 0.04045, p / 12.92, ((p + 0.055) / 1.055) ** 2.4) for p in rgb]
    most = distance(hunt_lab(numpy.array([0.0, 1, 0])), hunt_lab(numpy.array([0.0, 0, 1]))) ** 0.7
    e = distance(*(hunt_lab(seen(p)) for p in rgb)) ** 0.7
    knee = 0.4 * most
    colour = numpy.where(e < knee, 0.95 * e / knee, 0.95 + 0.05 * (e - knee) / (most - knee))
    feature = numpy.max([numpy.abs(features(rgb[0], points) - features(rgb[1], points))
                         for points in (False, True)], axis=0)
    return numpy.mean(colour ** (1 - (feature / math.sqrt(2)) ** 0.5))


class Page(html.parser.HTMLParser):
    def __init__(self):
        super().__init__()
        self.sources, self.tags, self.text = [], [], ""

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        self.sources += [value for name, value in attributes if name in ("src", "href")]

    def handle_data(self, data):
        self.text += data


class Accuracy(program.ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        os.chmod(".", 0o755)
        program.write_nrrd("a.nrrd", program.ball((24, 28, 40)))
        program.write("a.tf", b"40 1 0.5 0.2 0\n200 0.2 0.6 1 0.4\n")
        assert program.call("brick", "a.nrrd", "-q", "--keep-all", "--tile", "16",
                            "--levels-for", "both").returncode == 0
        run = program.call(
            "accuracy", "a.trip", "-o", "report", *SMALL, "--tf", "a.tf", "--pictures", "--source", "a.nrrd", "--steps",
            "--settings", "quality-high,post,post-samples-per-sheet-1,pre,pre-rgba8,pre-ewa,pre-lod-4,post-cubic,"
            "post-samples-2,popping-post",
            program=program.QUICK_PROGRAM)
        assert run.returncode == 0, run.stderr
        assert run.stderr == "", run.stderr
        cls.out = run.stdout.decode()
        with open("report/accuracy.json", encoding="utf-8") as f:
            cls.report = json.load(f)
        cls.rows = {row["name"]: row for row in cls.report["rows"]}

    def pictures(self, name):
        for view in range(2):
            yield (program.read_exr(f"report/{name}-{view}.exr"),
                   program.read_exr(f"report/truth-{view}.exr"))

    def test_figures_equal_figures_of_the_pictures(self):
        for name in "post", "post-samples-per-sheet-1", "pre", "pre-rgba8":
            total, pairs = self.rows[name]["total"], list(self.pictures(name))
            errors = [covered_errors(*pair) for pair in pairs]
            every = numpy.concatenate(errors)
            self.assertGreater(every.size, 1000)
            self.assertAlmostEqual(total["max"], every.max(), 2)
            self.assertAlmostEqual(total["mean"], every.mean(), 3)
            self.assertAlmostEqual(total["median"], numpy.median(every), 1)
            self.assertAlmostEqual(total["percentile_99"],
                                   numpy.percentile(every, 99, method="higher"), delta=0.02)
            self.assertEqual(self.rows[name]["error"], max(promised(*pair) for pair in pairs))
            self.assertAlmostEqual(total["psnr"],
                                   -10 * math.log10((every**2).mean() / 255**2), 2)
            self.assertAlmostEqual(total["ssim"], numpy.mean([plain_ssim(*p) for p in pairs]), 4)
            self.assertAlmostEqual(total["flip"], numpy.mean([plain_flip(*p) for p in pairs]), 4)

    def test_steps_have_separate_errors(self):
        """Rounded layers change only the precision, and samples per sheet only the method. Storage
        loses only the last bits, since all visible values and their neighbours are stored."""
        rows = self.rows
        self.assertLess(rows["post"]["storage"]["max"], 0.1)
        for name, row in rows.items():
            self.assertEqual("level" in row, name == "pre-lod-4", name)
            for step in "pixel", "rays", "storage", "model", "method", "precision":
                self.assertEqual(step in row, name != "quality-high", (name, step))
        self.assertEqual(rows["post"]["model"]["max"], 0)
        self.assertEqual(rows["pre-ewa"]["model"], rows["pre"]["model"])
        self.assertNotEqual(rows["pre-ewa"]["method"], rows["pre"]["method"])
        self.assertGreater(rows["post-cubic"]["model"]["max"], 1)
        self.assertLess(rows["post-cubic"]["method"]["mean"], 2 * rows["post"]["method"]["mean"])
        self.assertGreater(rows["pre"]["model"]["mean"], 0.5)
        self.assertEqual(rows["pre"]["method"], rows["pre-rgba8"]["method"])
        self.assertEqual(rows["pre"]["model"], rows["pre-rgba8"]["model"])
        self.assertLess(rows["pre"]["precision"]["max"], 0.05)
        self.assertGreater(rows["pre-rgba8"]["precision"]["mean"], 0.1)
        self.assertGreater(rows["pre-lod-4"]["level"]["max"], 1)
        self.assertLess(rows["post"]["total"]["mean"], rows["pre"]["total"]["mean"])
        for row in rows.values():
            self.assertGreater(row["ms"], 0)
            self.assertGreater(row["splats"], 0)
            self.assertGreater(row["bytes_read"], 0)
        self.assertGreater(rows["pre"]["splats_drawn"], 0)
        self.assertIsNone(rows["post"]["splats_drawn"])

    def turned(self, degrees, method):
        """Draws from a direction `degrees` from X towards Y in index space, at the distance of the
        first view."""
        view = self.report["views"][0]
        eye, look = numpy.array(view["eye"]), numpy.array(view["look"])
        way = numpy.array([math.cos(math.radians(degrees)), math.sin(math.radians(degrees)), 0.3])
        eye = look + way / numpy.linalg.norm(way) * numpy.linalg.norm(eye - look)
        return self.picture(
            "a.trip", "--size", "40x32", "--fov", repr(view["fov_degrees"]), "--tf", "a.tf",
            "--classify", "post", "--samples", "1", "--samples-per-sheet", "4", "--method", method, "--eye=" + ",".join(map(repr, map(float, eye))),
            "--look=" + ",".join(map(repr, view["look"])), "--up=0,0,1")

    def test_popping_equals_changes_between_pictures(self):
        rows = {row["settings"]: row for row in self.report["popping"]["popping-post"]}
        self.assertEqual(list(rows), ["merge, h 0", "merge, h 0.5", "merge, h 0.85", "merge, h 0.95",
                                      "merge, h 0.99", "clip", "axis"])
        steps = [self.turned(45 + 0.05 * (i - 20), "axis") for i in range(41)]
        changes = 255 * abs(numpy.diff(steps, axis=0)).max(axis=3).reshape(40, -1)
        changes = changes[:, changes.max(axis=0) > 0]
        motion = numpy.sort(changes, axis=0)[20]
        beyond = numpy.maximum(0, changes - motion)
        axis = rows["axis"]
        self.assertGreater(changes.shape[1], 300)
        self.assertAlmostEqual(axis["motion"], motion.mean(), 3)
        self.assertAlmostEqual(axis["mean"], beyond.mean(axis=1).max(), 3)
        self.assertAlmostEqual(axis["max"], beyond.max(), 2)
        self.assertAlmostEqual(
            axis["percentile_99"],
            max(numpy.sort(b)[(b.size - 1) * 99 // 100] for b in beyond), 2)
        for name, row in rows.items():
            if name.startswith("merge"):
                self.assertLess(row["mean"], axis["mean"] / 2)
        with open("report/index.html", encoding="utf-8") as f:
            self.assertIn("0.95</text>", f.read())

    def test_popping_is_left_out_in_little_memory(self):
        """A pixel needs 40 changes, the four components of the previous picture and one number for
        sorting, each of 4 bytes. The pictures to compare take half as much."""
        small = ["--size", "300x300", "--views", "1", "--repeat", "1", "--tolerance", "1e-2", "--quiet"]
        run = self.works("accuracy", "a.trip", "-o", "fits", *small, "--settings",
                         "post,popping-pre", "--memory", "108M")
        self.assertIn("left out: popping-pre: the changes need 16200000 bytes",
                      run.stdout.decode())
        with open("fits/accuracy.json", encoding="utf-8") as f:
            report = json.load(f)
        self.assertEqual([one["name"] for one in report["left_out"]], ["popping-pre"])
        self.assertEqual(report["popping"], {})

    def test_uneven_grids_are_measured(self):
        """Splats have an integral of their sum. Kernels other than linear cannot interpolate an
        uneven grid."""
        for axis, count in zip("xyz", (40, 28, 24)):
            places = " ".join(str(i + 0.3 * math.sin(i)) for i in range(count))
            program.write(f"{axis}.txt", places.encode())
        self.brick("a.nrrd", "uneven.trip", "--coordinates", "x.txt,y.txt,z.txt")
        run = self.works("accuracy", "uneven.trip", "-o", "uneven", *SMALL, "--tf", "a.tf", "--steps",
                         "--settings", "post,pre,post-cubic", program=program.QUICK_PROGRAM)
        with open("uneven/accuracy.json", encoding="utf-8") as f:
            report = json.load(f)
        models = {row["name"]: row["model"]["mean"] for row in report["rows"]}
        self.assertEqual(list(models), ["post", "pre"])
        self.assertTrue(models["post"] == 0 < models["pre"], models)
        self.assertIn("left out: post-cubic: uneven.trip: has uneven spacing", run.stdout.decode())

    def integral(self, view, rays, tolerance):
        """Draws the integral of a view of the report, along rays x rays rays per pixel."""
        view = self.report["views"][view]
        camera = [f"--{k}=" + ",".join(map(repr, view[k])) for k in ("eye", "look", "up")]
        camera += (["--fov", repr(view["fov_degrees"])] if "fov_degrees" in view
                   else ["--ortho", repr(view["ortho_height"])])
        return self.picture("a.nrrd", "--size", "40x32", "--tf", "a.tf", *camera, "--renderer", "integral",
                            "--field", "source", "--samples", str(rays), "--tolerance", repr(tolerance))

    def test_the_truth_is_the_mean_over_the_area_of_each_pixel(self):
        """The mean of 20 x 20 rays is closer to it than a tenth of the error of the closest row."""
        for view in range(2):
            truth = program.read_exr(f"report/truth-{view}.exr")
            apart = covered_errors(self.integral(view, 20, 1e-4), truth)
            self.assertLess(apart.mean(), 0.1 * self.rows["post-samples-2"]["total"]["mean"])
            self.assertLess(apart.mean(), 0.02)
            self.assertLess(apart.max(), 1)

    def test_pixel_and_rays_compare_with_the_integral_along_the_rays(self):
        for name, rays in ("post", 1), ("pre", 1), ("post-samples-2", 2):
            along = [self.integral(view, rays, 1e-4) for view in range(2)]
            pairs = list(self.pictures(name))
            pixel = numpy.concatenate([covered_errors(a, truth) for a, (_, truth) in zip(along, pairs)])
            apart = numpy.concatenate([covered_errors(p, a) for a, (p, _) in zip(along, pairs)])
            self.assertAlmostEqual(self.rows[name]["pixel"]["mean"], pixel.mean(), 3)
            self.assertAlmostEqual(self.rows[name]["rays"]["mean"], apart.mean(), 3)
            self.assertGreater(pixel.mean(), 0.01)
        self.assertLess(self.rows["post-samples-2"]["pixel"]["mean"], 0.5 * self.rows["post"]["pixel"]["mean"])

    def test_without_steps_only_single_rays_are_compared_along_rays(self):
        self.works("accuracy", "a.trip", "-o", "single-rays", *SMALL, "--tf", "a.tf", "--settings",
                   "quality-*,post,post-samples-2")
        with open("single-rays/accuracy.json", encoding="utf-8") as f:
            rows = {row["name"]: row for row in json.load(f)["rows"]}
        self.assertEqual([name for name in rows if "rays" in rows[name]], ["post"])
        self.assertEqual([name for name in rows if "pixel" in rows[name]], ["post"])
        self.assertEqual({name: row["promise"] for name, row in rows.items() if "promise" in row},
                         {"quality-draft": 4, "quality-normal": 1, "quality-high": 0.3})

    def test_settings_left_out_are_listed(self):
        self.assertEqual(self.report["left_out"], [])
        self.brick("a.nrrd", "flat.trip", "--levels", "0")
        run = self.works("accuracy", "flat.trip", "-o", "flat", *SMALL, "--tf", "a.tf", "--settings",
                         "post,post-lod-1")
        with open("flat/accuracy.json", encoding="utf-8") as f:
            [left_out] = json.load(f)["left_out"]
        self.assertEqual(left_out["name"], "post-lod-1")
        self.assertIn("no coarse levels", left_out["why"])
        self.assertIn("left out: post-lod-1: ", run.stdout.decode())

    def test_csv_has_the_same_figures(self):
        with open("report/accuracy.csv", encoding="utf-8", newline="") as f:
            lines = list(csv.DictReader(f))
        self.assertEqual([line["name"] for line in lines], list(self.rows))
        for line in lines:
            row = self.rows[line["name"]]
            self.assertAlmostEqual(float(line["ms"]), row["ms"], 4)
            self.assertEqual(line["options"],
                             " ".join(f"--{k} {v}" for k, v in row["options"].items()))
            for step in STEPS:
                if step in row:
                    self.assertAlmostEqual(float(line[f"{step}_mean"]), row[step]["mean"], 5)
                else:
                    self.assertEqual(line[f"{step}_mean"], "")

    def test_printed_options_draw_the_same_pictures(self):
        view = self.report["views"][0]
        camera = ["--size", "40x32", "--fov", repr(view["fov_degrees"]), "--tf", "a.tf"]
        camera += [f"--{k}=" + ",".join(map(repr, view[k])) for k in ("eye", "look", "up")]
        for name in "post", "pre-rgba8", "pre-ewa", "post-cubic":
            options = [x for k, v in self.rows[name]["options"].items() for x in ("--" + k, v)]
            again = self.picture("a.trip", *camera, *options)
            self.assertTrue((again == program.read_exr(f"report/{name}-0.exr")).all())

    def printed_rows(self, out):
        """Returns name, time and error of each row of the first printed table."""
        table = re.search(r"(?m)^\| setting .*\n\|-.*\n((?:\|.*\n)+)", out)[1]
        rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines()]
        return [(name.removesuffix(" *"), float(ms), float(error)) for name, ms, error, *_ in rows]

    def test_the_table_has_one_error_for_each_setting(self):
        """The fastest setting comes first."""
        rows = self.printed_rows(self.out)
        self.assertEqual([name for name, _, _ in rows],
                         sorted(self.rows, key=lambda name: self.rows[name]["ms"]))
        for name, ms, error in rows:
            self.assertAlmostEqual(ms, self.rows[name]["ms"], delta=0.06)
            self.assertEqual(error, self.rows[name]["error"])
        self.assertEqual(self.out.count("\nerror: "), 1)
        self.assertIn("`triptych render a.trip --error E --report report`", self.out)

    def test_an_error_bound_selects_the_first_row_within_it(self):
        """The bound may equal the printed error."""
        rows = self.printed_rows(self.out)
        bounds = sorted({error for _, _, error in rows})
        for bound in bounds + [e - 0.001 for e in bounds[1:]] + [255]:
            name = next(name for name, _, error in rows if error <= bound)
            run = self.works("render", "a.trip", "-o", "e.exr", "--size", "40x32", "--tf", "a.tf",
                             "--report", "report", "--error", repr(bound))
            self.assertIn(f"note: --error: uses {name}, measured error {self.rows[name]['error']:.2f} ",
                          run.stderr)
        self.fails(1, "render", "a.trip", "-o", "e.exr", "--report", "report", "--error",
                   repr(bounds[0] - 0.001), says="has the smallest")

    def test_an_error_bound_draws_the_selected_settings(self):
        view = ["--size", "40x32", "--tf", "a.tf", "--report", "report"]
        bound = self.rows["pre"]["error"]
        fits = [r for r in self.rows.values() if r["error"] <= bound]
        fastest = min(fits, key=lambda r: r["ms"])
        options = [x for k, v in fastest["options"].items() for x in ("--" + k, v)]
        drawn = self.picture("a.trip", *view[:4], *options)
        run = self.works("render", "a.trip", "-o", "e.exr", *view, "--error", repr(bound))
        self.assertIn(f"note: --error: uses {fastest['name']}, ", run.stderr)
        self.assertTrue((program.read_exr("e.exr") == drawn).all())
        run = self.works("render", "a.trip", "-o", "e.exr", "--size", "40x32", "--report", "report",
                         "--error", "255", "--no-shading")
        self.assertIn("the data set's own; errors", run.stderr)
        self.assertIn("measured with light", run.stderr)

    def test_the_reason_of_a_refused_data_set_names_its_path_once(self):
        program.write("no.trip", b"text")
        run = self.fails(1, "accuracy", "no.trip", "-o", "no", says="accuracy: no.trip: is not a data set")
        self.assertEqual(run.stderr.count("no.trip"), 1)

    def test_an_error_bound_without_a_report_is_refused(self):
        size = ["--size", "40x32", "-o", "e.exr"]
        self.fails(1, "render", "a.trip", *size, "--error", "1",
                   says="a.accuracy/accuracy.json: does not exist; `triptych accuracy NAME.trip` makes")
        self.fails(1, "render", "a.trip", *size, "--error", "1", "--report", "a.tf", says="accuracy.json")
        self.fails(1, "render", "a.trip", *size, "--error", "1e-6", "--report", "report",
                   says="has the smallest")

    def test_a_report_applies_only_to_its_data_set(self):
        """A data set bricked again with the same options counts as the same. Any other does not."""
        size = ["--size", "40x32", "-o", "e.exr", "--tf", "a.tf", "--error", "255"]
        for name, options in ("again", ["--keep-all"]), ("other", ["--range", "60:255"]):
            self.works("brick", "a.nrrd", "-q", "--tile", "16", "--levels-for", "both", "-o",
                       name + ".trip", *options)
        self.works("render", "again.trip", *size, "--report", "report")
        self.fails(1, "render", "other.trip", *size, "--report", "report", says="another data set")
        run = program.call("render", "a.nrrd", *size[:4], "--error", "255", "--report", "report")
        self.assertEqual(run.returncode, 1)
        self.assertIn("triptych: --error: a.nrrd: the report measured another data set", run.stderr)

    def test_a_volume_is_bricked_with_the_levels_of_its_report(self):
        """This holds whichever setting is the fastest."""
        program.write_nrrd("long.nrrd", program.ball((20, 24, 80)))
        for levels in "auto", "pre", "both":
            data = levels + ".trip"
            self.works("brick", "long.nrrd", "-q", "--levels-for", levels, "-o", data)
            self.works("accuracy", data, "-o", levels, *SMALL, "--settings",
                       "post,pre,post-lod-4,pre-lod-4")
            with open(levels + "/accuracy.json", encoding="utf-8") as f:
                report = json.load(f)
            self.assertEqual(len(report["rows"]), 4 if levels == "both" else 3)
            for fastest in report["rows"]:
                for row in report["rows"]:
                    row["ms"] = 1 if row is fastest else 2
                with open(levels + "/accuracy.json", "w", encoding="utf-8") as f:
                    json.dump(report, f)
                options = ["--size", "40x32", "--error", "255", "--report", levels]
                self.assertTrue((self.picture("long.nrrd", *options)
                                 == self.picture(data, *options)).all())

    def test_qualities_select_settings(self):
        """An explicit option wins over --quality, wherever it stands."""
        draw = lambda *options: self.picture("a.trip", "--size", "40x32", "--tf", "a.tf", *options)
        one_ray = "--samples", "1", "--lod", "0"
        size = "--size", "40x32", "--tf", "a.tf"
        rays = self.stats("a.trip", *size, "--quality", "exact")["samples"]
        self.assertTrue(4 <= rays <= 16)
        exact = "--samples", rays, "--lod", "0", "--early-termination", 1 / 8192
        same = {("--quality", "draft", "--samples-per-sheet", "1", *one_ray):
                ("--samples-per-sheet", "1", *one_ray),
                ("--quality", "normal"): (),
                ("--samples-per-sheet", "8", *one_ray, "--quality", "high"):
                ("--samples-per-sheet", "8", *one_ray),
                ("--quality", "exact"): ("--samples-per-sheet", "16", *exact),
                ("--samples-per-sheet", "2", "--quality", "exact"): ("--samples-per-sheet", "2", *exact),
                ("--quality", "draft", "--classify", "pre"): ("--classify", "pre")}
        pictures = [draw(*options) for options in same]
        for options, picture in zip(same, pictures):
            self.assertTrue((draw(*same[options]) == picture).all(), options)
        for a, b in ((0, 1), (1, 2), (2, 3)):
            self.assertTrue((pictures[a] != pictures[b]).any())

    def test_the_page_contains_its_pictures(self):
        page = Page()
        with open("report/index.html", encoding="utf-8") as f:
            page.feed(f.read())
        self.assertEqual(page.tags.count("svg"), 3)
        self.assertEqual(page.tags.count("img"), 1 + 2 * len(self.rows))
        for source in page.sources:
            self.assertTrue(source.startswith("data:image/png;base64,"), source[:40])
        for name in self.rows:
            self.assertIn(name, page.text)
        self.assertNotIn("nan", page.text)

    def test_the_page_opens_in_chromium(self):
        chromium = shutil.which("chromium")
        if not chromium or program.SANITIZED:
            self.skipTest("chromium is not installed")
        with tempfile.TemporaryDirectory() as home:
            run = subprocess.run(
                [chromium, "--headless", "--no-sandbox", "--disable-gpu", "--dump-dom",
                 "--user-data-dir=" + home, "file://" + os.path.abspath("report/index.html")],
                stdout=subprocess.PIPE, stderr=subprocess.PIPE, timeout=120, text=True, check=False)
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertEqual(run.stdout.count("<svg"), 3)
        self.assertIn("</html>", run.stdout)

    def test_the_time_budget_limits_the_work(self):
        self.works("accuracy", "a.trip", "-o", "unsplit", *SMALL, "--budget", "0", "--settings", "post,pre*")
        with open("unsplit/accuracy.json", encoding="utf-8") as f:
            report = json.load(f)
        self.assertEqual([row["name"] for row in report["rows"]], ["post"])
        self.assertNotIn("method", report["rows"][0])
        self.assertEqual(report["views_left_out"], 1)
        self.assertIn("pre", [one["name"] for one in report["left_out"]])

    def steps_of_progress(self, *arguments):
        """Returns pairs of the counter, and stderr."""
        small = [a for a in SMALL if a != "--quiet"]
        run = self.works("accuracy", "a.trip", "-o", "counted", "--force", *small, *arguments)
        lines = re.findall(r"(?m)^accuracy  \d+:\d\d  step (\d+) of (\d+): ", run.stderr)
        return [(int(step), int(end)) for step, end in lines], run.stderr

    def test_progress_ends_exactly_at_its_end(self):
        """A step is the integral of a view, a setting in a view, or a row of popping."""
        self.brick("a.nrrd", "bare.trip", "--tf", "a.tf", "--halo", "0")
        coarse = ["--settings", "post,pre-lod-4,post-samples-2"]
        cases = [([], 2 * (1 + 20)),
                 (["--source", "a.nrrd"], 2 * (1 + 20)),
                 (["--settings", "post,pre"], 2 * (1 + 2)),
                 (["--settings", "post,pre,post-cubic", "--steps"], 2 * (1 + 3)),
                 (["--settings", "post,pre,post-cubic", "--steps", "--source", "a.nrrd"], 2 * (1 + 3)),
                 (["--settings", "popping-pre"], 2 + 7),
                 (["--settings", "post,popping-post"], 2 * (1 + 1) + 7),
                 ([*coarse, "--steps"], 2 * (1 + 3)),
                 (["--settings", "post,pre", "--also", "bare.trip"], 2 * (1 + 2)),
                 (["--also", "bare.trip"], 2 * (1 + 22)),
                 (["--settings", "post,pre", "--budget", "0"], 1 + 1),
                 (["--settings", "post,popping-pre", "--budget", "0"], 1 + 1),
                 (["--settings", "post", "--source", "a.nrrd", "--compare", "exit 3"], 2 * (1 + 1) + 1)]
        for arguments, steps in cases:
            pairs, _ = self.steps_of_progress(*arguments)
            self.assertTrue(all(step <= end for step, end in pairs), (arguments, pairs))
            self.assertEqual(pairs[-1], (steps, steps), arguments)

    def test_the_start_says_how_long_it_takes(self):
        _, err = self.steps_of_progress()
        first, second, *rest = err.splitlines()
        self.assertRegex(first, r"^triptych: note: accuracy: 20 settings in 2 views take about \d+ seconds$")
        self.assertRegex(second, r"^triptych: note: accuracy: left out: \d+ other settings, which "
                                 r"--settings all measures; ")
        self.assertRegex(rest[0], r"^accuracy  0:00")
        _, err = self.steps_of_progress("--settings", "post", "--views", "1")
        self.assertRegex(err, r"^triptych: note: accuracy: 1 settings in 1 views take about \d+ seconds\naccuracy ")

    def test_all_settings_can_be_measured(self):
        listed = program.call("accuracy", "--list").stdout.decode().split("\n")
        names = {line.split()[0] for line in listed if line}
        self.works("accuracy", "a.trip", "-o", "all", *SMALL, "--settings", "all", "--budget", "0")
        with open("all/accuracy.json", encoding="utf-8") as f:
            report = json.load(f)
        seen = [one["name"] for one in report["rows"] + report["left_out"]]
        self.assertEqual(len(seen), len(set(seen)))
        self.assertEqual(names - set(seen), {"vtk"})  # it requires --source

    def test_other_data_sets_are_compared(self):
        self.brick("a.nrrd", "bare.trip", "--tf", "a.tf", "--halo", "0")
        self.works("accuracy", "a.trip", "-o", "beside", *SMALL, "--steps", "--source", "a.nrrd",
                   "--settings", "post,post-bare.trip", "--also", "bare.trip")
        with open("beside/accuracy.json", encoding="utf-8") as f:
            whole, bare = json.load(f)["rows"]
        self.assertEqual(bare["data_set"], "bare.trip")
        self.assertGreater(bare["total"]["mean"], whole["total"]["mean"])
        self.assertGreater(bare["storage"]["mean"], whole["storage"]["mean"])

    def test_other_programs_are_compared(self):
        """A program that draws nothing has the error of an empty picture, and the time that it
        reports."""
        program.write("beside.py", b"""
import json, sys
job = json.loads(sys.stdin.readline())
assert job["dims"] == [40, 28, 24] and "values data" in job["tf"] and job["volume"].endswith("a.nrrd")
print(json.dumps({"name": "nothing", "version": "1.5"}), flush=True)
for line in sys.stdin:
    view = json.loads(line)
    print(json.dumps({"ms": 12.5}), flush=True)
    if view.get("picture"):
        open(view["picture"], "wb").write(bytes(4 * view["size"][0] * view["size"][1]))
        print("{}", flush=True)
""")
        self.works("accuracy", "a.trip", "-o", "others", *SMALL, "--source", "a.nrrd",
                   "--tf", "a.tf", "--settings", "post", "--pictures", "--compare",
                   f"{sys.executable} beside.py", "--compare", "exit 3")
        with open("others/accuracy.json", encoding="utf-8") as f:
            report = json.load(f)
        [row] = report["compared"]
        self.assertEqual([row["name"], row["version"], row["ms"]], ["nothing", "1.5", 12.5])
        errors = [covered_errors(numpy.zeros_like(truth), truth)
                  for truth in (program.read_exr(f"others/truth-{view}.exr") for view in range(2))]
        self.assertAlmostEqual(row["total"]["mean"], numpy.concatenate(errors).mean(), delta=0.01)
        self.assertEqual([r["name"] for r in report["rows"]], ["post"])
        [left_out] = report["left_out"]
        self.assertIn("the program has ended", left_out["why"])
        with open("others/index.html", encoding="utf-8") as f:
            page = f.read()
        self.assertEqual(page.count("<title>nothing: 12.5, "), 2)
        self.assertFalse(os.path.exists("others/program.raw"))

    def test_vtk_is_compared_if_installed(self):
        worker = os.path.join(os.path.dirname(program.DATASETS), "accuracy", "vtk_worker.py")
        if not shutil.which("xvfb-run") or subprocess.run(
                [sys.executable, "-c", "import vtkmodules.vtkRenderingVolume"],
                capture_output=True).returncode:
            self.skipTest("VTK for Python or xvfb-run is not installed")
        self.works("accuracy", "a.trip", "-o", "vtk", *SMALL, "--source", "a.nrrd", "--tf",
                   "a.tf", "--no-shading", "--settings", "post", "--compare",
                   f"xvfb-run -a {sys.executable} {worker} --step 0.5")
        with open("vtk/accuracy.json", encoding="utf-8") as f:
            [row] = json.load(f)["compared"]
        self.assertEqual(row["name"], "vtk-cpu-step-0.5")
        self.assertLess(row["total"]["mean"], 8)
        # The setting `vtk` starts VTK without --compare; `--compare none` prevents this.
        path = {**os.environ, "PATH": os.path.dirname(sys.executable) + ":" + os.environ["PATH"]}
        for arguments, beside in (["--settings", "post,vtk"], [row["name"]]), (
                ["--settings", "post,vtk", "--compare", "none"], []), (["--settings", "post"], []):
            self.works("accuracy", "a.trip", "-o", "vtk", "--force", *SMALL, "--source",
                       "a.nrrd", "--tf", "a.tf", "--no-shading", *arguments, env=path)
            with open("vtk/accuracy.json", encoding="utf-8") as f:
                report = json.load(f)
            self.assertEqual([one["name"] for one in report["compared"]], beside)
            if beside:
                self.assertEqual(report["compared"][0]["total"], row["total"])
        self.fails(2, "accuracy", "a.trip", "--compare", "none", "--compare", "true", says="--compare")

    # Faults

    def test_an_existing_folder_stays_without_force(self):
        self.leaves_nothing(1, "accuracy", "a.trip", "-o", "report", *SMALL, "--tf", "a.tf", says="--force")
        os.mkdir("mine")
        program.write("mine/letter.txt", b"dear")
        self.leaves_nothing(1, "accuracy", "a.trip", "-o", "mine", "--force", *SMALL,
                            says="not a report")
        self.assertEqual(os.listdir("mine"), ["letter.txt"])

    def test_invalid_input_is_refused(self):
        self.fails(1, "accuracy", "none.trip", "-o", "x", says="cannot open")
        self.leaves_nothing(2, "accuracy", says="NAME.trip")
        self.leaves_nothing(2, "accuracy", "a.trip", "--size", "8x8", says="32 to 4096")
        self.leaves_nothing(2, "accuracy", "a.trip", "-o", "out", "--settings", "none",
                            says="--list")
        self.leaves_nothing(1, "accuracy", "missing.trip", "-o", "out", *SMALL)
        self.leaves_nothing(1, "accuracy", "a.nrrd", "-o", "out", *SMALL)
        self.leaves_nothing(1, "accuracy", "a.trip", "-o", "out", "--tf", "missing.tf", *SMALL)
        self.leaves_nothing(1, "accuracy", "a.trip", "-o", "out", "--source", "missing.nrrd",
                            *SMALL)
        self.leaves_nothing(1, "accuracy", "a.trip", "-o", "nowhere/out", *SMALL,
                            says="cannot create")
        self.leaves_nothing(1, "accuracy", "a.trip", "-o", "out", "--memory", "64K", *SMALL)

    def test_a_full_disk_leaves_nothing(self):
        """A limit on the size of files stands for a full disk."""
        self.leaves_nothing(1, "accuracy", "a.trip", "-o", "out", *SMALL,                             "--settings", "post", preexec_fn=lambda: resource.setrlimit(
                                resource.RLIMIT_FSIZE, (2048, 2048)))

    def test_missing_permission_is_one_line(self):
        os.mkdir("closed", 0o555)
        if os.getuid() == 0 and os.access("closed", os.W_OK):
            identity = {"user": 65534, "group": 65534, "extra_groups": []}
            try:
                if program.call("--version", **identity).returncode:
                    self.skipTest("another user cannot run the program where it lies")
            except PermissionError:
                self.skipTest("another user cannot run the program where it lies")
        else:
            identity = {}
        self.fails(1, "accuracy", "a.trip", "-o", "closed/out", *SMALL, says="cannot create",
                   **identity)

    def test_an_interrupt_leaves_nothing(self):
        before = set(os.listdir("."))
        process = program.start("accuracy", "a.trip", "-o", "out", "--views", "1000", "--quiet")
        program.await_handler(process)
        while process.poll() is None and set(os.listdir(".")) == before:
            time.sleep(0.01)
        time.sleep(0.2)
        process.send_signal(signal.SIGINT)
        err = process.communicate(timeout=60)[1].decode()
        self.assertEqual(process.returncode, 1, err)
        self.assertRegex(err, r"^triptych: .*interrupted\n$")
        self.assertEqual(set(os.listdir(".")), before)


if __name__ == "__main__":
    program.main()
