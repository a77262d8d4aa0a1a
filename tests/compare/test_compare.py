"""Tests compare.py on one tiny scene by Triptych alone, its plots, and the generated volumes."""
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

import generated
import plots

HERE = os.path.dirname(os.path.abspath(__file__))


class CompareTest(unittest.TestCase):
    def test_one_scene_has_a_table_a_plot_and_errors(self):
        with tempfile.TemporaryDirectory() as out:
            subprocess.run(
                [sys.executable, "-B", os.path.join(HERE, "compare.py"), "--triptych",
                 os.environ["TRIP_PROGRAM"], "--out", out, "--scene", "tooth", "--size", "48",
                 "--views", "2", "--rounds", "1", "--error-views", "1", "--no-alignment",
                 "--programs", "triptych-cpu,triptych-post-1,triptych-post-4"],
                check=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
            with open(os.path.join(out, "results.json"), encoding="utf-8") as file:
                result, = json.load(file)["scenes"]
            errors = result["errors"]["48"]
            self.assertGreater(errors["triptych-cpu"]["mean"], errors["triptych-post-1"]["mean"])
            self.assertGreater(errors["triptych-post-1"]["mean"], errors["triptych-post-4"]["mean"])
            self.assertTrue(all(row["ms"] > 0 for row in result["rows"]))
            with open(os.path.join(out, "tooth.md"), encoding="utf-8") as file:
                table = file.read()
            for name in errors:
                self.assertRegex(table, r"(?m)^\| %s \| [0-9.]+ \|" % re.escape(name))
            self.assertIn("- Errors: of 255", table)
            plot = xml.parse(os.path.join(out, "tooth-48.svg"))
            self.assertEqual(len(plot.findall(".//{*}circle")), 2 * len(errors))
            self.assertTrue(os.path.exists(os.path.join(out, "tooth.png")))

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
