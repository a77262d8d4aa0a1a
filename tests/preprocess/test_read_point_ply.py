"""Tests the reader of clouds of points in PLY. The test writes the files by the format's description,
and compares each value that is read with the one that it stored."""
import gzip
import unittest

import numpy as np

from point_test import COLOUR, CLASSIFICATION, INTENSITY, NORMAL, RADIUS, RETURNS, TIME, PointTest

NUMPY = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
         "float": "f4", "double": "f8"}
FORMS = "ascii", "binary_little_endian", "binary_big_endian"
RANDOM = np.random.default_rng(5)
POSITIONS = RANDOM.normal(size=(3000, 3)) * 7
NORMALS = RANDOM.normal(size=(3000, 3))
UNIT = NORMALS / np.linalg.norm(NORMALS, axis=1)[:, None]
COLOURS = RANDOM.integers(0, 256, size=(3000, 3))


def ply(columns, form="binary_little_endian", count=None, tail=b"", more=(), comments=()):
    """Columns are (type, name, values). `more` are lines of further elements, and `tail` their
    bytes."""
    rows = len(columns[0][2]) if count is None else count
    head = ["ply", f"format {form} 1.0", *comments, f"element vertex {rows}",
            *(f"property {t} {n}" for t, n, _ in columns), *more, "end_header", ""]
    if form == "ascii":
        body = "".join(" ".join(repr(float(v[i])) for _, _, v in columns) + "\n"
                       for i in range(len(columns[0][2]))).encode()
    else:
        order = ">" if "big" in form else "<"
        table = np.zeros(len(columns[0][2]), [(n, order + NUMPY[t]) for t, n, _ in columns])
        for _, n, v in columns:
            table[n] = v
        body = table.tobytes()
    return "\n".join(head).encode() + body + tail


def xyz(kind="double", values=POSITIONS):
    return [(kind, a, values[:, i]) for i, a in enumerate("xyz")]


