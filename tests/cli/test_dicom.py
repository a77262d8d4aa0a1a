"""Tests of DICOM files of other programs, and of folders as scanners and archives write them."""
import json
import os
import shutil
import struct

import numpy
import program

FILES = os.path.join(os.environ["TRIP_SOURCE_DIR"], "tests", "regress", "dicom")
VIEW = ("--size=48x40", "--tf=grey", "--up=0,0,1", "--view=left", "--renderer=reference")
AXIAL = (1, 0, 0, 0, 1, 0)
FLAT = ("--size=48x40", "--tf=grey", "--view=top", "--renderer=reference",
        "--classify=pre")
LUMA = numpy.array([0.2126, 0.7152, 0.0722])
ROWS, COLUMNS = 12, 16


def text(value):
    return str(value).encode()


def numbers(*values):
    return "\\".join(f"{v:.10g}" for v in values).encode()


def number(value):
    return struct.pack("<H", value)


def write(path, elements, syntax="1.2.840.10008.1.2.1", meta=True):
    """Writes elements {(group, element): (type, bytes)} in explicit VR little endian."""
    data = b"".join(program.dicom_element(*tag, *elements[tag]) for tag in sorted(elements))
    head = program.dicom_element(2, 0x10, b"UI", text(syntax))
    size = program.dicom_element(2, 0, b"UL", struct.pack("<I", len(head)))
    program.write(path, (bytes(128) + b"DICM" + size + head if meta else b"") + data)


def slice_of(image, place=None, series="1.2.3", instance=1, **more):
    """Returns the elements of a slice. `place` is the position of its first pixel."""
    bits = 8 * image.dtype.itemsize
    elements = {
        (0x08, 0x18): (b"UI", text(f"{series}.{instance}")),
        (0x08, 0x60): (b"CS", b"CT"),
        (0x20, 0x0E): (b"UI", text(series)),
        (0x20, 0x13): (b"IS", text(instance)),
        (0x28, 0x02): (b"US", number(1)),
        (0x28, 0x04): (b"CS", b"MONOCHROME2"),
        (0x28, 0x10): (b"US", number(image.shape[-2])),
        (0x28, 0x11): (b"US", number(image.shape[-1])),
        (0x28, 0x30): (b"DS", b"1\\1"),
        (0x28, 0x100): (b"US", number(bits)),
        (0x28, 0x101): (b"US", number(bits)),
        (0x28, 0x102): (b"US", number(bits - 1)),
        (0x28, 0x103): (b"US", number(0)),
        (0x7FE0, 0x10): (b"OW", image.tobytes()),
    }
    if place is not None:
        elements[0x20, 0x32] = b"DS", numbers(*place)
        elements[0x20, 0x37] = b"DS", numbers(*AXIAL)
    elements.update(more.get("elements", {}))
    return elements


def write_series(folder, volume, places, first=1, prefix="i", **more):
    os.makedirs(folder, exist_ok=True)
    for k, (image, z) in enumerate(zip(volume, places)):
        write(f"{folder}/{prefix}{k:03d}", slice_of(image, (0, 0, z), instance=first + k, **more))


def csa_header(**elements):
    """Returns the private header of a Siemens mosaic: names and texts."""
    data = b"SV10\4\3\2\1" + struct.pack("<2I", len(elements), 77)
    for name, values in elements.items():
        kind, syngo = (b"FD", 4) if len(values) > 1 else (b"US", 10)
        data += struct.pack("<64si4s3i", text(name), len(values), kind, syngo, 6, 77)
        for value in (list(values) + [""] * 6)[:6]:
            size = len(text(value))
            data += struct.pack("<4i", size, size, 77, size) + text(value) + bytes(-size % 4)
    return data


