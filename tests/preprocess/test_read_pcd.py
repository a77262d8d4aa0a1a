"""Tests the reader of clouds of points in PCD. The test writes the files by the format's description,
and compares each value that is read with the one that it stored."""
import struct
import unittest

import numpy as np

from point_test import COLOUR, INTENSITY, NORMAL, SCAN, PointTest

RANDOM = np.random.default_rng(7)
COUNT = 9000  # more than two batches of compressed planes
POSITIONS = np.round(RANDOM.normal(size=(COUNT, 3)) * 7, 2)
NORMALS = RANDOM.normal(size=(COUNT, 3))
UNIT = NORMALS / np.linalg.norm(NORMALS, axis=1)[:, None]
COLOURS = RANDOM.integers(0, 256, size=(COUNT, 3))
PACKED = (COLOURS[:, 0] << 16 | COLOURS[:, 1] << 8 | COLOURS[:, 2]).astype("<u4")


def lzf(data):
    """Compresses by literals, and references to the last place of the same three bytes."""
    out, places, literals, i = bytearray(), {}, bytearray(), 0

    def flush():
        for k in range(0, len(literals), 32):
            part = literals[k:k + 32]
            out.extend(bytes([len(part) - 1]) + part)
        literals.clear()
    while i < len(data):
        key = data[i:i + 3]
        at = places.get(key, -1)
        places[key] = i
        if at < 0 or i - at > 8192 or len(key) < 3:
            literals.append(data[i])
            i += 1
            continue
        length = 3
        while length < 264 and i + length < len(data) and data[at + length] == data[i + length]:
            length += 1
        flush()
        back = i - at - 1
        if length - 2 < 7:
            out.extend([length - 2 << 5 | back >> 8, back & 255])
        else:
            out.extend([7 << 5 | back >> 8, length - 9, back & 255])
        i += length
    flush()
    return bytes(out)


def pcd(columns, form, width=None, height=1, view="0 0 0 1 0 0 0", **changes):
    """Columns are (name, NumPy type, values); values with two axes have a COUNT."""
    rows = len(columns[0][2])
    counts = [1 if v.ndim == 1 else v.shape[1] for _, _, v in columns]
    head = {"VERSION": "0.7", "FIELDS": " ".join(n for n, _, _ in columns),
            "SIZE": " ".join(str(np.dtype(t).itemsize) for _, t, _ in columns),
            "TYPE": " ".join({"f": "F", "i": "I", "u": "U"}[np.dtype(t).kind] for _, t, _ in columns),
            "COUNT": " ".join(map(str, counts)), "WIDTH": rows // height if width is None else width,
            "HEIGHT": height, "VIEWPOINT": view, "POINTS": rows, "DATA": form}
    head.update(changes)
    text = "# .PCD v0.7 - Point Cloud Data file format\n" + "".join(
        f"{k} {v}\n" for k, v in head.items() if v is not None)
    if form == "ascii":
        return (text + "".join(" ".join(repr(x.item()) for _, t, v in columns
                                        for x in np.atleast_1d(v[i].astype(t))) + "\n"
                               for i in range(rows))).encode()
    if form == "binary":
        table = np.zeros(rows, [(f"f{i}", t, (c,)) for i, ((_, t, _), c) in enumerate(zip(columns, counts))])
        for i, (_, _, v) in enumerate(columns):
            table[f"f{i}"] = v.reshape(rows, -1)
        return text.encode() + table.tobytes()
    planes = b"".join(v.astype(t).tobytes() for _, t, v in columns)
    packed = lzf(planes)
    return text.encode() + struct.pack("<II", len(packed), len(planes)) + packed


def xyz(kind="<f4", values=POSITIONS):
    return [(a, kind, values[:, i]) for i, a in enumerate("xyz")]


FORMS = "ascii", "binary", "binary_compressed"