class Ply(PointTest):
    def test_every_form_and_order_of_properties(self):
        columns = (xyz() + [("float", "n" + a, NORMALS[:, i]) for i, a in enumerate("xyz")] +
                   [("uchar", n, COLOURS[:, i]) for i, n in enumerate(("red", "green", "blue"))] +
                   [("float", "radius", np.full(3000, 0.25)),
                    ("ushort", "intensity", np.arange(3000)),
                    ("uchar", "classification", np.arange(3000) % 20),
                    ("uchar", "return_number", 1 + np.arange(3000) % 3),
                    ("uchar", "number_of_returns", np.full(3000, 3)),
                    ("double", "gps_time", 1e8 + np.arange(3000) / 7)])
        for form in FORMS:
            for shuffle in range(3):
                order = np.random.default_rng(shuffle).permutation(len(columns))
                made = self.read("a.ply", ply([columns[i] for i in order], form))
                self.same(made.position, POSITIONS)
                self.same(made.normal, UNIT, 1e-6)
                self.same(made.colour, COLOURS / 255, 1e-7)
                self.same(made.radius, 0.25)
                self.same(made.intensity, np.arange(3000))
                self.same(made.classification, np.arange(3000) % 20)
                self.same(made.return_number, 1 + np.arange(3000) % 3)
                self.same(made.returns, 3)
                self.same(made.time, 1e8 + np.arange(3000) / 7)
                self.assertEqual(made.attributes, NORMAL | RADIUS | COLOUR | INTENSITY |
                                 CLASSIFICATION | RETURNS | TIME)
                self.assertEqual((made.extras, made.notes), ("", []))

    def test_every_type_of_a_property(self):
        whole = np.arange(300).reshape(100, 3) % 100
        for kind in NUMPY:
            for form in FORMS:
                made = self.read("a.ply", ply(xyz(kind, whole), form))
                self.same(made.position, whole)
                self.assertEqual(made.attributes, 0)

    def test_colours_of_other_types(self):
        for kind, values, notes in (("ushort", COLOURS * 257, 0), ("ushort", COLOURS, 1),
                                    ("float", COLOURS / 255, 0), ("float", COLOURS, 1)):
            made = self.read("a.ply", ply(xyz() + [(kind, n, values[:, i]) for i, n in
                                                   enumerate(("red", "green", "blue"))]))
            self.same(made.colour, COLOURS / 255, 1e-6)
            self.assertEqual(len(made.notes), notes, made.notes)

    def test_colours_that_are_all_zero_count_as_absent(self):
        made = self.read("a.ply", ply(xyz() + [("uchar", n, np.zeros(3000))
                                               for n in ("red", "green", "blue")]))
        self.assertEqual(made.attributes, 0)
        self.assertIn("the colours of all points are 0", made.notes[0])

    def test_faces_are_ignored_and_further_properties_named(self):
        faces = b"".join(b"\3" + np.array([0, 1, 2], "<i4").tobytes() for _ in range(9))
        made = self.read("a.ply", ply(xyz() + [("float", "curvature", np.zeros(3000)),
                                               ("uchar", "alpha", np.zeros(3000))],
                                      more=("element face 9", "property list uchar int vertex_indices"),
                                      tail=faces))
        self.same(made.position, POSITIONS)
        self.assertEqual(made.extras, "curvature")
        self.assertEqual(made.notes, ["the file is a mesh; its 9 faces are ignored"])

    def test_vertices_behind_faces(self):
        """Lists of several lengths and types come before the vertices."""
        lists = [[0, 1, 2], [], [3, 4, 5, 6] * 60, [1]] * 500
        for form in FORMS:
            for kind in "uchar", "int", "ushort":
                order = ">" if "big" in form else "<"
                if form == "ascii":
                    end = "\r\n" if kind == "int" else "\n"
                    faces = "".join(f"{len(v)} {' '.join(map(str, v))} 0.5{end}" for v in lists).encode()
                else:
                    faces = b"".join(np.array(len(v), order + NUMPY[kind]).tobytes() +
                                     np.array(v, order + "i4").tobytes() +
                                     np.array(0.5, order + "f4").tobytes() for v in lists)
                head, body = ply(xyz(), form).split(b"end_header\n")
                head = head.replace(b"element vertex", b"element face 2000\nproperty list " + kind.encode() +
                                    b" int vertex_indices\nproperty float quality\nelement vertex")
                data = head + b"end_header\n" + faces + body
                self.same(self.read("a.ply", data).position, POSITIONS)
                self.same(self.read("a.ply.gz", gzip.compress(data)).position, POSITIONS)
                self.refused("a.ply", data[:len(head) + 2000], "ends before its vertices")
        for text, says in ((b"list float int", "length of a list: float"), (b"list uchar quad", "type of a property")):
            self.refused("a.ply", data.replace(b"list " + kind.encode() + b" int", text), says)

    def test_the_range_grid_of_a_stanford_scan(self):
        grid = "".join("0 \n" if i % 2 else f"1 {i // 2} \n" for i in range(6000)).encode()
        for size, scans in ("obj_info num_cols 100\nobj_info num_rows 60", [[0, 0, 0, 0, 100, 60]]), \
                           ("obj_info num_cols 100\nobj_info num_rows 61", []):
            made = self.read("a.ply", ply(xyz(), "ascii", comments=[size], tail=grid, more=(
                "element range_grid 6000", "property list uchar int vertex_indices")))
            self.same(made.position, POSITIONS)
            self.assertEqual(made.scans, scans)
            self.assertEqual(len(made.notes), 0 if scans else 1)

    def test_compressed_files(self):
        made = self.read("a.ply.gz", gzip.compress(ply(xyz())))
        self.same(made.position, POSITIONS)

    def test_points_that_are_not_finite_are_left_out(self):
        values = POSITIONS.copy()
        values[7, 1], values[1500, 0] = np.nan, np.inf
        made = self.read("a.ply", ply(xyz(values=values)))
        self.same(made.position, np.delete(POSITIONS, [7, 1500], 0))
        self.assertEqual(made.left_out, 2)
        self.assertIn("2 of 3000 points have a position that is not finite", made.notes[0])

    def test_damaged_files(self):
        good = ply(xyz())
        for data, says in ((good[:-100], "truncated"), (good[:60], "has no end"),
                           (ply(xyz(), count=10 ** 17), "is its header damaged?"),
                           (ply(xyz(), count=10 ** 15), "truncated"), (ply(xyz(), count=0), "no points"),
                           (ply(xyz()[:2]), "lacks the property z"),
                           (ply(xyz(values=np.full((5, 3), np.nan))), "no point with a finite"),
                           (ply(xyz(), "ascii")[:-300], "truncated"),
                           (good.replace(b"double y", b"quad y"), "unknown type"),
                           (good.replace(b"double y", b"list uchar double y"), "vertex holds a list")):
            self.refused("a.ply", data, says)


if __name__ == "__main__":
    unittest.main()
