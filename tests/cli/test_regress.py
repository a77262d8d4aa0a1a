"""Tests of fixed faults, with the small files of tests/regress or files made here."""
import bz2
import gzip
import json
import os
import signal
import struct
import time

import PIL.Image
import numpy
import program

REGRESS = os.path.join(os.environ["TRIP_SOURCE_DIR"], "tests", "regress")
LIMIT_S = 2 * (4 if program.SANITIZED else 1)  # seconds of processor time
VIEW = ("--size=40x40", "--h=0", "--classify=pre")


class Regress(program.ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.source = os.path.join(REGRESS, "block.nrrd")
        brick = program.call("brick", cls.source, "-o", "block.trip", "-q")
        assert brick.returncode == 0, brick.stderr

    def draw(self, *arguments, **options):
        process = program.start("render", "block.trip", "-o", "p.png", "--renderer=cpu",
                                "--size=16x16", "--interpolation=linear", *arguments, **options)
        err = process.communicate()[1]
        self.assertEqual((process.returncode, err), (0, b""))
        return process.pid

    def test_voxels_of_any_size_are_drawn(self):
        """Squared areas once overflowed floats, and the picture was empty."""
        for spacing, view in (
            *((scale, ()) for scale in (1e-12, 1e-8, 1e4, 1e12)),
            (100, ("--fov=0.1",)),
        ):
            self.brick(self.source, "scaled.trip", f"--spacing={spacing},{spacing},{spacing}")
            expected = self.picture("scaled.trip", "--renderer=reference", *VIEW, *view)
            drawn = self.picture("scaled.trip", "--renderer=cpu", *VIEW, *view)
            self.assertGreater(expected[..., 3].max(), 0.5, (spacing, view))
            self.assertLessEqual(numpy.abs(drawn - expected).max(), 2 / 255, (spacing, view))

    def test_pages_of_a_tiff_are_its_slices_in_spite_of_tags_and_thumbnails(self):
        """Files with private tags were refused, and so were files with a reduced page."""
        for name, kind in ("unknown-tags", "<i2"), ("thumbnail-page", "<u2"):
            pages = PIL.Image.open(os.path.join(REGRESS, f"{name}.tif"))
            values = []
            for page in range(24):
                pages.seek(page)
                values.append(numpy.array(pages).astype(kind))
            volume = numpy.stack(values)
            if name == "unknown-tags":
                volume = numpy.where(volume == -9999, numpy.nan, volume).astype("<f4")
            program.write("pages.raw", volume.tobytes())
            self.brick("pages.raw", "raw.trip", "--size=40,32,24", "--keep-all",
                       f"--type={'float' if kind == '<i2' else 'uint16'}")
            self.brick(os.path.join(REGRESS, f"{name}.tif"), "tiff.trip", "--keep-all")
            drawn, expected = (self.picture(f"{d}.trip", *VIEW, "--tf=grey", "--up=0,0,1", "--view=left")
                               for d in ("tiff", "raw"))
            self.assertGreater(expected.std(), 0.01)
            self.assertTrue((drawn == expected).all(), name)

    def values(self, source, *options):
        """Returns the summary of a data set of all values."""
        run = self.works("brick", source, "-o", "all.trip", "--force", "--keep-all", "--json", *options)
        self.note = run.stderr
        return json.loads(run.stdout)

    def test_channels_of_an_ome_tiff_are_volumes(self):
        """Both channels were read as one stack of 48 slices, 1 apart."""
        source = os.path.join(REGRESS, "two-channels.ome.tif")
        for channel, most in (0, 1000), (1, 500):
            s = self.values(source, f"--channel={channel}")
            self.assertEqual((s["dims"], s["spacing"], s["value_max"]), ([40, 32, 24], [0.5, 0.5, 1], most))
            self.assertIn(f"channel {channel} of 2", self.note)
        self.fails(2, "brick", source, "-o", "no.trip", "--channel=2", says="has 2 channels")
        self.fails(2, "brick", source, "-o", "no.trip", "--time=1", says="has one time")

    def test_microscopy_stands_with_z_up(self):
        """Long voxels counted as a scan of a head from the top down."""
        source = os.path.join(REGRESS, "two-channels.ome.tif")
        for spacing in (), ("--spacing=1,1,3",):
            self.brick(source, "ome.trip", "--force", *spacing)
            notes = self.info("ome.trip")["source"]
            self.assertEqual((notes["orientation"], notes["up"]), ("format", "+z"))
        up, default = (self.picture("ome.trip", *VIEW, *options) for options in (("--up=0,0,1",), ()))
        self.assertGreater(default.std(), 0.01)
        self.assertTrue((up == default).all())

    def test_the_absent_value_of_a_tiff_is_absent(self):
        """The value -9999 of the first three planes counted as a value."""
        s = self.values(os.path.join(REGRESS, "unknown-tags.tif"))
        self.assertEqual((s["dims"], s["value_min"], s["not_finite"]), ([40, 32, 24], 0, 3 * 40 * 32))

    def test_text_in_a_compressed_file_is_read(self):
        """Values as text, and any file that was compressed as a whole, were refused."""
        grid = program.noise((4, 5, 6), "<i2")
        text = " ".join(map(str, grid.ravel())) + "\n"
        head = "NRRD0005\ntype: short\ndimension: 4\nsizes: 1 6 5 4\nencoding: ascii\n\n"
        program.write("text.bin", gzip.compress((head + text).encode()))
        s = self.values("text.bin")
        self.assertEqual((s["dims"], s["value_min"], s["value_max"]), ([6, 5, 4], grid.min(), grid.max()))

    def test_a_nifti_file_named_gz_need_not_be_compressed(self):
        header = bytearray(352)
        struct.pack_into("<i", header, 0, 348)
        struct.pack_into("<8h", header, 40, 3, 6, 5, 4, 1, 1, 1, 1)
        struct.pack_into("<2h", header, 70, 2, 8)
        struct.pack_into("<8f", header, 76, 1, 1, 1, 1, 1, 1, 1, 1)
        struct.pack_into("<3f", header, 108, 352, 1, 0)
        header[344:348] = b"n+1\0"
        program.write("plain.nii.gz", bytes(header) + bytes(range(120)))
        self.brick("plain.nii.gz", "plain.trip", "--keep-all")
        info = self.info("plain.trip")
        self.assertEqual((info["dims"], info["value_max"]), ([6, 5, 4], 119))

    def test_a_temporary_of_a_killed_process_does_no_harm(self):
        """The killed process had the same process number."""

        def leave():
            program.write(f".triptych-{os.getpid()}.tmp", b"")

        os.remove(f".triptych-{self.draw(preexec_fn=leave)}.tmp")

    def test_ctrl_c_ends_a_skip_through_compressed_data(self):
        """The file holds 90 GB of zeros in 90 kB. Ctrl-C once waited for the end of the skip."""
        program.write("zeros.bz2", bz2.compress(bytes(45 << 20)) * 2000)
        program.write(
            "zeros.nhdr",
            b"NRRD0004\ntype: uint8\ndimension: 3\nsizes: 4 4 4\nencoding: bzip2\n"
            b"byte skip: 90000000000\ndata file: zeros.bz2\n",
        )
        before = set(os.listdir("."))
        process = program.start("brick", "zeros.nhdr", "-o", "zeros.trip", "-q")
        program.await_handler(process)
        while process.poll() is None and program.processor_seconds(process) < 0.2:
            time.sleep(0.01)
        process.send_signal(signal.SIGINT)
        limit = program.processor_seconds(process) + LIMIT_S
        while process.poll() is None and program.processor_seconds(process) < limit:
            time.sleep(0.01)
        ended = process.poll() is not None
        process.kill()
        err = process.communicate()[1].decode()
        self.assertTrue(ended)
        self.assertTrue(program.LINE.fullmatch(err), err)
        self.assertIn("interrupted", err)
        self.assertEqual(set(os.listdir(".")), before)


if __name__ == "__main__":
    program.main()