class Pcd(PointTest):
    def test_every_form(self):
        for form in FORMS:
            for kind, colour in ("<f4", PACKED.view("<f4")), ("<u4", PACKED), ("<i4", PACKED.view("<i4")):
                made = self.read("a.pcd", pcd(
                    xyz() + [("rgb", kind, colour), ("_", "u1", np.zeros((COUNT, 3))),
                             ("fpfh", "<f4", np.zeros((COUNT, 4)))] +
                    [("normal_" + a, "<f4", NORMALS[:, i]) for i, a in enumerate("xyz")] +
                    [("curvature", "<f4", NORMALS[:, 0]), ("intensity", "<f8", np.arange(COUNT) / 8)], form))
                self.same(made.position, POSITIONS.astype("f4"))
                self.same(made.colour, COLOURS / 255, 1e-7)
                self.same(made.normal, UNIT, 1e-6)
                self.same(made.intensity, np.arange(COUNT) / 8)
                self.assertEqual(made.attributes, NORMAL | COLOUR | INTENSITY)
                self.assertEqual(made.extras, "fpfh, curvature")
                self.assertEqual((made.scans, made.notes), ([], []))

    def test_every_type(self):
        whole = np.arange(300).reshape(100, 3) % 100
        for kind in "i1", "u1", "<i2", "<u2", "<i4", "<u4", "<i8", "<u8", "<f4", "<f8":
            for form in FORMS:
                signed = whole - (50 if np.dtype(kind).kind != "u" else 0)
                self.same(self.read("a.pcd", pcd(xyz(kind, signed), form)).position, signed)

    def test_doubles_keep_millimetres(self):
        values = POSITIONS[:50] + [636000.001, 4849000.002, 0]
        for form in FORMS:
            self.same(self.read("a.pcd", pcd(xyz("<f8", values), form)).position, values)

    def test_colours_in_fields_of_their_own(self):
        names = "Red", "Green", "Blue"
        for kind, factor in ("u1", 1), ("<u2", 257), ("<f4", 1 / 255):
            made = self.read("a.pcd", pcd(xyz() + [(n, kind, COLOURS[:, i] * factor)
                                                   for i, n in enumerate(names)], "binary"))
            self.same(made.colour, COLOURS / 255, 1e-6)

    def test_organised_clouds(self):
        values = POSITIONS.copy()
        values[::5] = np.nan
        for form in FORMS:
            made = self.read("a.pcd", pcd(xyz(values=values), form, height=90, view="1 2.5 -3 1 0 0 0"))
            self.same(made.position, np.delete(POSITIONS, np.s_[::5], 0).astype("f4"))
            self.assertEqual(made.scans, [[1, 1, 2.5, -3, 100, 90]])
            self.assertEqual((made.empty, made.left_out, made.notes), (1800, 0, []))
            self.assertEqual(made.attributes, SCAN)
        made = self.read("a.pcd", pcd(xyz(values=values), "binary"))
        self.assertEqual((made.empty, made.left_out, len(made.notes)), (0, 1800, 1))

    def test_a_grid_that_does_not_fit_is_ignored_with_a_note(self):
        made = self.read("a.pcd", pcd(xyz(), "binary", width=50, height=60))
        self.same(made.position, POSITIONS.astype("f4"))
        self.assertIn("the grid is ignored", made.notes[0])
        self.assertEqual(made.scans, [])

    def test_damaged_files(self):
        good = {form: pcd(xyz(), form) for form in FORMS}
        for form in FORMS:
            cut = good[form][:-1000]
            cut = cut[:cut.rindex(b"\n") + 1] if form == "ascii" else cut
            self.refused("a.pcd", cut, "truncated")
            self.refused("a.pcd", good[form][:60], "no line DATA")
            self.refused("a.pcd", pcd(xyz(), form, POINTS=0, WIDTH=0), "no points")
            self.refused("a.pcd", pcd(xyz()[:2], form), "lacks the field z")
            self.refused("a.pcd", pcd(xyz(), form, SIZE="4 4"), "SIZE has 2 values, but FIELDS names 3")
            self.refused("a.pcd", pcd(xyz(), form, SIZE="4 4 3"), "of type F with 3 bytes")
            self.refused("a.pcd", pcd(xyz(), form, COUNT="1 1 2000000"), "COUNT of the field z")
            self.refused("a.pcd", pcd(xyz(), form, DATA="zip"), "unknown DATA")
            self.refused("a.pcd", pcd(xyz(), form, WIDTH="1e15", HEIGHT="1e15"), "is its header damaged")
            self.refused("a.pcd", pcd(xyz(values=np.full((9, 3), np.nan)), form), "no point with a finite")
        for form, says in (("ascii", "truncated"), ("binary", "truncated"),
                           ("binary_compressed", "is it damaged")):
            self.refused("a.pcd", pcd(xyz(), form, POINTS=10 ** 12, WIDTH=10 ** 12), says)
        self.refused("a.pcd", pcd(xyz(), "ascii").replace(b"\n0", b"\nq", 1), "is no number")
        packed = bytearray(good["binary_compressed"])
        at = packed.index(b"compressed\n") + 11
        packed[at + 8] = 0xff  # a reference to bytes before the begin
        self.refused("a.pcd", bytes(packed), "compressed data end early or are damaged")


if __name__ == "__main__":
    unittest.main()
