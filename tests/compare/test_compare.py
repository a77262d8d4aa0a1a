"""Tests compare.py and screen.py on one tiny scene by Triptych alone, the plots, and the generated
volumes."""
import json
import os
import re
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree as xml

try:
    import numpy  # noqa: F401
    import PIL  # noqa: F401
except ImportError as lacking:
    print("skipped: %s" % lacking)
    sys.exit(77)

import functions
import generated
import plots
import screen

HERE = os.path.dirname(os.path.abspath(__file__))


class CompareTest(unittest.TestCase):
    def test_one_scene_has_a_table_a_plot_and_errors(self):
        with tempfile.TemporaryDirectory() as out:
            subprocess.run(
                [sys.executable, "-B", os.path.join(HERE, "compare.py"), "--triptych",
                 os.environ["TRIP_PROGRAM"], "--out", out, "--scene", "tooth", "--size", "48",
                 "--views", "2", "--rounds", "1", "--error-views", "1", "--no-alignment",
                 "--programs", "triptych-cpu,triptych-post-1,triptych-post-4,triptych-high"],
                check=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
            with open(os.path.join(out, "results.json"), encoding="utf-8") as file:
                result, = json.load(file)["scenes"]
            errors = result["errors"]["48"]
            rays = {name: error["ray_mean"] for name, error in errors.items()}
            self.assertGreater(rays["triptych-cpu"], rays["triptych-post-1"])
            self.assertGreater(rays["triptych-post-1"], rays["triptych-post-4"])
            # Voxels are a quarter of a pixel wide, so one ray is far from the mean over the area.
            self.assertGreater(errors["triptych-post-4"]["mean"], 4 * rays["triptych-post-4"])
            self.assertTrue(all(row["ms"] > 0 for row in result["rows"]))
            with open(os.path.join(out, "tooth.md"), encoding="utf-8") as file:
                table = file.read()
            for name in errors:
                self.assertRegex(table, r"(?m)^\| %s \| [0-9.]+ \|" % re.escape(name))
            self.assertIn("- Errors: of 255", table)
            plot = xml.parse(os.path.join(out, "tooth-48.svg"))
            self.assertEqual(len(plot.findall(".//{*}circle")), 2 * len(errors))
            self.assertTrue(os.path.exists(os.path.join(out, "tooth.png")))

    def test_screen_measures_errors_against_areas(self):
        with tempfile.TemporaryDirectory() as out:
            triptych = os.environ["TRIP_PROGRAM"]
            subprocess.run(
                [sys.executable, "-B", os.path.join(HERE, "screen.py"), "pixels", "functions",
                 "--triptych", triptych, "--out", out, "--volumes", "tooth", "--voxels-per-px", "6",
                 "--functions", "gentle,step", "--sizes", "24"],
                check=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
            with open(os.path.join(out, "results.json"), encoding="utf-8") as file:
                results = json.load(file)
            one, = results["pixels"]
            self.assertEqual(one["drawn"]["exact"], 1)
            self.assertLess(one["drawn"]["coarse, 2 x 2 rays"], 1 / 3)  # levels 1 and 2: 1/8, 1/64
            self.assertLess(one["errors"]["draft"], screen.PROMISES["draft"])
            self.assertLess(one["errors"]["exact"], one["errors"]["2 x 2 rays"])
            gentle, step = results["functions"]
            self.assertGreater(step["errors"]["draft"], gentle["errors"]["draft"])
            # The renderer `integral` converges to the mean over each area by its own squares.
            path = os.path.join(out, "area.exr")
            subprocess.run([triptych, "render", os.path.join(out, "work", "tooth.trip"), "-o", path,
                            "--renderer", "integral", "--size", str(one["size"])], check=True,
                           stdout=subprocess.PIPE, stderr=subprocess.PIPE)
            truth = numpy.load(os.path.join(out, "work", "tooth-%d-8.npy" % one["size"]))
            self.assertLess(screen.error_of(screen.read_exr(path), truth), 0.25)

    def test_functions_with_sharp_edges_have_the_stated_widths(self):
        def opacity(kind, values):
            with tempfile.NamedTemporaryFile("w", suffix=".tf") as file:
                file.write(screen.function_text(kind, 0, 2550))
                file.flush()
                points = functions.read(file.name)
            found = numpy.interp(values, [p[0] for p in points], [p[4] for p in points])
            return numpy.round(found, 6).tolist()
        # A value is a 255th of the range, here 10. The peak has this width at half its height.
        self.assertEqual(opacity("peak", [989, 995, 1000, 1005, 1011]), [0, 0.45, 0.9, 0.45, 0])
        self.assertEqual(opacity("step", [799, 801, 2550]), [0, 0.9999, 0.9999])
        self.assertEqual(opacity("stripes", [241, 319, 321, 399, 401]), [0.3, 0.3, 0, 0, 0.3])
        self.assertEqual(opacity("gentle", [200, 2550]), [0, 0.1])

    def test_the_mean_of_squares_keeps_rows_and_columns(self):
        picture = numpy.arange(4 * 6 * 1.0).reshape(4, 6, 1)
        wanted = [[3.5, 5.5, 7.5], [15.5, 17.5, 19.5]]
        self.assertEqual(screen.mean_of_squares(picture, 2)[..., 0].tolist(), wanted)

    def test_plots_are_logarithmic_and_names_do_not_overlap(self):
        points = [("triptych-cpu", 10, 1), ("vtk-cpu", 100, 1), ("vtk-gpu", 1000, 0.1),
                  ("vtk-cpu-half", 101, 1.01)]
        plot = plots.Plot(points)
        (x0, y0), (x1, y1), (x2, y2) = (plot.place(ms, error) for _, ms, error in points[:3])
        self.assertAlmostEqual(x1 - x0, x2 - x1)
        self.assertEqual(y0, y1)
        self.assertGreater(y2, y1)
        near = plots._labels(points, plot)
        self.assertGreaterEqual(abs(near["vtk-cpu"][1] - near["vtk-cpu-half"][1]), plots.LABEL_PX)
        circles = xml.fromstring(plots.svg("<title>", {"colour": points})).findall(".//{*}circle")
        self.assertEqual(float(circles[0].get("cx")), round(x0, 1))

    def test_the_marschner_lobb_signal_has_its_known_values(self):
        values = generated.marschner_lobb(5)
        # The value in the middle is (1 + 0.25 2) / 2.5. The sine is 1 at the last z and -1 at the
        # first.
        self.assertEqual(values[2, 2, 2], round(255 * 0.6))
        self.assertEqual(values[4, 2, 2], round(255 * 0.2))
        self.assertEqual(values[0, 2, 2], 255)


if __name__ == "__main__":
    unittest.main()
