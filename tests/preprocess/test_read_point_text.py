"""Tests the readers of points as text: PTS, PTX and rows of numbers (XYZ)."""
import bz2
import gzip
import os
import unittest

import numpy as np

from point_test import CLASSIFICATION, COLOUR, INTENSITY, NORMAL, SCAN, PointTest, Read

RANDOM = np.random.default_rng(11)
COUNT = 2500  # more than the rows of which columns are guessed
POSITIONS = np.round(RANDOM.normal(size=(COUNT, 3)) * 9, 3) + [636000, 849000, 400]
NORMALS = RANDOM.normal(size=(COUNT, 3))
NORMALS /= np.linalg.norm(NORMALS, axis=1)[:, None]
COLOURS = RANDOM.integers(0, 256, size=(COUNT, 3))
INTENSITIES = RANDOM.integers(-2048, 2048, size=COUNT)


def rows(*columns, gap=" ", end="\n", form=repr):
    table = [np.asarray(c).reshape(COUNT, -1) for c in columns]
    return "".join(gap.join(form(x.item()) for t in table for x in t[i]) + end
                   for i in range(COUNT)).encode()


class Text(PointTest):
    def check(self, made, attributes):
        self.same(made.position, POSITIONS)
        if attributes & COLOUR:
            self.same(made.colour, COLOURS / 255, 1e-7)
        if attributes & INTENSITY:
            self.same(made.intensity, INTENSITIES)
        if attributes & NORMAL:
            self.same(made.normal, NORMALS, 1e-6)
        self.assertEqual(made.attributes, attributes)

    def test_columns_of_xyz_are_guessed(self):
        for name, columns, attributes, comments in (
                ("a.xyz", [POSITIONS], 0, ""),
                ("a.asc", [POSITIONS, INTENSITIES], INTENSITY, "column 4: intensity"),
                ("a.txt", [POSITIONS, COLOURS], COLOUR, "columns 4 to 6: colours"),
                ("a.xyzn", [POSITIONS, NORMALS], NORMAL, "columns 4 to 6: normals"),
                ("a.txt", [POSITIONS, INTENSITIES, COLOURS], INTENSITY | COLOUR,
                 "column 4: intensity; columns 5 to 7: colours"),
                ("a.xyz", [POSITIONS, COLOURS, INTENSITIES], INTENSITY | COLOUR,
                 "columns 4 to 6: colours; column 7: intensity"),
                ("a.xyz", [POSITIONS, COLOURS / 255], COLOUR, "columns 4 to 6: colours"),
                ("a.xyz", [POSITIONS, COLOURS, NORMALS], COLOUR | NORMAL,
                 "columns 4 to 6: colours; columns 7 to 9: normals"),
                ("a.xyz", [POSITIONS, INTENSITIES, COLOURS, NORMALS], INTENSITY | COLOUR | NORMAL,
                 "column 4: intensity; columns 5 to 7: colours; columns 8 to 10: normals")):
            made = self.read(name, rows(*columns))
            self.check(made, attributes)
            self.assertEqual((made.comments, made.extras, made.format), (comments, "", "XYZ, text"))

    def test_separators_line_ends_and_compression(self):
        for gap in " ", "\t", ",", ";", ", ", "   ":
            for end in "\n", "\r\n", "\r":
                if end != "\r":
                    self.check(self.read("a.xyz", rows(POSITIONS, COLOURS, gap=gap, end=end)), COLOUR)
        data = rows(POSITIONS, COLOURS)
        self.check(self.read("a.xyz", data[:-1]), COLOUR)
        self.check(self.read("a.xyz.gz", gzip.compress(data)), COLOUR)
        self.check(self.read("a.xyz.bz2", bz2.compress(data)), COLOUR)
        self.check(self.read("a.xyz", b"\n \n# made\n" + data.replace(b"\n", b"\n\n", 5)), COLOUR)
        self.check(self.read("a.xyz", f"{COUNT}\n".encode() + data), COLOUR)

    def test_names_of_columns(self):
        columns = NORMALS, INTENSITIES, POSITIONS[:, ::-1], COLOURS, np.arange(COUNT) % 7, np.zeros(COUNT)
        data = rows(*columns, gap=",")
        names = "nx,ny,nz,scalar_Intensity,Z,\"y\",X[m],R,G,B,Classification,roughness\n"
        for name, head in ("a.csv", names), ("a.xyz", names), ("a.txt", "//" + names), ("a.xyz", "# " + names):
            made = self.read(name, head.encode() + data)
            self.check(made, COLOUR | INTENSITY | NORMAL | CLASSIFICATION)
            self.same(made.classification, np.arange(COUNT) % 7)
            self.assertEqual(made.extras, "roughness")

    def test_numbers_of_every_form(self):
        values = ["1", "-2.5", "+3", "1e3", "-1.25E-2", ".5", "6.", "0.1", "123456789.123456789",
                  "12345678901234567890", "1e300", "-0", "4849123.0015", "9007199254740993", "1e-310"]
        text = "".join(f"{v} 0 1\n" for v in values)
        made = self.read("a.xyz", text.encode())
        self.same(made.position[:, 0], [float(v) for v in values])
        made = self.read("a.xyz", b"0 0 0\nnan 1 2\n1 inf 2\n1 2 3\n")
        self.same(made.position, [[0, 0, 0], [1, 2, 3]])
        self.assertEqual(made.left_out, 2)

    def test_a_locale_with_commas_changes_nothing(self):
        os.environ["LC_ALL"] = "de_DE.UTF-8"
        try:
            self.check(self.read("a.xyz", rows(POSITIONS)), 0)
        finally:
            del os.environ["LC_ALL"]

    def test_pts(self):
        head = f"{COUNT}\n".encode()
        for columns, attributes in (([POSITIONS], 0), ([POSITIONS, INTENSITIES], INTENSITY),
                                    ([POSITIONS, COLOURS], COLOUR),
                                    ([POSITIONS, INTENSITIES, COLOURS], INTENSITY | COLOUR)):
            data = rows(*columns)
            self.check(self.read("a.pts", head + data), attributes)
            self.check(self.read("a.pts", data), attributes)
            lines = data.splitlines(True)
            two = b"1000\n" + b"".join(lines[:1000]) + b"1500\n" + b"".join(lines[1000:])
            self.check(self.read("a.pts", two), attributes)
        made = self.read("a.pts", b"9\n" + rows(POSITIONS))
        self.check(made, 0)
        self.assertIn("states 9 points, but holds more", made.notes[0])
        self.refused("a.pts", b"2501\n" + rows(POSITIONS), "states 2501 points, but holds 2500")
        self.refused("a.pts", head + rows(POSITIONS, NORMALS[:, :2]), "has 5 numbers a row")

    def test_ptx_with_poses_and_empty_cells(self):
        """The poses turn by 90 degrees about z and move. The test moves the points back."""
        scans, points, colours = b"", [], []
        turn = np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1.0]])  # of row vectors
        for i, place in enumerate(([10, 20, 1.5], [-5, 0.25, 2])):
            own = (POSITIONS[i * 1000:(i + 1) * 1000] - place) @ turn.T
            row = np.concatenate([own, RANDOM.uniform(size=(1000, 1)), COLOURS[i * 1000:(i + 1) * 1000]], 1)
            row[::10, :3] = 0
            points.append(np.delete(own @ turn + place, np.s_[::10], 0))
            colours.append(np.delete(row[:, 4:], np.s_[::10], 0))
            matrix = np.eye(4)
            matrix[:3, :3], matrix[3, :3] = turn, place
            scans += (f"{40 + i * 10}\n{1000 // (40 + i * 10)}\n" + " ".join(map(str, place)) + "\n" +
                      "".join(" ".join(map(repr, map(float, r))) + "\n" for r in [*turn, *matrix]) +
                      "".join("%.17g %.17g %.17g %.6f %d %d %d\n" % tuple(r) for r in row)).encode()
        made = self.read("a.ptx", scans)
        self.same(made.position, np.concatenate(points), 1e-8)
        self.same(made.colour, np.concatenate(colours) / 255, 1e-7)
        self.same(made.scan, np.repeat([0, 1], 900))
        self.assertEqual(made.scans, [[1, 10, 20, 1.5, 40, 25], [1, -5, 0.25, 2, 50, 20]])
        self.assertEqual((made.empty, made.left_out, made.notes), (200, 0, []))
        self.assertEqual(made.attributes, INTENSITY | COLOUR | SCAN)
        self.refused("b.ptx", scans[:scans.rindex(b"\n", 0, -200) + 1], "truncated")
        self.refused("b.ptx", scans.replace(b"50\n20\n", b"50\n1e9\n"), "scan 2 states 50000000000 points")
        self.refused("b.ptx", scans.replace(b"50\n20\n", b"50\nabc\n"), "\"abc\" is no number")
        self.refused("b.ptx", scans.replace(b"50\n20\n", b"-50\n20\n"), "states a grid of -50 x 20")
        self.refused("b.ptx", scans.replace(b"0.0 1.0 0.0 0.0\n", b"0.0 0.0 0.0 0.0\n"), "has no inverse")

    def test_damaged_texts(self):
        good = rows(POSITIONS)
        for data, says in ((b"1,5 2,5 3,5\n4,5 5,5 6,5\n", "line 1: has decimal commas"),
                           (b"0 0 0\n1,25;2,5;3\n", "line 2: has decimal commas"),
                           (b"1 2 3\n4 5 6\n7 8\n", "line 3: has 2 numbers; a point has 3 to 32"),
                           (b"1 2 3\n4 5 x\n", "line 2: \"x\" is no number"),
                           (good + b"1 2 3 4\n", "line 2501: has 4 numbers"),
                           (good + b"1 2 " + b"3" * 70000 + b"\n", "longer than 65536 bytes"),
                           (good + b"1 2 3\0\n", "zero byte"),
                           (b"nan nan nan\n" * 3, "no point with a finite")):
            self.refused("a.pts" if b";" not in data and data[:3] == b"nan" else "a.xyz", data, says)

    def test_other_texts_are_no_clouds(self):
        for name, data in (("a.txt", b"0 0\n1 1\n"), ("a.txt", b"hello\n" * 9), ("a.csv", b"1,2,3\n" * 9),
                           ("a.xyz", b"3\nwater\nO 0 0 0\nH 1 0 0\nH 0 1 0\n"), ("a.dat", b"1 2 3\n" * 9)):
            made = Read(self.path(name, data))
            self.assertIn("is no cloud of points", made.lines[0], name)


if __name__ == "__main__":
    unittest.main()
