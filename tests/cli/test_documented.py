"""Tests that the figures of docs/ewa.md are the figures that its commands print."""
import json
import os
import re
import subprocess
import sys

import program

DOCS = os.path.join(os.environ["TRIP_SOURCE_DIR"], "docs")


def tables(text):
    """Returns the rows of each table as lists of cells, without head and rule."""
    found = re.findall(r"(?m)^\|.*\|\n\|[-:|]+\|\n((?:\|.*\|\n)+)", text)
    return [[[cell.strip() for cell in row.strip("|").split("|")] for row in t.splitlines()]
            for t in found]


class Documented(program.ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        with open(os.path.join(DOCS, "ewa.md"), encoding="utf-8") as f:
            cls.splats, cls.pictures, cls.filters = tables(f.read())

    def test_bench_ewa_prints_the_tables_of_the_approximation(self):
        run = self.works("bench", "ewa", "--size=256x256", "--repeat=1", "--json", timeout=300)
        measured = json.loads(run.stdout)["tables"]
        largest = {(r["angle"], r["distance"]): r.get("max") for r in measured["splats"]["rows"]}
        for angle, *row in self.splats:
            for distance, cell in zip((4, 6, 10, 20, 50, 100), row):
                value = largest[float(angle), distance]
                self.assertEqual(cell, "exact" if value is None else f"{value:.2f}")
        self.assertEqual(len(self.pictures), len(measured["pictures"]["rows"]))
        for row, cells in zip(measured["pictures"]["rows"], self.pictures):
            keys = "fov", "mean", "percentile_99", "max"
            for key, cell in zip(keys, map(float, cells)):
                # Instruction sets round differently.
                self.assertLess(abs(row[key] - cell), 0.011 + 0.01 * cell, (row, cells))

    def test_the_figure_shows_the_errors_of_the_table(self):
        run = subprocess.run([sys.executable, os.path.join(DOCS, "ewa.py"), program.PROGRAM, "a.png"],
                             capture_output=True, check=True, text=True, timeout=500)
        (measured,) = tables(run.stdout)
        self.assertEqual([row[0] for row in measured], [row[0] for row in self.filters])
        numbers = lambda row: [float(n) for cell in row[1:] for n in cell.split("/")]
        for row, cells in zip(measured, self.filters):
            for a, b in zip(numbers(row), numbers(cells)):
                self.assertLess(abs(a - b), 0.11, (row, cells))
        for row in measured[:3]:  # the receding planes
            plain, _, uniform, wide, narrow = (float(c.split("/")[0]) for c in row[1:])
            self.assertLess(narrow, 0.6 * plain)
            self.assertLess(wide, 1.05 * uniform)


if __name__ == "__main__":
    program.main()
