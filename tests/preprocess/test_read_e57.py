"""Tests the reader of E57. The test writes files by the standard (ASTM E2807), with packets that end
within values, and compares each value that is read with the one that it stored. Files of other
programs are in tests/regress/points."""
import os
import re
import struct
import unittest

import numpy as np

from point_test import COLOUR, INTENSITY, NORMAL, RETURNS, ROOT, SCAN, TIME, PointTest, Read

FILES = os.path.join(ROOT, "tests", "regress", "points")
PAGE = 1024
TABLE = []
for i in range(256):
    for _ in range(8):
        i = i >> 1 ^ (0x82f63b78 if i & 1 else 0)
    TABLE.append(i)


def crc32c(data):
    r = 0xffffffff
    for b in data:
        r = r >> 8 ^ TABLE[(r ^ b) & 255]
    return r ^ 0xffffffff


def physical(logical):
    return logical // (PAGE - 4) * PAGE + logical % (PAGE - 4)


class Field:
    def __init__(self, name, values, kind="Float", bits=None, lo=0, scale=1.0, offset=0.0):
        """`bits` of integers; their minimum is `lo`. `values` of integers are before scaling."""
        self.name, self.values = name, values
        if kind == "Float":
            self.xml = f'<{name} type="Float"{"" if bits == 64 else " precision=" + chr(34) + "single" + chr(34)}/>'
            self.bytes = np.asarray(values).astype("<f8" if bits == 64 else "<f4").tobytes()
        elif kind == "String":
            self.xml = f'<{name} type="String"/>'
            self.bytes = b"".join(bytes([len(v) << 1]) + v for v in values)
        else:
            self.xml = (f'<{name} type="{"Integer" if scale == 1 else "ScaledInteger"}" minimum="{lo}" '
                        f'maximum="{lo + (1 << bits) - 1}" scale="{scale!r}" offset="{offset!r}"/>')
            self.bytes = b""
            for first in range(0, len(values), 64):  # 64 values end at a byte
                part = values[first:first + 64]
                whole = sum((int(v) - lo) << bits * i for i, v in enumerate(part))
                self.bytes += whole.to_bytes((bits * len(part) + 7) // 8, "little")


class Scan:
    def __init__(self, fields, pose="", more="", count=None):
        self.fields, self.pose, self.more = fields, pose, more
        self.count = len(fields[0].values) if count is None else count


def packets(fields, random):
    """Cuts each stream into pieces of any size, with other packets between."""
    left, out = [f.bytes for f in fields], b""
    while any(left) or not out:
        pieces = []
        for i, data in enumerate(left):
            n = int(random.integers(0, 30000 // len(left)))
            pieces.append(data[:n])
            left[i] = data[n:]
        body = struct.pack(f"<H{len(pieces)}H", len(pieces), *map(len, pieces)) + b"".join(pieces)
        body += bytes(-(len(body) + 4) % 4)
        out += struct.pack("<BBH", 1, 0, len(body) + 3) + body
        if random.integers(0, 2):
            out += struct.pack("<BBH", 2, 0, 7) + bytes(4)
        if random.integers(0, 2):
            out += struct.pack("<BBH", 0, 0, 63) + bytes(60)
    return out


def e57(scans, seed=0, **changes):
    """Returns a file. `changes` replace texts of the XML (xml), and logical bytes (bytes)."""
    random = np.random.default_rng(seed)
    body = bytearray(48)
    children = ""
    for s in scans:
        at = len(body)
        data = packets(s.fields, random)
        body += struct.pack("<B7xQQQ", 1, 32 + len(data), physical(at + 32), 0) + data
        children += (f'<vectorChild type="Structure"><guid type="String">g</guid>{s.pose}{s.more}'
                     f'<points type="CompressedVector" fileOffset="{physical(at)}" recordCount="{s.count}">'
                     '<prototype type="Structure">' + "".join(f.xml for f in s.fields) +
                     '</prototype><codecs type="Vector"/></points></vectorChild>')
    xml = ('<?xml version="1.0" encoding="UTF-8"?>\n<e57Root type="Structure" '
           'xmlns="http://www.astm.org/COMMIT/E57/2010-e57-v1.0" xmlns:nor="n">'
           '<formatName type="String"><![CDATA[ASTM E57 3D Imaging Data File]]></formatName>'
           '<e57LibraryVersion type="String"><![CDATA[a test]]></e57LibraryVersion>'
           f'<data3D type="Vector">{children}</data3D>'
           '<images2D type="Vector"><vectorChild type="Structure"><pose type="Structure">'
           '<translation type="Structure"><x type="Float">9</x></translation></pose></vectorChild></images2D>'
           '</e57Root>')
    for old, new in changes.get("xml", ()):
        assert old in xml
        xml = xml.replace(old, new)
    xml = xml.encode()
    at = len(body)
    body += xml
    body += bytes(-len(body) % (PAGE - 4))
    count = len(body) // (PAGE - 4)
    body[:48] = struct.pack("<8sIIQQQQ", b"ASTM-E57", 1, 0, count * PAGE, physical(at), len(xml), PAGE)
    for place, data in changes.get("bytes", ()):
        body[place:place + len(data)] = data
    return b"".join(body[i:i + PAGE - 4] + struct.pack(">I", crc32c(body[i:i + PAGE - 4]))
                    for i in range(0, len(body), PAGE - 4))


RANDOM = np.random.default_rng(3)
COUNT = 3000
XYZ = RANDOM.normal(size=(COUNT, 3)) * 5


def cartesian(values=XYZ, bits=64):
    return [Field("cartesian" + a, values[:, i], bits=bits) for i, a in enumerate("XYZ")]


def pose(q, t):
    return ('<pose type="Structure"><rotation type="Structure">' +
            "".join(f'<{n} type="Float">{float(v)!r}</{n}>' for n, v in zip("wxyz", q)) +
            '</rotation><translation type="Structure">' +
            "".join(f'<{n} type="Float">{float(v)!r}</{n}>' for n, v in zip("xyz", t)) + '</translation></pose>')


def turned(v, q):
    """Turns vectors by a quaternion, by the formula of Rodrigues."""
    w, u = q[0], np.array(q[1:])
    return v + 2 * np.cross(u, np.cross(u, v) + w * v)


class E57(PointTest):
    def test_floats_and_doubles(self):
        self.same(self.read("a.e57", e57([Scan(cartesian())])).position, XYZ)
        made = self.read("a.e57", e57([Scan(cartesian(bits=32))]))
        self.same(made.position, XYZ.astype("f4"))
        self.assertEqual((made.attributes, made.comments, made.notes), (0, "a test", []))

    def test_integers_of_every_number_of_bits(self):
        for bits in range(1, 64):
            whole = [int(v) for v in RANDOM.integers(0, 2 ** bits, size=300, dtype="u8")]
            lo = -(1 << bits - 1)
            values = [v + lo for v in whole]
            made = self.read("a.e57", e57([Scan([
                Field("cartesianX", values, "Integer", bits, lo, 0.001, 636000.0),
                Field("cartesianY", values, "Integer", bits, lo, 0.5),
                Field("cartesianZ", np.full(300, 7), "Integer", 0, 7, 0.25)])], bits))
            self.same(made.position[:, 0], np.array([float(v) * 0.001 + 636000 for v in values]))
            self.same(made.position[:, 1], np.array([float(v) * 0.5 for v in values]))
            self.same(made.position[:, 2], 1.75)

    def test_all_attributes(self):
        colours = RANDOM.integers(0, 1024, size=(COUNT, 3))
        n = XYZ / np.linalg.norm(XYZ, axis=1)[:, None]
        invalid = RANDOM.integers(0, 3, size=COUNT)
        dull = RANDOM.integers(0, 2, size=COUNT)
        fields = (cartesian() + [Field("color" + c, colours[:, i], "Integer", 10)
                                 for i, c in enumerate(("Red", "Green", "Blue"))] +
                  [Field("intensity", np.arange(COUNT) / 8), Field("timeStamp", np.arange(COUNT) / 3, bits=64),
                   Field("label", [b"x" * (i % 90) for i in range(COUNT)], "String"),
                   Field("returnIndex", np.arange(COUNT) % 4, "Integer", 2),
                   Field("returnCount", np.full(COUNT, 4), "Integer", 3),
                   Field("rowIndex", np.arange(COUNT) // 60, "Integer", 9),
                   Field("cartesianInvalidState", invalid, "Integer", 2),
                   Field("isColorInvalid", dull, "Integer", 1), Field("isIntensityInvalid", dull, "Integer", 1)] +
                  [Field("nor:normal" + a, n[:, i]) for i, a in enumerate("XYZ")])
        limits = ("<colorLimits type='Structure'>" + "".join(
            f"<color{c}Minimum type='Integer'/><color{c}Maximum type='Integer'>1023</color{c}Maximum>"
            for c in ("Red", "Green", "Blue")) + "</colorLimits><indexBounds type='Structure'><rowMinimum "
            "type='Integer'/><rowMaximum type='Integer'>49</rowMaximum><columnMinimum type='Integer'/>"
            "<columnMaximum type='Integer'>59</columnMaximum></indexBounds>"
            "<sensorVendor type='String'>V</sensorVendor><sensorModel type='String'>M1</sensorModel>")
        q = np.array([0.5, -0.5, 0.5, 0.5])
        made = self.read("a.e57", e57([Scan(fields, pose(q, (1, 2, 3)), limits)]))
        kept = invalid == 0
        self.same(made.position, (turned(XYZ, q) + [1, 2, 3])[kept], 1e-12)
        self.same(made.normal, turned(n, q)[kept], 1e-6)
        self.same(made.colour, (colours / 1023 * (dull == 0)[:, None])[kept], 1e-7)
        self.same(made.intensity, (np.arange(COUNT) / 8 * (dull == 0))[kept])
        self.same(made.time, (np.arange(COUNT) / 3)[kept])
        self.same(made.return_number, (np.arange(COUNT) % 4 + 1)[kept])
        self.same(made.returns, 4)
        self.assertEqual(made.attributes, NORMAL | COLOUR | INTENSITY | RETURNS | TIME | SCAN)
        self.assertEqual((made.empty, made.left_out), ((~kept).sum(), 0))
        self.assertEqual(made.extras, "label, rowIndex")
        self.assertEqual(made.comments, "a test; V; M1")
        self.assertEqual(made.scans, [[1, 1, 2, 3, 60, 50]])

    def test_colours_without_limits_use_those_of_the_field(self):
        colours = RANDOM.integers(0, 256, size=(COUNT, 3))
        made = self.read("a.e57", e57([Scan(cartesian() + [
            Field("color" + c, colours[:, i], "Integer", 8) for i, c in enumerate(("Red", "Green", "Blue"))])]))
        self.same(made.colour, colours / 255, 1e-7)

    def test_spherical_coordinates(self):
        r, azimuth, elevation = RANDOM.uniform(1, 50, COUNT), RANDOM.uniform(-3, 3, COUNT), RANDOM.uniform(-1.5, 1.5, COUNT)
        made = self.read("a.e57", e57([Scan([
            Field("sphericalRange", r, bits=64), Field("sphericalAzimuth", azimuth, bits=64),
            Field("sphericalElevation", elevation, bits=64),
            Field("sphericalInvalidState", np.arange(COUNT) % 2, "Integer", 1)])]))
        true = np.stack([r * np.cos(elevation) * np.cos(azimuth), r * np.cos(elevation) * np.sin(azimuth),
                         r * np.sin(elevation)], 1)
        self.same(made.position, true[::2], 1e-12)

    def test_several_scans_with_poses(self):
        q = np.array([0.6, 0, 0, 0.8])
        made = self.read("a.e57", e57([
            Scan(cartesian(XYZ[:1000])), Scan(cartesian(XYZ[:0])),
            Scan(cartesian(XYZ[1000:], 32), pose(q, (-4, 5.5, 0)))]))
        self.same(made.position[:1000], XYZ[:1000])
        self.same(made.position[1000:], turned(XYZ[1000:].astype("f4").astype(float), q) + [-4, 5.5, 0], 1e-12)
        self.same(made.scan, np.repeat([0, 2], [1000, 2000]))
        self.assertEqual([s[:4] for s in made.scans], [[0, 0, 0, 0], [0, 0, 0, 0], [1, -4, 5.5, 0]])
        self.assertEqual(made.attributes, SCAN)

    def test_wrong_bounds_are_replaced_with_a_note(self):
        def bounds(lo, hi):
            return "<cartesianBounds type='Structure'>" + "".join(
                f"<{a}Minimum type='Float'>{float(lo[i])!r}</{a}Minimum><{a}Maximum type='Float'>{float(hi[i])!r}"
                f"</{a}Maximum>" for i, a in enumerate("xyz")) + "</cartesianBounds>"
        made = self.read("a.e57", e57([Scan(cartesian(), "", bounds(XYZ.min(0), XYZ.max(0)))]))
        self.assertEqual(made.notes, [])
        made = self.read("a.e57", e57([Scan(cartesian(), "", bounds(XYZ.min(0), XYZ.max(0) + 1))]))
        self.assertIn("the bounds of the points are used", made.notes[0])

    def test_files_of_other_programs(self):
        made = self.read_path(os.path.join(FILES, "tinyCartesianFloatRgb.e57"))
        self.assertEqual((made.points, made.attributes, made.notes), (2090, COLOUR, []))
        with open(os.path.join(FILES, "tinyCartesianFloatRgb.e57"), "rb") as f:
            data = f.read()
        for i, axis in enumerate("xyz"):  # the bounds that the file states
            for name, value in ("Minimum", made.position[:, i].min()), ("Maximum", made.position[:, i].max()):
                stated = re.search(rf"<{axis}{name} type=\"Float\">([^<]*)".encode(), data).group(1)
                self.same(value, float(stated), 1e-5)
        made = self.read_path(os.path.join(FILES, "tiny_spherical.e57"))
        self.assertEqual((made.points, made.empty), (180, 180))
        self.same(np.linalg.norm(made.position, axis=1), 1, 1e-6)  # a sphere of radius 1

    def test_a_wrong_checksum_is_refused(self):
        with open(os.path.join(FILES, "corrupt_crc.e57"), "rb") as f:
            self.refused("a.e57", f.read(), "page 33 has a wrong checksum")
        good = bytearray(e57([Scan(cartesian())]))
        good[5 * PAGE + 17] ^= 1
        self.refused("a.e57", bytes(good), "page 5 has a wrong checksum")

    def test_damaged_files(self):
        scan = Scan(cartesian())
        good = e57([scan])
        with open(os.path.join(FILES, "empty_pc.e57"), "rb") as f:
            self.refused("a.e57", f.read(), "holds no points")
        for data, says in (
                (good[:40], "ends in its header"), (good[:-PAGE], "is it truncated?"),
                (e57([Scan(cartesian(), count=3001)]), "fewer points than it states"),
                (e57([Scan(cartesian(), count=10 ** 15)]), "fewer points than it states"),
                (e57([Scan(cartesian()[:2])]), "lacks the fields of a position"),
                (e57([scan], xml=[('fileOffset="48"', 'fileOffset="4800000000"')]), "outside of the file"),
                (e57([scan], xml=[('fileOffset="48"', 'fileOffset="60"')]), "a wrong head"),
                (e57([scan], xml=[('recordCount="3000"', 'recordCount="-1"')]), "valid fileOffset or recordCount"),
                (e57([scan], xml=[('recordCount="3000"', 'recordCount="1x"')]), "no whole number: 1x"),
                (e57([scan], xml=[("</data3D>", "")]), "its XML is damaged: mismatched tag"),
                (e57([scan], xml=[("<e57Root", "<!DOCTYPE a [<!ENTITY b 'c'>]><e57Root")]), "document type"),
                (e57([scan], xml=[("<guid", "<a>" * 100 + "<guid")]), "more than 64 elements"),
                (e57([scan], xml=[('cartesianX type="Float"', 'cartesianX type="String"')]), "has the type String"),
                (e57([Scan(cartesian(), pose((1, 1, 0, 0), (0, 0, 0)))]), "rotation of length 1.41421"),
                (e57([scan], bytes=[(48 + 32, b"\7")]), "unknown type"),
                (e57([scan], bytes=[(48 + 36, b"\xff\xff")]), "wrong number of streams"),
                (e57([scan], bytes=[(48 + 38, b"\xff\xff")]), "stream beyond its end"),
                (e57([scan], bytes=[(40, struct.pack("<Q", 3))]), "pages of 3 bytes"),
                (e57([scan], bytes=[(8, b"\2")]), "version 2 of E57"),
                (e57([scan], bytes=[(24, struct.pack("<Q", 2 ** 60))]), "XML lies outside")):
            self.refused("a.e57", data, says)

    def test_a_file_with_changed_bytes_ends_in_a_line_or_in_points(self):
        """The checksums are made after the change."""
        random = np.random.default_rng(1)
        for _ in range(60):
            changes = [(48 + int(random.integers(0, 4000)), bytes([random.integers(0, 256)])) for _ in range(3)]
            made = Read(self.path("a.e57", e57([Scan(cartesian(XYZ[:200], 32))], bytes=changes)))
            self.assertIn(made.code, (0, 1), made.lines)
            if made.code:
                self.assertEqual(len(made.lines), 1, made.lines)


if __name__ == "__main__":
    unittest.main()