class Dicom(program.ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.values = program.noise((9, ROWS, COLUMNS)).astype("u2") * 7

    def setUp(self):
        for name in os.listdir("."):
            shutil.rmtree(name) if os.path.isdir(name) else os.remove(name)

    def described(self, path, *options):
        return json.loads(self.works("info", path, "--json", *options).stdout)

    def drawn(self, path, *options):
        self.brick(path, "drawn.trip", "--keep-all", *options)
        return self.picture("drawn.trip", *VIEW)

    def raw(self, values, z):
        """Returns the picture of the same values as raw data with slices at `z`."""
        program.write("z.txt", " ".join(map(str, z)).encode())
        program.write("raw.raw", values.tobytes())
        size = ",".join(map(str, values.shape[::-1]))
        return self.drawn("raw.raw", f"--size={size}", "--type=uint16", "--coordinates=,,z.txt",
                          "--axes=LPS")

    def same(self, a, b):
        self.assertGreater(a.std(), 0.01)
        self.assertTrue((a == b).all(), abs(a - b).max())

    def test_files_of_every_transfer_syntax_are_read(self):
        for name, dims, low, high in (
            ("CT_small", [128, 128, 1], -896, 1167),  # its preamble is the one of a TIFF
            ("MR_small_implicit", [64, 64, 1], 127, 2145),
            ("MR_small_bigendian", [64, 64, 1], 127, 2145),
            ("MR_small_RLE", [64, 64, 1], 127, 2145),
            ("MR_small_jpeg_ls_lossless", [64, 64, 1], 127, 2145),
            ("MR_small_jp2klossless", [64, 64, 1], 127, 2145),
            ("JPEG2000", [256, 1024, 1], -30, 245),
            ("JPGExtended", [256, 1024, 1], 0, 264),
            ("image_dfl", [512, 512, 1], 0, 255),
            ("liver_1frame", [512, 512, 1], 0, 1),
            ("rtdose_expb", [10, 10, 15], 795000, 1254000),
            ("SC_rgb_rle_16bit_2frame", [100, 100, 2], 0, 65535),
        ):
            info = self.brick(os.path.join(FILES, f"{name}.dcm"), "a.trip", "--keep-all")
            self.assertEqual(info["dims"], dims, name)
            self.assertAlmostEqual(info["value_min"], low, delta=1e-6 * high, msg=name)
            self.assertAlmostEqual(info["value_max"], high, delta=1e-6 * high, msg=name)

    def test_one_slice_in_several_syntaxes_gives_one_picture(self):
        view = "--size=64x64", "--tf=grey", "--renderer=reference", "--classify=pre"
        pictures = []
        for kind in "implicit", "bigendian", "RLE", "jpeg_ls_lossless", "jp2klossless":
            self.brick(os.path.join(FILES, f"MR_small_{kind}.dcm"), "a.trip", "--keep-all")
            pictures.append(self.picture("a.trip", *view))
        with open(os.path.join(FILES, "MR_small_implicit.dcm"), "rb") as file:
            program.write("bare", file.read()[132:])  # as files without the mark of DICOM
        self.brick("bare", "a.trip", "--keep-all")
        pictures.append(self.picture("a.trip", *view))
        for picture in pictures[1:]:
            self.same(pictures[0], picture)

    def test_bytes_in_big_endian_words_are_in_order(self):
        for name in "SC_rgb_small_odd", "SC_rgb_small_odd_big_endian":
            info = self.brick(os.path.join(FILES, f"{name}.dcm"), "a.trip", "--keep-all")
            self.assertAlmostEqual(info["value_min"], LUMA @ (63, 87, 176), delta=1e-4)
            self.assertAlmostEqual(info["value_max"], 158, delta=1e-4)

    def test_palette_colours_come_from_their_table(self):
        """The stored values are 10 to 13, the first of the table is 10."""
        table = numpy.array([[0, 1000, 50, 7], [60000, 2, 3, 9000], [5, 6, 65535, 8]], "<u2")
        image = numpy.tile(numpy.arange(10, 14, dtype="u1"), (ROWS, COLUMNS // 4))
        elements = {(0x28, 0x04): (b"CS", b"PALETTE COLOR")}
        for c in range(3):
            elements[0x28, 0x1101 + c] = b"US", struct.pack("<3H", 4, 10, 16)
            elements[0x28, 0x1201 + c] = b"OW", table[c].tobytes()
        write("p.dcm", slice_of(image, (0, 0, 0), elements=elements))
        run = self.works("brick", "p.dcm", "-o", "p.trip", "-q", "--keep-all")
        self.assertIn("luma", run.stderr)
        info, luma = self.info("p.trip"), LUMA @ table
        self.assertAlmostEqual(info["value_min"], luma.min(), delta=0.01)
        self.assertAlmostEqual(info["value_max"], luma.max(), delta=0.01)

    def test_slices_at_uneven_distances_are_drawn_where_they_are(self):
        z = [0, 1, 2, 3, 8, 13, 18, 23, 28]
        write_series("uneven", self.values, z)
        info = self.brick("uneven", "a.trip", "--keep-all")
        self.assertAlmostEqual(info["spacing_min"][2], 1)
        self.assertAlmostEqual(info["spacing_max"][2], 5)
        self.assertIn("1 to 5 apart", info["source"]["note"])
        self.same(self.drawn("uneven"), self.raw(self.values, z))
        self.assertIn("k voxels     1 to 5 apart", self.works("info", "uneven").stdout.decode())

    def test_a_missing_slice_is_an_error_and_the_others_stay_where_they_are(self):
        z = [0, 1, 2, 3, 5, 6, 7, 8, 9]
        write_series("gap", self.values, z)
        self.fails(1, "brick", "gap", "-o", "g.trip", "-q", says="gap/i003: a slice is missing")
        self.same(self.drawn("gap", "--allow-gaps"), self.raw(self.values, z))

    def test_repeated_positions_are_times(self):
        z = [0, 2, 4]
        for time in range(3):
            write_series("time", self.values[3 * time:], z, first=3 * time + 1, prefix=f"t{2 - time}")
        note = self.described("time")["note"]
        self.assertIn("time 0 of 3 (--time N", note)
        for time in range(3):
            own = self.raw(self.values[3 * time:3 * time + 3], z)
            self.same(self.drawn("time", "--time", time), own)
        self.fails(2, "info", "time", "--time=3", says="its times are 0 to 2")
        shutil.copy("time/t2000", "time/copy")
        self.assertEqual(self.described("time")["dims"], [COLUMNS, ROWS, 3])
        self.assertIn("copy", self.works("info", "time").stderr)

    def test_a_series_is_chosen_by_its_number(self):
        more = {(0x20, 0x11): (b"IS", b"4"), (0x08, 0x103E): (b"LO", b"bones\x1b[2J")}
        write_series("two", self.values[:4], range(4), series="1.2.4", elements=more)
        more = {(0x20, 0x11): (b"IS", b"7")}
        write_series("two", self.values[4:], range(5), series="1.2.5", prefix="b", elements=more)
        info = self.described("two")
        series = ['4 "bones [2J" (CT, 16 x 12 x 4)', "7 (CT, 16 x 12 x 5)"]
        self.assertEqual(info["series"], series)
        self.assertIn("series 7 (CT, 16 x 12 x 5), the largest of 2", info["note"])
        self.assertIn("--series N", info["note"])
        self.same(self.drawn("two"), self.raw(self.values[4:], range(5)))
        self.same(self.drawn("two", "--series", 4), self.raw(self.values[:4], range(4)))
        self.assertIn(f"series       {series[0]}\n", self.works("info", "two").stdout.decode())
        self.assertIn("format       images (DICOM)\n", self.works("info", "two").stdout.decode())
        self.fails(2, "info", "two", "--series=1", says=f"has no series 1; it has {', '.join(series)}")
        # Pictures that are drawn through the cache follow the option, too.
        chosen = self.picture("two", *VIEW, "--series", 4)
        write_series("one", self.values[:4], range(4))
        self.same(chosen, self.picture("one", *VIEW))
        self.assertFalse((chosen == self.picture("two", *VIEW)).all())

    def test_objects_without_pixels_are_passed_over(self):
        write_series("mixed", self.values, range(9))
        report = slice_of(self.values[0])
        for tag in [t for t in report if t[0] in (0x28, 0x7FE0)]:
            del report[tag]
        write("mixed/REPORT", report)
        program.write("mixed/DICOMDIR", bytes(128) + b"DICM" + b"\xff" * 64)
        note = self.described("mixed")["note"]
        self.assertIn("2 DICOM objects without pixels passed over", note)
        self.same(self.drawn("mixed"), self.raw(self.values, range(9)))
        self.fails(1, "info", "mixed/REPORT", says="mixed/REPORT: holds no pixels")
        os.makedirs("reports")
        for name in "a", "b":
            write(f"reports/{name}", report)
        self.fails(1, "info", "reports", says="neither do the other DICOM files")

    def test_a_file_of_a_series_tells_of_the_others(self):
        write_series("series", self.values, range(9))
        write_series("series", self.values[:2], range(2), series="1.9", prefix="other")
        program.write("series/damaged", bytes(128) + b"DICM" + b"\xff" * 64)
        info = self.described("series/i004")
        self.assertEqual(info["dims"], [COLUMNS, ROWS, 1])
        self.assertIn("its folder holds 8 more", info["note"])

    def mosaic(self, normal):
        """Writes the nine slices as tiles. The first one is at (10, 20, 30) in LPS."""
        tiles = self.values.reshape(3, 3, ROWS, COLUMNS).transpose(0, 2, 1, 3)
        place = numpy.array([10, 20, 30]) - [COLUMNS, ROWS, 0]  # the large slice has this corner
        header = csa_header(NumberOfImagesInMosaic=[9], SliceNormalVector=[0, 0, normal])
        write("mosaic.dcm", slice_of(tiles.reshape(3 * ROWS, 3 * COLUMNS), place, elements={
            (0x08, 0x08): (b"CS", b"ORIGINAL\\PRIMARY\\M\\ND\\MOSAIC"),
            (0x18, 0x88): (b"DS", b"2"),
            (0x29, 0x10): (b"LO", b"SIEMENS CSA HEADER"),
            (0x29, 0x1010): (b"OB", header),
        }))
        return self.described("mosaic.dcm")

    def test_mosaics_are_unfolded(self):
        for normal, values, first in (1, self.values, 30), (-1, self.values[::-1], 30 - 2 * 8):
            info = self.mosaic(normal)
            self.assertEqual(info["dims"], [COLUMNS, ROWS, 9])
            self.assertEqual([row[3] for row in info["index_to_world"]], [-10, -20, first])
            self.assertEqual(info["index_to_world"][2][2], 2)
            program.write_stack("plain", values, lambda path, image: write(
                path, slice_of(image, (10, 20, first + 2 * int(path[-8:-4])),
                               instance=int(path[-8:-4]))), "dcm")
            self.same(self.drawn("mosaic.dcm"), self.drawn("plain"))

    def test_frames_lie_at_their_own_positions(self):
        """Frames of two times, at uneven distances, from the last one to the first."""
        z = [0, 1, 6, 11]
        frames = numpy.concatenate([self.values[3::-1], self.values[7:3:-1]])
        places = [(0, 0, z[3 - k % 4]) for k in range(8)]
        program.write_dicom("frames.dcm", frames, 0, (1, 1, 1), places[0], frames=places)
        for time in 0, 1:
            own = self.raw(self.values[4 * time:4 * time + 4], z)
            self.same(self.drawn("frames.dcm", "--time", time), own)

    def test_each_segment_of_a_segmentation_is_a_series(self):
        """Bits of segment 1 follow bits of segment 2 at one position, in the middle of a byte."""
        bits = numpy.random.default_rng(3).integers(0, 2, (2, 7, 9), "u1")
        sequence, numbers_at = program.dicom_sequence, program.dicom_numbers
        us = lambda group, element, value: program.dicom_element(group, element, b"US", number(value))
        frames = [sequence(0x20, 0x9113, [numbers_at(0x20, 0x32, (0, 0, 0))])
                  + sequence(0x62, 0x0A, [us(0x62, 0x0B, segment)]) for segment in (2, 1)]
        names = [us(0x62, 4, segment) + program.dicom_element(0x62, 5, b"LO", name)
                 for segment, name in ((1, b"liver"), (2, b"spleen"))]
        elements = slice_of(bits, elements={
            (0x28, 0x08): (b"IS", b"2"),
            (0x28, 0x100): (b"US", number(1)),
            (0x28, 0x101): (b"US", number(1)),
            (0x28, 0x102): (b"US", number(0)),
            (0x62, 0x02): (b"SQ", sequence(0, 0, names)[12:]),
            (0x5200, 0x9229): (b"SQ", sequence(0, 0, [sequence(
                0x20, 0x9116, [numbers_at(0x20, 0x37, AXIAL)])])[12:]),
            (0x5200, 0x9230): (b"SQ", sequence(0, 0, frames)[12:]),
            (0x7FE0, 0x10): (b"OB", numpy.packbits(bits, bitorder="little").tobytes()),
        })
        write("seg.dcm", elements)
        self.assertEqual(self.described("seg.dcm")["series"], [
            '1 "segment spleen" (CT, 9 x 7 x 1)', '2 "segment liver" (CT, 9 x 7 x 1)'])
        for series in 1, 2:
            program.write_nrrd("own.nrrd", bits[series - 1:series])
            self.brick("own.nrrd", "own.trip", "--keep-all", "--axes=LPS")
            own = self.picture("own.trip", *FLAT)
            self.brick("seg.dcm", "seg.trip", "--keep-all", "--series", series)
            self.same(own, self.picture("seg.trip", *FLAT))

    def test_a_damaged_file_is_named(self):
        write_series("bad", self.values, range(9))
        with open("bad/i004", "rb") as file:
            sound = file.read()
        pixels = sound.rindex(b"\xe0\x7f\x10\0OW")
        for at, data, says in (
            (len(sound) - 7, b"", "is cut off"),
            (300, b"", "bad/i004: "),
            (pixels + 8, b"\xff\xff\xff\x7f", "is cut off"),
            (pixels + 8, struct.pack("<I", 100) + sound[pixels + 12:], "wrong size"),
            (pixels + 8, b"\xff\xff\xff\xff" + sound[pixels + 12:], "without a size"),
        ):
            program.write("bad/i004", sound[:at] + data)
            self.fails(1, "brick", "bad", "-o", "b.trip", "-q", says="bad/i004: ")
            if says != "is cut off" or at == len(sound) - 7:
                self.fails(1, "info", "bad", says=says)
        with open(os.path.join(FILES, "rtdose_expb.dcm"), "rb") as file:
            sound = file.read()
        program.write("many.dcm", sound.replace(b"IS\0\x0215", b"IS\0\x0299", 1))
        self.fails(1, "info", "many.dcm", says="wrong size")
        name = "JPEG2000.dcm"
        with open(os.path.join(FILES, name), "rb") as file:
            sound = file.read()
        for cut in 400, len(sound) - 300:
            program.write(name, sound[:cut])
            self.leaves_nothing(1, "brick", name, "-o", "b.trip", "-q", says=f"{name}: ")

    def test_options_for_series_need_dicom(self):
        program.write_nrrd("a.nrrd", self.values)
        self.fails(2, "info", "a.nrrd", "--series=1", says="requires DICOM")
        self.fails(2, "brick", "a.nrrd", "-o", "a.trip", "-q", "--series=2", says="requires DICOM")
        self.brick("a.nrrd", "a.trip")
        for command in "info", "view", "serve":
            self.fails(2, command, "a.trip", "--series=1", says="is a data set")
        self.assertEqual(self.described("a.nrrd")["dims"], [COLUMNS, ROWS, 9])
        self.assertEqual(self.described("a.nrrd")["type"], "uint16")


if __name__ == "__main__":
    program.main()
