"""Tests that regions of a volume, each in its own data set, give the same picture together as the
whole volume."""
import itertools
import os
import resource
import shutil

import numpy

import program

RANGE = (120, 255)
BY_SHEETS = ("--classify", "pre", "--compositing", "sheet")
SIZE = ("--size", "60x50")


def regions(*cuts):
    """Returns all boxes between cuts along i, j and k. A cut is the first index of the next box."""
    sides = [[f"{a}:{b}" for a, b in zip(["", *c], [*c, ""])] for c in cuts]
    return [",".join(box) for box in itertools.product(*sides)]


class Parts(program.ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.volume = program.noise((40, 44, 48))
        program.write_nrrd("v.nrrd", cls.volume)
        cls.make("whole.trip")
        cls.halves = cls.make_parts("half", (21,), (), ())
        cls.octants = cls.make_parts("octant", (16,), (29,), (17,))

    @classmethod
    def make(cls, output, *options, volume="v.nrrd"):
        run = program.call("brick", volume, "-o", output, "-q", "--range", "%d:%d" % RANGE,
                           *options)
        assert run.returncode == 0, run.stderr

    @classmethod
    def make_parts(cls, name, *cuts):
        parts = [f"{name}{n}.trip" for n in range(len(regions(*cuts)))]
        for part, region in zip(parts, regions(*cuts)):
            cls.make(part, "--region", region)
        return parts

    def assert_alike(self, parts, most, *options):
        """Compares pictures of the whole and of the parts. Components differ by at most `most` of
        255."""
        whole = self.picture("whole.trip", *SIZE, *options)
        drawn = self.picture(*parts, *SIZE, *options)
        self.assertGreater(whole[..., 3].max(), 0.5)
        difference = 255 * abs(whole - drawn).max()
        self.assertLessEqual(difference, most, (parts, options))

    def test_a_region_keeps_its_voxels_and_a_halo_beyond_them(self):
        def dilated(flags):
            padded = numpy.pad(flags, 1)
            shifts = itertools.product(range(3), repeat=3)
            n = flags.shape
            return numpy.any(
                [padded[z : z + n[0], y : y + n[1], x : x + n[2]] for z, y, x in shifts], axis=0
            )

        kept = numpy.zeros(self.volume.shape, bool)
        kept[3:17, :, 21:40] = (self.volume >= RANGE[0])[3:17, :, 21:40]
        self.make("part.trip", "--region", "21:40,:,3:17")
        info = self.info("part.trip")
        self.assertEqual(info["kept"], kept.sum())
        self.assertEqual(info["halo"], (dilated(kept) & ~kept).sum())
        self.assertEqual(info["dims"], [48, 44, 40])
        self.assertEqual(info["source"]["source_options"], ["--region=21:40,0:,3:17"])

    def test_interpolated_values_have_no_seam_between_regions(self):
        for renderer in ("reference", "cpu", *program.GL):
            self.assert_alike(self.halves, 0, "--renderer", renderer)
        self.assert_alike(self.octants, 0, "--renderer", "cpu")
        self.assert_alike(self.octants[::-1], 0, "--renderer", "cpu", "--samples-per-sheet", 3)

    def test_seams_do_not_appear_inside_with_light_or_little_memory(self):
        inside = ("--eye", "20.7,19,18", "--look", "40,30,20", "--fov", 100)
        light = ("--effects", "shadows,occlusion", "--light", "1,2,3")
        self.assert_alike(self.octants, 0, "--renderer", "cpu", *inside)
        self.assert_alike(self.octants, 1e-3, "--renderer", "cpu", *light)
        drawn = (*SIZE, "--renderer", "cpu", "--samples-per-sheet", 3, "--samples", 1, "--lod", 0)
        stats = self.stats(*self.octants, *drawn, "--memory", "8M")
        self.assertLessEqual(stats["memory_peak_bytes"], 8 << 20)
        whole = self.picture("whole.trip", *drawn)
        self.assertEqual(abs(program.read_exr("a.exr") - whole).max(), 0)

    def test_sheets_of_splats_are_summed_over_regions(self):
        self.assert_alike(self.octants, 1e-9, *BY_SHEETS, "--renderer", "reference")
        for renderer in ("cpu", *program.GL):
            self.assert_alike(self.octants, 1e-3, *BY_SHEETS, "--renderer", renderer)

    def test_splats_depend_on_the_order_within_a_sheet(self):
        for renderer in ("reference", "cpu", *program.GL):
            self.assert_alike(self.halves, 2, "--classify", "pre", "--renderer", renderer)
        if program.GL:
            self.assert_alike(self.halves, 2, "--submit", "indexed")
            self.assert_alike(self.halves, 2, "--submit", "resident")

    def test_the_integral_equals_the_whole(self):
        self.assert_alike(self.octants, 0, "--renderer", "integral", "--size", "20x16")

    def test_frames_in_flight_have_all_regions(self):
        for data, name in ((["whole.trip"], "w"), (self.halves, "h")):
            self.works("render", *data, "-o", f"{name}.exr", *SIZE, "--orbit", 3,
                       "--renderer", "cpu")
        for n in range(3):
            whole, drawn = (program.read_exr(f"{name}-{n:03}.exr") for name in "wh")
            self.assertEqual(abs(whole - drawn).max(), 0)

    def test_counts_are_sums_over_regions(self):
        counted = [
            self.stats(*data, *SIZE, "--renderer", "cpu", "--count", "--h", 0)["frames"][0]["counted"]
            for data in (["whole.trip"], self.octants)
        ]
        self.assertGreater(counted[0]["x"]["splats_drawn"], 1000)
        self.assertEqual(counted[0], counted[1])

    def test_the_plan_names_all_data_sets_and_levels_are_refused(self):
        text = self.works("render", *self.halves, "-o", "a.exr", *SIZE, "--explain", "--quality",
                          "draft")
        text = text.stdout.decode()
        for half in self.halves:
            self.assertIn(f"data set    {half}\n", text)
        for levels in "--lod=4", "--max-bytes=64M", "--max-ms=5":
            self.leaves_nothing(2, "render", *self.halves, "-o", "x.png", levels, says="--lod")

    def test_mismatched_data_sets_are_refused_by_name(self):
        program.write_nrrd("moved.nrrd", self.volume, geometry="space origin: (1,2,3)\n"
                           "space: left-posterior-superior\n"
                           "space directions: (1,0,0) (0,1,0) (0,0,1)")
        program.write_nrrd("float.nrrd", self.volume.astype("f4") * 2)
        self.make("moved.trip", volume="moved.nrrd")
        self.make("float.trip", volume="float.nrrd")
        self.make("lit.trip", "--normals", "full", "--region", "21:,:,:")
        self.make("compact.trip", "--normals", "compact", "--region", ":21,:,:")
        self.make("tiles.trip", "--tile", 32)
        for other, why in (
            ("moved.trip", "a different grid"),
            ("float.trip", "a different scale of values"),
            ("tiles.trip", "different tiles"),
        ):
            says = f"open: {other}: "
            run = self.leaves_nothing(1, "render", self.halves[0], other, "-o", "x.png", says=says)
            self.assertIn(why, run.stderr)
        run = self.leaves_nothing(1, "render", "compact.trip", "lit.trip", "-o", "x.png",
                                  says="open: lit.trip: ")
        self.assertIn("different normals", run.stderr)
        self.works("render", self.halves[0], "lit.trip", "-o", "x.png", *SIZE)
        self.leaves_nothing(2, "render", self.halves[0], "v.nrrd", "-o", "x.png", says="v.nrrd: ")
        self.leaves_nothing(2, "render", *self.halves, "--error", 1, "-o", "x.png", says="--error")

    def test_two_volumes_on_one_grid_are_refused_with_a_way_out(self):
        """A scan and its segmentation. The values of both have the same codes, and no voxel is kept
        in both, so only their sources tell them apart."""
        for name, at, value in ("scan", 2, 200), ("labels", 40, 2):
            values = numpy.zeros((64, 64, 64), "u1")
            values[at : at + 9, at : at + 9, at : at + 9] = value
            values[-1, -1, -1] = 255
            program.write_nrrd(f"{name}.nrrd", values)
            self.works("brick", f"{name}.nrrd", "-o", f"{name}.trip", "-q", "--range=1:254")
        run = self.leaves_nothing(1, "render", "scan.trip", "labels.trip", "-o", "x.png",
                                  says="labels.trip: is made of another volume (labels.nrrd)")
        self.assertIn("the same --eye, --look and --up", run.stderr)
        run = self.leaves_nothing(2, "render", "scan.nrrd", "labels.nrrd", "-o", "x.png",
                                  says="only one volume")
        self.assertIn("the same --eye, --look and --up", run.stderr)

    def test_regions_that_overlap_are_refused_for_every_classification(self):
        self.make("low.trip", "--region", ":22,:,:")
        self.make("corner.trip", "--region", "20:21,:,:")
        for parts in (
            ["whole.trip", "whole.trip"],
            ["low.trip", self.halves[1]],
            [*self.halves, "corner.trip"],
            [*self.octants, "whole.trip"],
        ):
            for classify in "pre", "post":
                run = self.leaves_nothing(1, "render", *parts, "-o", "x.png", *SIZE, "--classify",
                                          classify, says=f"open: {parts[-1]}: overlaps ")
                self.assertIn("drawn twice", run.stderr)

    def test_many_files_raise_the_soft_limit_of_open_files(self):
        limits = (24, resource.getrlimit(resource.RLIMIT_NOFILE)[1])
        self.works("render", *self.octants, "-o", "a.exr", *SIZE,
                   preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_NOFILE, limits))

    def test_errors_name_the_damaged_data_set(self):
        shutil.rmtree("bad.trip", ignore_errors=True)
        shutil.copytree(self.halves[1], "bad.trip")
        for name in ("index.trip", *(f"{a}0.{kind}" for a in "xyz" for kind in ("voxels", "halo"))):
            path = os.path.join("bad.trip", name)
            with open(path, "r+b") as f:
                good = f.read()
                f.seek(len(good) // 2)
                f.write(bytes([good[len(good) // 2] ^ 1]))
            self.leaves_nothing(1, "render", self.halves[0], "bad.trip", "-o", "x.png", *SIZE,
                                "--view", "iso", "--h", 0, says=path)
            with open(path, "wb") as f:
                f.write(good)

    def test_warnings_name_the_region_that_lacks_values(self):
        self.works("brick", "v.nrrd", "-o", "less.trip", "-q", "--range", "180:255", "--region",
                   "21:,:,:", "--force")
        run = self.works("render", self.halves[0], "less.trip", "-o", "a.exr", *SIZE)
        self.assertIn("less.trip: the transfer function reveals", run.stderr)
        self.assertIn("--region=21:,0:,0:", run.stderr)
        self.assertEqual(run.stderr.count("warning"), 1)

    def test_regions_are_boxes_of_the_grid(self):
        for text in ("1:2,3:4", "1,2,3", "4:4,:,:", ":0,:,:", "-1:3,:,:",
                     ":,:,0.5:2", ":,:,a:", "1:2:3,:,:"):
            self.leaves_nothing(2, "brick", "v.nrrd", "-o", "x.trip", "--region", text,
                                says="--region")
        for text in (":49,:,:", "48:,:,:", ":,:,:41"):
            self.leaves_nothing(2, "brick", "v.nrrd", "-o", "x.trip", "--region", text,
                                says="v.nrrd: the region")


if __name__ == "__main__":
    program.main()
