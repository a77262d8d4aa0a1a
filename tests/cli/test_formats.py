"""Tests that the same data gives the same picture in every format, and that the positions of voxels
in world space are right."""
import unittest

import numpy

import program

try:
    import pyopenvdb
except ImportError:
    pyopenvdb = None

TRANSFER_FUNCTION = "values data\n20 0.2 0.3 0.9 0\n120 0.9 0.5 0.2 0.05\n255 1 1 0.8 0.6\n"


def look_from(eye, size="96x80"):
    """Returns the options of a view of a whole grid of 40 x 36 x 28 voxels."""
    return [
        "--size",
        size,
        "--look",
        "20,18,14",
        "--up",
        "0.1,0.2,1",
        "--renderer",
        "reference",
        "--eye",
        ",".join(map(str, eye)),
    ]


VIEW = look_from((75, -60, 50))


class Formats(program.ProgramTest):
    """Compares every format with raw."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.values = program.noise((28, 36, 40))
        program.write("a.tf", TRANSFER_FUNCTION.encode())
        program.write_raw("plain.raw", cls.values)
        cls.raw = ("plain.raw", "--size", "40,36,28", "--type", "uint8")
        cls.plain = cls.draw(cls, *cls.raw)
        assert cls.plain[..., 3].max() > 0.5

    def draw(self, source, *options, view=VIEW):
        program.call("brick", source, *options, "-o", "a.trip", "-q", "--force", "--tf", "a.tf")
        run = program.call("render", "a.trip", "-o", "a.exr", *view, program=program.QUICK_PROGRAM)
        assert run.returncode == 0, run.stderr
        return program.read_exr("a.exr")

    def same(self, source, *options):
        picture = self.draw(source, *options)
        self.assertTrue(
            numpy.array_equal(picture, self.plain),
            f"{source}: differs by {abs(picture - self.plain).max()}",
        )

    def alike(self, source, *options, most=1 / 100, mean=1 / 5000):
        """Compares with tolerance. Gradients are stored in 8 bits over the range of the type, so
        that shading differs slightly."""
        difference = abs(self.draw(source, *options) - self.plain)
        self.assertLess(difference.max(), most, source)
        self.assertLess(difference.mean(), mean, source)

    def test_equal_pictures_give_equal_files(self):
        for extension in "exr", "png", "tif", "jpg":
            names = [f"{i}.{extension}" for i in (1, 2)]
            for name in names:
                self.works("render", "a.trip", "-o", name, *VIEW)
            with open(names[0], "rb") as a, open(names[1], "rb") as b:
                self.assertEqual(a.read(), b.read())

    def test_nrrd_equals_raw(self):
        program.write_nrrd("plain.nrrd", self.values)
        self.same("plain.nrrd")
        program.write_nrrd("packed.nrrd", self.values, encoding="gzip", endian="big")
        self.same("packed.nrrd")

    def test_nhdr_with_detached_data_equals_raw(self):
        program.write(
            "detached.nhdr",
            b"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 40 36 28\n"
            b"encoding: raw\ndata file: plain.raw\n",
        )
        self.same("detached.nhdr")

    def test_big_and_little_endian_values_are_equal(self):
        for source, endian in ("big.nrrd", "big"), ("little.nrrd", "little"):
            program.write_nrrd(source, self.values.astype("u2"), endian=endian)
        big, little = self.draw("big.nrrd"), self.draw("little.nrrd")
        self.assertTrue(numpy.array_equal(big, little))
        self.values.astype(">u2").tofile("big.raw")
        words = self.draw("big.raw", "--size=40,36,28", "--type=uint16", "--endian=big")
        self.assertTrue(numpy.array_equal(big, words))
        program.write("shifted.raw", b"a header" + self.values.astype("<u2").tobytes())
        words = self.draw(
            "shifted.raw", "--size=40,36,28", "--type=uint16", "--endian=little", "--offset=8"
        )
        self.assertTrue(numpy.array_equal(big, words))
        self.alike("big.nrrd", most=0.1, mean=0.005)

    def test_nifti_equals_raw(self):
        program.write_nifti("plain.nii", self.values)
        self.same("plain.nii")
        program.write_nifti("packed.nii.gz", self.values, packed=True)
        self.same("packed.nii.gz")

    def test_nifti_slope_and_intercept_apply(self):
        program.write_nifti(
            "scaled.nii",
            ((self.values.astype("f4") + 100) * 4).astype("i2"),
            slope=0.25,
            inter=-100,
        )
        self.alike("scaled.nii", most=0.1, mean=0.005)

    def test_vol_equals_raw(self):
        for version in 2, 3:
            program.write_vol("plain.vol", self.values, version)
            self.same("plain.vol")

    def test_stacks_of_tiff_and_png_equal_raw(self):
        program.write_stack("tiffs", self.values, program.write_tiff, "tif")
        program.write_stack("pngs", self.values, program.write_png, "png")
        self.same("tiffs")
        self.same("pngs")
        self.same("tiffs/slice-%04d.tif")
        self.same("pngs/slice-*.png")

    def test_a_stack_of_dicom_equals_nrrd(self):
        program.write_stack(
            "dicoms",
            self.values.astype("u2"),
            lambda path, image: program.write_dicom(path, image, int(path[-8:-4])),
            "dcm",
        )
        geometry = "space: LPS\nspace directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)"
        program.write_nrrd("words.nrrd", self.values.astype("u2"), geometry=geometry)
        view = look_from((-75, 60, 50))  # in RAS, x and y are negated
        view[view.index("20,18,14")], view[view.index("0.1,0.2,1")] = "-20,-18,14", "-0.1,-0.2,1"
        picture = self.draw("dicoms", view=view)
        self.assertTrue(numpy.array_equal(picture, self.draw("words.nrrd", view=view)))
        self.assertLess(abs(picture - self.plain).mean(), 0.01)  # it is the same view of the data

    def test_wider_types_look_like_raw(self):
        for kind in "f4", "f8", "i4", "u4":
            program.write_nrrd("wide.nrrd", self.values.astype(kind))
            self.alike("wide.nrrd")

    @unittest.skipUnless(pyopenvdb, "python3-openvdb is not installed")
    def test_openvdb_looks_like_nrrd(self):
        values = self.values.copy()  # values beyond the grid are 0, so the border is made 0 too
        values[[0, -1]] = values[:, [0, -1]] = values[:, :, [0, -1]] = 0
        program.write_nrrd("bordered.nrrd", values)
        grid = pyopenvdb.FloatGrid()
        grid.name = "density"
        grid.copyFromArray(numpy.ascontiguousarray(values.transpose(2, 1, 0).astype("f4")))
        pyopenvdb.write("bordered.vdb", grid)
        # `pre` draws splats. `post` would lack cells at the border, because inactive voxels are not
        # part of the grid.
        view = *VIEW, "--classify", "pre"
        drawn = [self.draw(f"bordered.{kind}", view=view) for kind in ("vdb", "nrrd")]
        difference = abs(drawn[0] - drawn[1])
        self.assertLess(difference.max(), 0.02)
        self.assertLess(difference.mean(), 1 / 5000)

    def test_unusual_file_names_work(self):
        for name in (
            "with space.raw",
            "new\nline.raw",
            "-dash.raw",
            "ünïcödé.raw",
            "per%cent%s.raw",
            "a.b.c",
            "[x]*?.raw",
        ):
            program.write_raw(name, self.values)
            source = "./" + name if name.startswith("-") else name
            output = source.replace(".raw", "") + ".trip"
            self.works("brick", source, *self.raw[1:], "-q", "--tf", "a.tf", "-o", output)
            self.works("render", output, "-o", source + ".exr", *VIEW)
            self.assertTrue(numpy.array_equal(program.read_exr(source + ".exr"), self.plain), name)


class World(program.ProgramTest):
    """Tests of spacing, rotation and shear."""

    def silhouette(self, *view):
        """Returns the width and height of the region with opacity above 0.5."""
        picture = self.picture("a.trip", "--no-shading", *view)
        rows, columns = numpy.nonzero(picture[..., 3] > 0.5)
        return numpy.ptp(columns) + 1, numpy.ptp(rows) + 1

    def test_a_ball_is_round_for_every_spacing(self):
        for spacing in (1, 1, 1), (1, 1, 2.5), (3, 1, 1), (0.02, 0.05, 0.03):
            shape = [round(64 * min(spacing) / s) + 8 for s in spacing[::-1]]
            program.write_nrrd("ball.nrrd", program.ball(shape, spacing), spacing)
            self.brick("ball.nrrd", "a.trip")
            middle = [(n - 1) / 2 * s for n, s in zip(shape[::-1], spacing)]
            for direction in (5, -3, 2), (0.1, 0.2, 6), (6, 1, 0.5):
                eye = [m + 40 * min(spacing) * d for m, d in zip(middle, direction)]
                across, down = self.silhouette(
                    "--size",
                    "200x200",
                    "--look",
                    ",".join(map(str, middle)),
                    "--eye",
                    ",".join(map(str, eye)),
                    "--up",
                    "0,1,0.3",
                    "--fov",
                    "20",
                )
                self.assertGreater(across, 30)
                self.assertLess(abs(across - down), 0.1 * across, (spacing, direction))

    def test_given_spacing_equals_spacing_in_the_file(self):
        values = program.noise((20, 24, 28))
        program.write_nrrd("file.nrrd", values, (1, 2, 3))
        program.write_raw("plain.raw", values)
        self.brick("file.nrrd", "a.trip", "--keep-all")
        self.brick("plain.raw", "b.trip", "--keep-all", "--size", "28,24,20", "--spacing", "1,2,3")
        view = "--size", "64x64", "--renderer", "reference", "--up", "0,0,1"
        a, b = self.picture("a.trip", *view), self.picture("b.trip", *view)
        self.assertTrue(numpy.array_equal(a, b))

    def turned(self, values, affine, view):
        program.write_nifti("turned.nii", values, affine)
        self.brick("turned.nii", "a.trip", "--keep-all")
        return self.picture("a.trip", *view)

    def test_an_affine_map_places_the_voxels(self):
        """Stores the same voxels at the same positions in world space along other axes."""
        values = program.noise((20, 24, 28))
        view = [
            "--size",
            "90x90",
            "--renderer",
            "reference",
            "--eye",
            "60,-50,45",
            "--look",
            "14,12,10",
            "--up",
            "0,0,1",
        ]
        plain = self.turned(values, numpy.eye(4), view)
        self.assertGreater(plain[..., 3].max(), 0.5)
        # i along -y, j along z, k along x
        affine = numpy.array([[0, 0, 1, 0], [-1, 0, 0, 23], [0, 1, 0, 0], [0, 0, 0, 1]], float)
        moved = values.transpose(2, 0, 1)[:, :, ::-1]
        turned = self.turned(numpy.ascontiguousarray(moved), affine, view)
        # Only the order of splats within a sheet differs.
        self.assertLess(abs(turned - plain).max(), 0.2)
        self.assertLess(abs(turned - plain).mean(), 0.01)
        self.assertGreater(abs(self.turned(values, affine, view) - plain).mean(), 0.02)

    def test_a_sheared_grid_is_sheared_in_the_picture(self):
        """Bars along k lean by 45 degrees, because each step in k shifts them by one voxel in x."""
        values = numpy.zeros((40, 9, 60), "u1")
        values[:, 3:6, 8:12] = 200
        affine = numpy.eye(4)
        affine[0, 2] = 1
        program.write_nifti("sheared.nii", values, affine)
        self.brick("sheared.nii", "a.trip", "--range=100:255")
        picture = self.picture(
            "a.trip",
            "--size",
            "120x120",
            "--ortho",
            "60",
            "--eye",
            "30,-100,20",
            "--look",
            "30,0,20",
            "--up",
            "0,0,1",
            "--no-shading",
        )
        alpha = picture[..., 3]
        rows, columns = numpy.indices(alpha.shape)
        solid = alpha > 0.2
        slope = numpy.polyfit(rows[solid], columns[solid], 1)[0]
        self.assertAlmostEqual(slope, -1, delta=0.05)

    def test_pictures_are_neither_upside_down_nor_mirrored(self):
        """A body is at one corner of a large volume. In a view along y, high z is up and high x is
        right."""
        values = numpy.full((40, 40, 40), 10, "u1")
        values[30:38, 4:12, 30:38] = 200
        program.write_nrrd("corner.nrrd", values)
        self.brick("corner.nrrd", "a.trip", "--range=100:255")
        view = "--size", "80x80", "--eye", "20,-80,20", "--look", "20,20,20", "--up", "0,0,1"
        alpha = self.picture("a.trip", *view)[..., 3]
        rows, columns = numpy.indices(alpha.shape)
        self.assertLess((rows * alpha).sum() / alpha.sum(), 30)
        self.assertGreater((columns * alpha).sum() / alpha.sum(), 50)


if __name__ == "__main__":
    program.main()
