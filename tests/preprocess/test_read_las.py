"""Tests the readers of LAS, LAZ and COPC. The test decodes the records of LAS by the specification. The
compressed files in tests/regress/points were written by other programs."""
import os
import struct
import unittest

import numpy as np

import las_records
from las_records import FORMATS, OFFSET, SCALE, Values, las, records_of
from point_test import CLASSIFICATION, COLOUR, INTENSITY, RETURNS, ROOT, TIME, PointTest, Read

FILES = os.path.join(ROOT, "tests", "regress", "points")
COUNT = 420  # points of a synthetic file, in chunks of 150


def file(name):
    with open(os.path.join(FILES, name), "rb") as f:
        return f.read()


def extra_bytes(*names):
    return b"".join(struct.pack("<2xBB32s156x", 1, 0, name.encode()) for name in names)


class Las(PointTest):
    def check(self, made, kind, records):
        true = Values(kind, records)
        kept = ~true.withheld
        # A product and a sum in double precision, and no other rounding.
        self.same(made.position, true.position[kept])
        self.same(made.intensity, true.intensity[kept])
        self.same(made.return_number, true.return_number[kept])
        self.same(made.returns, true.returns[kept])
        self.same(made.classification, true.classification[kept])
        self.same(made.time, true.time[kept])
        self.same(made.colour, true.colour[kept], 1e-7)
        self.assertEqual(made.left_out, true.withheld.sum())
        size, time_at, colour_at, _, _ = FORMATS[kind]
        self.assertEqual(made.attributes, INTENSITY | CLASSIFICATION | RETURNS |
                         (TIME if time_at else 0) | (COLOUR if colour_at else 0))

    def test_every_point_format(self):
        for kind in FORMATS:
            for extra in 0, 5:
                records = records_of(kind, 3000, extra)
                made = self.read("a.las", las(kind, records))
                self.check(made, kind, records)
                self.assertRegex(made.format, rf"LAS 1.[1-4], point format {kind}$")
                self.assertEqual(made.comments, "a scanner; a test")

    def test_every_version(self):
        records = records_of(1, 50)
        for minor in range(5):
            self.check(self.read("a.las", las(1, records, minor)), 1, records)

    def test_withheld_points_are_left_out(self):
        for kind, at, bit in (0, 15, 0x80), (6, 15, 4):
            records = records_of(kind, 2000)
            records[::3, at] |= bit
            made = self.read("a.las", las(kind, records))
            self.check(made, kind, records)
            self.assertEqual(made.left_out, 667)
            self.assertEqual(made.notes, ["667 of 2000 points are marked as withheld; they are left out"])

    def test_every_point_format_of_laz(self):
        """"_plain" has no chunks, and "_v4" has version 4 of the items."""
        for kind, extra, more in ((0, 0, ""), (1, 3, ""), (2, 0, ""), (3, 3, ""), (3, 1, "_plain"),
                                  (4, 0, ""), (5, 2, ""), (6, 0, ""), (7, 3, ""), (7, 1, "_v4"),
                                  (8, 0, ""), (9, 0, ""), (10, 2, "")):
            records = records_of(kind, COUNT, extra)
            made = self.read_path(os.path.join(FILES, f"synthetic_{kind}{more}.laz"))
            self.check(made, kind, records)
            self.assertRegex(made.format, rf"LAZ 1.[234], point format {kind}$")

    def test_a_laz_file_equals_its_las_file(self):
        a, b = (self.read_path(os.path.join(FILES, "extrabytes" + end)) for end in (".las", ".laz"))
        for name in "position", "colour", "intensity", "classification", "return_number", "returns", "time":
            self.same(getattr(a, name), getattr(b, name))
        self.assertEqual(a.points, 1065)
        self.assertEqual(a.extras, "Colors, Reserved, Flags, Intensity, Time")
        self.assertEqual(b.extras, a.extras)
        self.assertEqual(a.notes, ["the colours use 8 of 16 bits (0 to 249), and are read as 8 bits"])

    def test_a_copc_file_holds_the_points_of_its_las_file(self):
        a = self.read_path(os.path.join(FILES, "extrabytes.las"))
        b = self.read_path(os.path.join(FILES, "1.2-with-color.copc.laz"))
        rows = [np.concatenate([r.position, r.colour, r.intensity[:, None], r.classification[:, None],
                                r.time[:, None]], 1) for r in (a, b)]
        rows = [r[np.lexsort(r.T[::-1])] for r in rows]
        np.testing.assert_allclose(rows[0], rows[1], rtol=1e-15, atol=1e-6)
        self.assertEqual(b.format, "COPC 1.4, point format 7")

    def test_millimetres_beside_millions_of_metres(self):
        records = records_of(0, 2)
        records[:, :12] = np.array([[1, 2, 3], [2, 3, 4]], "<i4").view(np.uint8)
        records[:, 15] = 1
        made = self.read("a.las", las(0, records))
        self.same(made.position[1] - made.position[0], [0.001, 0.001, 0.002], 1e-9)
        self.same(made.position[0], [600000.001, 5000000.002, -9.994], 1e-9)

    def test_wrong_bounds_and_counts_are_replaced_with_a_note(self):
        records = records_of(1, 200)
        records[:, 15] &= 0x7f
        for changes, says in (
                (dict(lo=(0, 0, 0)), "the header states x from 0 to"),
                (dict(hi=(9e9, 9e9, 9e9)), "the header states x from"),
                (dict(lo=(np.nan,) * 3), "bounds that are not finite"),
                (dict(count=0), "states 0 points, but the file holds 200"),
                (dict(count=150), "states 150 points, but the file holds 200"),
                (dict(count=900), "states 900 points, but the file holds 200")):
            made = self.read("a.las", las(1, records, **changes))
            self.check(made, 1, records)
            self.assertEqual(len(made.notes), 1)
            self.assertIn(says, made.notes[0])
        self.assertEqual(self.read("a.las", las(1, records)).notes, [])

    def test_colours_of_eight_bits_and_without_values(self):
        records = records_of(2, 200)
        records[:, 15] &= 0x7f
        records[:, 21::2] = 0
        made = self.read("a.las", las(2, records))
        self.same(made.colour, records[:, 20::2] / 255, 1e-7)
        self.assertIn("8 of 16 bits", made.notes[0])
        records[:, 20:] = 0
        made = self.read("a.las", las(2, records))
        self.assertEqual(made.attributes & COLOUR, 0)
        self.assertIn("the colours of all points are 0", made.notes[0])

    def test_names_of_further_attributes(self):
        records = records_of(0, 50, 2)
        names = ("LASF_Spec", 4, extra_bytes("Deviation", "Amplitude"))
        for places in dict(vlrs=[names]), dict(evlrs=[names]):
            made = self.read("a.las", las(0, records, 4, **places))
            self.check(made, 0, records)
            self.assertEqual(made.extras, "Deviation, Amplitude")

    def test_damaged_las_files(self):
        records = records_of(3, 100)
        good = las(3, records)
        for data, says in (
                (good[:100], "truncated"), (good[:-50], "states 100 points, but holds 98"),
                (good[:227 + 8], "is it truncated?"), (las(3, records[:0]), "no points"),
                (las(3, records, format=11), "point format 11"), (las(3, records, bytes=20), "records of 20"),
                (las(3, records, data_at=10), "outside of the file"),
                (las(3, records, data_at=2 ** 31), "outside of the file"),
                (las(3, records, scale=(0, 1, 1)), "the scale 0"),
                (las(3, records, offset=(1, np.inf, 1)), "the offset inf"),
                (las(3, records, vlrs=[("a", 1, b"b")], data_at=250), "outside of the file"),
                (las(3, records, 4, evlr_at=10 ** 12, evlr_count=1), "outside of the file"),
                (good.replace(b"LASF", b"LASF", 1)[:24] + b"\2\0" + good[26:], "version 2.0")):
            self.refused("a.las", data, says)

    def test_damaged_laz_files(self):
        for kind in 1, 7:
            good = file(f"synthetic_{kind}.laz")
            data_at = struct.unpack_from("<I", good, 96)[0]
            at = good.index(b"laszip encoded") - 2 + 54
            table = struct.unpack_from("<Q", good, data_at)[0]

            def changed(offset, new):
                return good[:offset] + new + good[offset + len(new):]
            for data, says in (
                    (good[:-40], "damaged"), (good[:data_at + 4], "truncated"),
                    (changed(data_at, struct.pack("<Q", 10 ** 15)), "table of chunks lies outside"),
                    (changed(table + 4, struct.pack("<I", 10 ** 9)), "wrong version or length"),
                    (changed(table + 4, struct.pack("<I", 0)), "table of chunks is empty"),
                    (changed(table + 4, struct.pack("<I", 1)), "chunks hold at most 150"),
                    (changed(table + 8, b"\xff" * 6), "damaged"),
                    (changed(at, b"\7"), "method 7"), (changed(at + 12, bytes(4)), "empty chunks"),
                    (changed(at + 32, b"\xff\xff"), "wrong number of items"),
                    (changed(at + 34, b"\1"), "does not fit its point format"),
                    (changed(at + 38, b"\1"), "version 1 of LAZ"),
                    (good.replace(b"laszip encoded", b"laszip decoded"), "lacks the record")):
                self.refused("a.laz", data, says)

    def test_a_laz_file_with_changed_bytes_ends_in_a_line_or_in_points(self):
        for kind in 3, 8:
            good = bytearray(file(f"synthetic_{kind}.laz"))
            r = las_records.Numbers(kind)
            for _ in range(60):
                data = good.copy()
                for _ in range(1 + r.below(4)):
                    data[400 + r.below(len(data) - 400)] = r.below(256)
                made = Read(self.path("a.laz", bytes(data)))
                self.assertIn(made.code, (0, 1), made.lines)
                if made.code:
                    self.assertEqual(len(made.lines), 1, made.lines)


if __name__ == "__main__":
    unittest.main()
