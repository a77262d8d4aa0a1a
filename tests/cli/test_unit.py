"""Tests that the unit of world space has no influence. A volume with voxels of 2^k and values times
2^m gives the same records and the same picture, bit for bit."""
import numpy
import program

FILES = [f"{axis}0.{plane}" for axis in "xyz" for plane in ("voxels", "normals")]
VOLUME = program.ball((14, 16, 18), dtype="f4")


class Scale(program.ProgramTest):
    def records(self, spacing, factor, *options):
        """Bricks the scaled volume. Returns the contents of its plane files."""
        program.write_nrrd("a.nrrd", VOLUME * numpy.float32(factor), spacing=(spacing,) * 3)
        self.brick("a.nrrd", "a.trip", "--normals=stored", *options)
        contents = []
        for name in FILES:
            with open(f"a.trip/{name}", "rb") as f:
                contents.append(f.read())
        return contents

    def test_the_records_are_the_same(self):
        for given in (False, True):  # with a given range, the program reads the values once

            def records(spacing, factor):
                limits = f"--range={0.1 * factor!r}:{2.0 * factor!r}"
                return self.records(spacing, factor, *([limits] if given else []))

            expected = records(1, 1.0)
            self.assertTrue(any(byte for byte in expected[1][3::4]))
            for spacing, factor in ((2.0**-40, 2.0**100), (2.0**40, 2.0**-100), (2.0**-30, 1.0)):
                self.assertEqual(records(spacing, factor), expected, (given, spacing, factor))

    def test_the_picture_is_the_same(self):
        program.write(
            "tf.txt",
            b"values data\nunit voxel\n0 0 0 0 0\n0.2 1 0.5 0.2 0.1\n1 0.3 0.6 1 0.8\n",
        )
        self.records(1, 1.0)
        for renderer in "cpu", "reference", *program.GL:
            options = ("--size=48x48", f"--renderer={renderer}", "--tf=tf.txt")
            pictures = []
            for spacing in (1.0, 2.0**-40, 2.0**13, 2.0**40):
                self.records(spacing, 1.0)
                pictures.append(self.picture("a.trip", *options))
            self.assertGreater(pictures[0][..., 3].max(), 0.5)
            for picture in pictures[1:]:
                self.assertTrue(numpy.array_equal(picture, pictures[0]), renderer)


if __name__ == "__main__":
    program.main()
