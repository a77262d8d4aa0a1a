"""Tests truncated, damaged, empty, too large and inconsistent volumes with every reader. Each gives
one line and exit status 1 or 2, and leaves no data set."""
import concurrent.futures
import os
import random
import struct
import unittest
import zlib

import numpy

import program

try:
    import pyopenvdb
except ImportError:
    pyopenvdb = None

VALUES = program.noise((10, 12, 14))


def make_nrrd(encoding):
    program.write_nrrd("made.nrrd", VALUES, encoding=encoding)
    return read("made.nrrd")


LONGER = int(os.environ.get("TRIP_LONGER", 1))  # factor on the number of damaged files, for runs by hand


def read(path):
    with open(path, "rb") as f:
        return f.read()


def lengths(data, header):
    """Returns lengths for truncated files: nothing, the magic number, within and after the header,
    within and before the end."""
    return sorted(
        {
            0,
            1,
            5,
            header // 2,
            header - 1,
            header,
            header + 1,
            (header + len(data)) // 2,
            len(data) - 1,
        }
    )


class BadVolumes(program.ProgramTest):
    count = 0

    def setUp(self):
        self.pool = concurrent.futures.ThreadPoolExecutor(os.cpu_count())
        self.waiting = []

    def tearDown(self):
        self.pool.shutdown()

    def name(self, extension):
        BadVolumes.count += 1
        return f"bad-{BadVolumes.count:04d}{extension}"

    def later(self, check, *arguments, **named):
        self.waiting.append(self.pool.submit(check, *arguments, **named))

    def finish(self):
        """Waits for all checks and reports all faults at once."""
        faults = [str(r.exception())[:400] for r in self.waiting if r.exception()]
        self.assertEqual(faults, [], "\n".join(faults))
        self.assertFalse([n for n in os.listdir(".") if ".trip" in n])

    def refused(self, source, *options, status=(1,)):
        """Checks that there is exactly one line and no data set."""
        run = program.call(
            "brick", source, "-o", f"{source}.trip".replace("/", "-"), "-q", *options
        )
        about = f"{source[:60]}: {options}: exit status {run.returncode}, stderr: {run.stderr!r}"
        self.assertTrue(run.returncode in status and program.LINE.fullmatch(run.stderr), about)
        return run.stderr

    def refused_bytes(self, data, extension, *options, status=(1,)):
        source = self.name(extension)
        program.write(source, data)
        return self.refused(source, *options, status=status)

    def endured(self, data, extension, *options):
        """Checks that the file is refused or still readable, with at most one error line."""
        source = self.name(extension)
        program.write(source, data)
        run = program.call(
            "brick", source, "-o", f"{source}.trip", "-q", "--memory", "256M", *options
        )
        about = f"{source}: exit status {run.returncode}, stderr: {run.stderr!r}"
        self.assertIn(run.returncode, (0, 1, 2), about)
        if run.returncode:
            lines = run.stderr.splitlines(True)
            self.assertTrue(program.LINE.fullmatch(lines[-1]), about)
            self.assertTrue(all("triptych: warning: " in line for line in lines[:-1]), about)
        else:
            self.assertTrue(run.stderr == "" or "warning" in run.stderr, about)
            program.shutil.rmtree(f"{source}.trip")

    def cut(self, data, header, extension, *options):
        for length in lengths(data, header):
            self.later(self.refused_bytes, data[:length], extension, *options)

    def damage(self, data, extension, *options, first=0, last=None, times=12):
        """Replaces bytes of [first, last), a few at a time."""
        chance = random.Random(len(data))
        for _ in range(times * LONGER):
            changed = bytearray(data)
            for _ in range(chance.choice((1, 1, 4))):
                changed[chance.randrange(first, last or len(data))] = chance.randrange(256)
            self.later(self.endured, bytes(changed), extension, *options)

    # Raw

    def test_bad_raw_files_are_refused(self):
        program.write_raw("good.raw", VALUES)
        size = "--size=14,12,10"
        for bad in (
            "0,12,10",
            "-14,12,10",
            "14,12",
            "14,12,10,1",
            "14x12",
            "a,b,c",
            "",
            "nan,12,10",
            "99999999999999999999,1,1",
            "14,12,10.5",
        ):
            self.later(self.refused, "good.raw", f"--size={bad}", status=(2,))
        for large in (
            "14,12,11",
            "2147483647,2147483647,2147483647",
            "16777216,16777216,1",
            "9223372036854775807,2,1",
            "1,1,2147483647",
        ):
            self.later(self.refused, "good.raw", f"--size={large}", status=(1, 2))
        for option in (
            "--type=int7",
            "--type=",
            "--type=rgb",
            "--endian=middle",
            "--endian=",
            "--offset=-1",
            "--offset=x",
            "--offset=99999999999999999999",
            "--spacing=0,1,1",
            "--spacing=-1,1,1",
            "--spacing=nan,1,1",
            "--spacing=inf,1,1",
            "--spacing=1,1",
            "--spacing=1e400,1,1",
        ):
            self.later(self.refused, "good.raw", size, option, status=(2,))
        self.later(self.refused, "good.raw", size, "--offset=1")
        self.later(self.refused, "good.raw", size, "--offset=18446744073709551615", status=(1, 2))
        self.later(self.refused, "good.raw", size, "--type=uint16")
        self.later(self.refused, "good.raw", status=(1, 2))
        for length in 0, 1, VALUES.size - 1:
            self.later(self.refused_bytes, VALUES.tobytes()[:length], ".raw", size)
        self.finish()

    # NRRD

    def test_bad_nrrd_files_are_refused(self):
        for encoding in "raw", "gzip":
            data = make_nrrd(encoding)
            header = data.index(b"\n\n") + 2
            self.cut(data, header, ".nrrd")
            self.damage(data, ".nrrd", last=header)
            self.damage(data, ".nrrd", first=header, times=4)
        self.finish()

    def test_bad_nrrd_headers_are_refused(self):
        good = {"type": "uint8", "dimension": "3", "sizes": "14 12 10", "encoding": "raw"}
        bad = [
            {"type": "block"},
            {"type": "uint7"},
            {"type": ""},
            {"dimension": "0"},
            {"dimension": "2"},
            {"dimension": "17"},
            {"dimension": "-3"},
            {"dimension": "x"},
            {"sizes": "0 12 10"},
            {"sizes": "14 12"},
            {"sizes": "-14 12 10"},
            {"sizes": "14 12 10 10"},
            {"sizes": "9223372036854775807 9223372036854775807 2"},
            {"sizes": "4294967296 4294967296 1"},
            {"sizes": "14 12 99999999999999999999"},
            {"sizes": "14 12 nan"},
            {"sizes": "14 12 100000000"},
            {"encoding": "rot13"},
            {"encoding": "gzip"},
            {"encoding": "bzip2"},
            {"type": "uint16", "endian": "middle"},
            {"spacings": "0 1 1"},
            {"spacings": "nan 1 inf"},
            {"spacings": "1 1"},
            {"spacings": "1e999 1 1"},
            {"space dimension": "3", "space directions": "(1,0,0) (0,1,0) (0,2,0)"},
            {"space dimension": "3", "space directions": "(1,0,0) (0,1,0) (0,0,nan)"},
            {"space dimension": "3", "space directions": "(1,0,0) (0,1,0)"},
            {"space dimension": "3", "space directions": "(1,0) (0,1) (0,0)"},
            {
                "space dimension": "3",
                "space directions": "(1,0,0) (0,1,0) (0,0,1)",
                "space origin": "(inf,0,0)",
            },
            {"data file": "missing.raw"},
            {"data file": "."},
            {"data file": "LIST\nmissing"},
            {"data file": "slice%03d.raw 1 3 0"},
            {"data file": "slice%s%s%s%n.raw 1 3 1"},
            {"byte skip": "-2"},
            {"byte skip": "99999999999"},
            {"line skip": "5"},
            {"line skip": "-1"},
        ]
        for change in bad:
            fields = "".join(f"{k}: {v}\n" for k, v in {**good, **change}.items())
            data = b"NRRD0004\n" + fields.encode() + b"\n" + VALUES.tobytes()
            self.later(self.refused_bytes, data, ".nrrd")
        for data in (
            b"NRRD",
            b"NRRD0009\n" + b"\n" * 5,
            b"NRRD0004\n\n",
            b"NRRD0004\n" + b"a" * 100000,
            b"NRRD0004\ntype: uint8\n" + b"# no end\n" * 10000,
            b"NRRD0004\r\n\0\0\0\r\n\r\n",
            b"NRRD0004\ndimension: 3\ntype: uint8\nencoding: raw\n\n",
        ):
            self.later(self.refused_bytes, data, ".nrrd")
        self.finish()

    def test_voxels_too_far_from_the_origin_are_refused(self):
        """Positions are doubles, which tell 2^50 = 1.126e15 voxels apart, to a quarter of one."""
        says = "lie up to .* voxels from the origin of world space"
        grid = ("space dimension: 3\nspace directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: "
                "({},0,0)\n")
        for origin, good in (1e13, True), (1.12e15, True), (1.13e15, False), (1e30, False), (1e300, False):
            source = self.name(".nrrd")
            program.write(source, b"NRRD0004\ntype: uint8\ndimension: 3\nsizes: 14 12 10\n"
                          b"encoding: raw\n" + grid.format(origin).encode() + b"\n" + VALUES.tobytes())
            if good:
                self.works("render", source, "-o", "far.png", "--size", "16x16")
            else:
                self.assertRegex(self.refused(source), says)
        program.write_nifti("made.nii", VALUES)
        changed = bytearray(read("made.nii"))
        struct.pack_into("<2h", changed, 252, 0, 1)  # the sform counts
        struct.pack_into("<12f", changed, 280, 1, 0, 0, 1e30, 0, 1, 0, 0, 0, 0, 1, 0)
        self.assertRegex(self.refused_bytes(bytes(changed), ".nii"), says)
        for axis, value in (0, "1e300"), (2, "1e17"):
            for a, count in enumerate((14, 12, 10)):
                with open(f"c{a}.txt", "w", encoding="ascii") as f:
                    f.writelines(f"{float(value) * (1 + i / 100) if a == axis else i}\n" for i in range(count))
            program.write_nrrd("plain.nrrd", VALUES)
            self.refused("plain.nrrd", "--coordinates=c0.txt,c1.txt,c2.txt")
        for spacing in "1e-300,1e-300,1e-300", "1e300,1e300,1e300", "1,1,1e-20":
            self.refused("plain.nrrd", f"--spacing={spacing}")

    # NIfTI

    def test_bad_nifti_files_are_refused(self):
        for packed in False, True:
            program.write_nifti("made.nii", VALUES, packed=packed)
            data = read("made.nii")
            self.cut(data, 100 if packed else 352, ".nii.gz" if packed else ".nii")
            self.damage(data, ".nii.gz" if packed else ".nii", last=352, times=8 if packed else 24)
        self.finish()

    def test_bad_nifti_headers_are_refused(self):
        program.write_nifti("made.nii", VALUES)
        good = read("made.nii")
        bad = [
            ("<h", 40, 0),
            ("<h", 40, 8),
            ("<h", 40, -1),
            ("<h", 42, 0),
            ("<h", 42, -5),
            ("<h", 46, 32767),
            ("<4h", 42, 32767, 32767, 32767, 32767),
            ("<h", 70, 0),
            ("<h", 70, 128),
            ("<h", 70, 9999),
            ("<f", 108, float("nan")),
            ("<f", 108, 1e30),
            ("<f", 108, -8),
            ("<f", 108, 0),
            ("<i", 0, 349),
        ]
        for form, at, *values in bad:
            changed = bytearray(good)
            struct.pack_into(form, changed, at, *values)
            self.later(self.refused_bytes, bytes(changed), ".nii")
        for form, at, *values in (
            ("<2f", 112, float("nan"), 0),
            ("<2f", 112, float("inf"), 0),
            ("<2f", 112, 1, float("nan")),
            ("<2f", 112, 1e38, 1e38),
            ("<f", 280, float("nan")),
            ("<f", 292, float("inf")),
            ("<12f", 280, *[0] * 12),
            ("<h", 72, 7),
        ):
            changed = bytearray(good)
            struct.pack_into(form, changed, at, *values)
            self.later(self.endured, bytes(changed), ".nii")
        self.finish()

    # .vol

    def test_bad_vol_files_are_refused(self):
        for version in 2, 3:
            program.write_vol("made.vol", VALUES, version)
            data = read("made.vol")
            header = data.index(b"\n.\n") + 3
            self.cut(data, header, ".vol")
            self.damage(data, ".vol", last=header)
        header = b"X: 14\nY: 12\nZ: 10\nVersion: 3\n.\n"
        packed = zlib.compress(VALUES.tobytes())
        for change in (
            (b"X: 14", b"X: 0"),
            (b"X: 14", b"X: -14"),
            (b"X: 14", b"X: 99999999999999999999"),
            (b"X: 14", b"X: 1e2"),
            (b"Y: 12\n", b""),
            (b"Z: 10", b"Z: 11"),
            (b"Version: 3", b"Version: 9"),
            (b"Z: 10", b"Z: 2000000000"),
            (b"\n.\n", b"\n"),
            (b"X: 14", b"X 14"),
            (b"Version", b"Voxel-Size: 0\nVersion"),
            (b"Version", b"Voxel-Size: nan\nVersion"),
            (b"X: 14", b"X: " + b"1" * 300),
        ):
            self.later(self.refused_bytes, header.replace(*change) + packed, ".vol")
        self.later(self.refused_bytes, header + b"\x78\x9c\0\0\0", ".vol")
        self.finish()

    # Stacks

    def test_bad_images_are_refused(self):
        for write, extension in (program.write_tiff, ".tif"), (program.write_png, ".png"):
            write("made" + extension, VALUES[3])
            data = read("made" + extension)
            for length in 0, 4, 20, len(data) // 2, len(data) - 20:
                self.later(self.refused_bytes, data[:length], extension)
            self.damage(data, extension, times=4)
        program.write_dicom("made.dcm", VALUES[3].astype("u2"), 3)
        data = read("made.dcm")
        for length in 0, 100, 132, 300, len(data) // 2, len(data) - 2:
            self.later(self.refused_bytes, data[:length], ".dcm")
        self.damage(data, ".dcm", first=128, times=6)
        self.finish()

    def test_bad_stacks_are_refused(self):
        def stack(name, *images):
            os.mkdir(name)
            for i, image in enumerate(images):
                if isinstance(image, bytes):
                    program.write(f"{name}/{i}.tif", image)
                else:
                    program.write_tiff(f"{name}/{i}.tif", image)
            return name

        flat = VALUES[0]
        good = read_tiff(flat)
        for name in (
            stack("different-sizes", flat, flat[:5]),
            stack("different-types", flat, flat.astype("u2")),
            stack("empty-folder"),
            stack("with-an-empty-file", flat, b"", flat),
            stack("with-a-text", flat, b"hello\n"),
            stack("with-half", flat, good[: len(good) // 2]),
        ):
            self.later(self.refused, name)
        os.makedirs("only-folders/inside")
        for name in (
            "only-folders",
            "missing-%03d.tif",
            "missing*.png",
            "missing-folder",
            "%s%s%n.tif",
            "different-sizes/%d.tif",
            "/dev/null",
            "/dev/zero",
            "",
        ):
            self.later(self.refused, name, status=(1, 2))
        self.finish()

    # OpenVDB

    @unittest.skipUnless(pyopenvdb, "python3-openvdb is not installed")
    def test_bad_openvdb_files_are_refused(self):
        grid = pyopenvdb.FloatGrid()
        grid.name = "density"
        grid.copyFromArray(numpy.ascontiguousarray(VALUES.astype("f4")))
        pyopenvdb.write("made.vdb", grid)
        data = read("made.vdb")
        self.cut(data, 400, ".vdb")
        self.damage(data, ".vdb", times=12)
        self.damage(data, ".vdb", last=700, times=12)
        program.write("good.vdb", data)
        self.later(self.refused, "good.vdb", "--grid=nothing", status=(1, 2))
        empty = pyopenvdb.FloatGrid()
        pyopenvdb.write("empty.vdb", empty)
        self.later(self.refused, "empty.vdb")
        pyopenvdb.write("points-only.vdb", [pyopenvdb.Vec3SGrid()])
        self.later(self.refused, "points-only.vdb")
        self.finish()

    def test_a_level_set_is_filled_with_a_note(self):
        if not pyopenvdb:
            self.skipTest("python3-openvdb is not installed")
        ball = pyopenvdb.createLevelSetSphere(radius=5.0)
        pyopenvdb.write("ball.vdb", ball)
        run = self.works("brick", "ball.vdb", "-o", "default.trip")
        self.assertRegex(run.stderr, r"^triptych: note: ball.vdb: [^\n]*--level-set band[^\n]*\n$")
        for how in "filled", "band":
            run = self.works("brick", "ball.vdb", "-o", f"{how}.trip", "--level-set", how)
            self.assertNotIn("level set", run.stderr)
        kept = [self.info(f"{how}.trip")["kept"] for how in ("default", "filled", "band")]
        self.assertEqual(kept[0], kept[1])
        self.assertNotEqual(kept[0], kept[2])
        for how in "default", "filled", "band":
            program.shutil.rmtree(f"{how}.trip")

    def test_a_note_names_the_chosen_grid_and_the_others(self):
        run = self.works("brick", os.path.join(program.DATASETS, "densityAndHeat.vdb"), "-o", "chosen.trip")
        self.assertRegex(run.stderr, r'^triptych: note: [^\n]*"density" is used[^\n]*: heat; [^\n]*\n$')
        self.assertEqual(self.info("chosen.trip")["source"]["grid"], "density")
        program.shutil.rmtree("chosen.trip")
        self.fails(
            2, "brick", os.path.join(program.DATASETS, "densityAndHeat.vdb"), "--grid", "heat", "--grid", "density", says="one grid"
        )

    # Any path

    def test_files_that_are_no_volumes_are_refused(self):
        program.write("text.txt", b"hello\n" * 100)
        program.write("zeros", bytes(5000))
        program.write("a.trip.png", b"")
        os.remove("a.trip.png")
        os.mkdir("folder.nrrd")
        os.symlink("loop", "loop")
        os.symlink("nowhere", "dangling.nrrd")
        os.mkfifo("fifo.nrrd")
        for source in (
            "text.txt",
            "zeros",
            "folder.nrrd",
            "loop",
            "dangling.nrrd",
            "missing.nrrd",
            "missing/a.nrrd",
            "text.txt/a.nrrd",
            "x" * 5000,
            os.path.join(program.DATASETS, "tooth.raw"),
        ):
            self.later(self.refused_named, source)
        self.later(self.refused_named, "fifo.nrrd")
        self.finish()

    def refused_named(self, source):
        run = program.call("brick", source, "-o", "named.trip", "-q", timeout=20)
        self.assertIn(run.returncode, (1, 2), (source, run.stderr))
        self.assertTrue(program.LINE.fullmatch(run.stderr), (source, run.stderr))

    def test_volumes_without_usable_values(self):
        for name, value in ("nan", numpy.nan), ("inf", numpy.inf):
            values = numpy.full((4, 5, 6), value, "f4")
            program.write_nrrd(f"{name}.nrrd", values)
            self.assertIn("no finite value", self.refused(f"{name}.nrrd"))
        program.write_nrrd("ones.nrrd", numpy.ones((4, 5, 6), "u1"))
        self.assertIn("no voxel is visible", self.refused("ones.nrrd", "--range=5:9"))
        self.works("brick", "ones.nrrd", "-o", "ones.trip", "-q")
        self.works("render", "ones.trip", "-o", "ones.png", "--size", "40x40")
        program.shutil.rmtree("ones.trip")
        program.write_nrrd("huge.nrrd", numpy.array([[[1e308, -1e308, 5]]], "f8"))
        self.endured(read("huge.nrrd"), ".nrrd")
        program.write_nrrd("one.nrrd", numpy.array([[[7]]], "u1"))
        self.works("brick", "one.nrrd", "-o", "one.trip", "-q")
        self.works("render", "one.trip", "-o", "one.png", "--size", "40x40")
        program.shutil.rmtree("one.trip")


def read_tiff(image):
    program.write_tiff("one-slice.tif", image)
    return read("one-slice.tif")


if __name__ == "__main__":
    program.main()
