"""Tests that splats are lit alike by stored normals and by normals computed from values.

`brick` computes stored normals from the volume in double precision, so they are an independent
computation."""
import json
import os

import numpy

import program

SIZE = ("--size", "72x60", "--classify", "pre")
INSIDE = ("--eye", "20,21,19", "--look", "40,24,10", "--fov", "70")


def blobs(shape=(44, 48, 52)):
    """Returns a smooth volume of bytes with surfaces in all directions."""
    z, y, x = numpy.meshgrid(*(numpy.linspace(0, 4 * numpy.pi, n) for n in shape), indexing="ij")
    waves = numpy.sin(x) * numpy.cos(0.7 * y) + numpy.sin(0.9 * z + x / 2)
    return (127 + 60 * waves).round().astype("u1")


class ComputedNormals(program.ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        program.write_nrrd("v.nrrd", blobs())
        cls.make_both("v")

    @classmethod
    def make(cls, name, volume, *options):
        run = program.call("brick", volume, "-o", name, "-q", "--range", "150:255", "--tile=16",
                           *options)
        assert run.returncode == 0, run.stderr

    @classmethod
    def make_both(cls, stem, *options, volume="v.nrrd"):
        cls.make(f"{stem}-stored.trip", volume, "--normals=full", *options)
        cls.make(f"{stem}.trip", volume, "--normals=none", *options)

    def assert_alike(self, stem, *options, most=0.7, mean=0.1):
        stored = self.picture(f"{stem}-stored.trip", *SIZE, *options)
        computed = self.picture(f"{stem}.trip", *SIZE, *options)
        flat = self.picture(f"{stem}.trip", *SIZE, *options, "--no-shading")
        differences = 255 * abs(stored - computed)
        self.assertGreater(255 * abs(stored - flat).mean(), 2, options)  # the light matters
        self.assertLess(differences.max(), most, options)
        self.assertLess(differences.mean(), mean, options)

    def test_data_sets_store_no_normals_by_default(self):
        self.make("default.trip", "v.nrrd")
        self.assertFalse(self.info("default.trip")["normals"])
        self.assertEqual(self.info("default.trip")["normal_bytes"], 0)
        self.assertFalse(os.path.exists("default.trip/x0.normals"))
        self.works("info", "default.trip", "--verify")
        for options, size in (
            (("--normals=stored",), 3),
            (("--normals=full",), 4),
            (("--halo=0",), 3),  # gradients at the border of the kept voxels need the halo
            (("--halo=0", "--normals=none"), 0),
            (("--levels=1", "--levels-for=pre"), 3),
            (("--levels=1", "--levels-for=both"), 0),
        ):
            self.make("a.trip", "v.nrrd", "--force", *options)
            self.assertEqual(self.info("a.trip")["normal_bytes"], size, options)

    def test_the_cache_stores_no_normals_either(self):
        self.works("render", "v.nrrd", "-o", "a.exr", *SIZE)
        for entry in json.loads(self.works("cache", "list", "--json").stdout)["data_sets"]:
            self.assertFalse(self.info(entry["path"])["normals"])

    def test_all_renderers_light_alike(self):
        for renderer in "cpu", "reference", *program.GL:
            if renderer == "gl":
                self.assert_alike("v", "--renderer", "gl", "--submit", "indexed")
                self.assert_alike("v", "--renderer", "gl", "--submit", "resident")
            for view in (), ("--azimuth", 130, "--elevation", 50), INSIDE, ("--ortho", "fit"):
                self.assert_alike("v", "--renderer", renderer, *view)

    def test_the_integral_of_the_splats_is_lit_alike(self):
        integral = "--renderer", "integral", "--field", "splats", "--size", "20x16", "--samples", 1
        stored, computed = (self.picture(f"{stem}.trip", *integral) for stem in ("v-stored", "v"))
        self.assertLess(255 * abs(stored - computed).max(), 0.7)
        flat = self.picture("v.trip", *integral, "--no-shading")
        self.assertGreater(255 * abs(computed - flat).mean(), 2)

    def test_all_kinds_of_splats_are_lit_alike(self):
        for options in (
            ("--compositing", "sheet"),
            ("--kernel", "ewa", "--flatten", 3),
            ("--effects", "shadows", "--light", "1,1,0"),
            ("--clip-box", "voxels:7,9,11,33,40,37"),
            ("--clip-plane", "1,1,0,-40"),
        ):
            self.assert_alike("v", *options)

    def test_bricks_that_are_not_drawn_still_give_their_values(self):
        """The function hides all values but a thin range, so that most bricks are left out."""
        with open("thin.tf", "w", encoding="utf-8") as f:
            f.write("values data\n0 1 1 1 0\n236 1 1 1 0\n237 1 1 1 0.9\n255 1 1 1 0.9\n")
        text = self.works("render", "v.trip", "-o", "a.exr", *SIZE, "--tf", "thin.tf", "--explain")
        self.assertRegex(text.stdout.decode(), r"left out: [1-9]\d* transparent")
        self.assert_alike("v", "--tf", "thin.tf", "--fov", 15, most=1.2)

    def test_memory_and_threads_change_no_bit(self):
        view = "--renderer", "cpu", *SIZE, *INSIDE
        wanted = self.picture("v.trip", *view, "--threads", 1)
        for options in ("--threads", 2), ("--memory", "24M"), ("--occluded", "draw"):
            drawn = self.picture("v.trip", *view, *options)
            self.assertTrue((drawn == wanted).all(), options)

    def test_types_and_grids_are_lit_alike(self):
        values = blobs()
        program.write_nrrd("float.nrrd", values.astype("f4"), spacing=(1, 2, 0.7))
        for axis, count in zip("xyz", values.shape[::-1]):
            positions = numpy.cumsum(1 + numpy.arange(count) % 3)
            numpy.savetxt(f"{axis}.txt", positions, fmt="%d")
        self.make_both("float", volume="float.nrrd")
        self.make_both("uneven", "--coordinates", "x.txt,y.txt,z.txt")

        self.assert_alike("float")
        self.assert_alike("uneven", "--kernel", "ewa")

    def test_coarse_levels_are_lit_by_their_own_values(self):
        """Stored normals of a level are means of fine gradients, so that the bound is wider."""
        self.make_both("levels", "--levels=2", "--levels-for=both")
        self.assert_alike("levels", "--lod", 3, most=40, mean=4)

    def test_regions_are_lit_as_the_whole(self):
        for n, region in enumerate((":,:23,:", ":,23:,:")):
            self.make(f"part{n}.trip", "v.nrrd", "--region", region)
        whole = self.picture("v-stored.trip", *SIZE)
        parts = self.picture("part0.trip", "part1.trip", *SIZE)
        self.assertLess(255 * abs(whole - parts).max(), 0.7)

    def test_the_plan_tells_the_source_of_gradients(self):
        computed, stored = (
            self.works("render", f"{stem}.trip", "-o", "a.exr", *SIZE, "--explain").stdout.decode()
            for stem in ("v", "v-stored"))
        self.assertRegex(computed, r"\ngradients +are differences of the values, computed while "
                         r"reading: [\d.]+ kB more are read")
        self.assertRegex(stored, r"\ngradients +are the stored normals: normal planes are read, ")
        flat = self.works("render", "v.trip", "-o", "a.exr", *SIZE, "--explain", "--no-shading")
        self.assertNotIn(b"gradients", flat.stdout)

    def test_post_draws_the_same_bits_with_and_without_normals(self):
        post = "--size", "72x60", "--classify", "post"
        self.assertTrue((self.picture("v.trip", *post) == self.picture("v-stored.trip", *post)).all())


if __name__ == "__main__":
    program.main()
