"""Tests that measuring a frame does not change it. `render` reports on the frame that it draws, and
a frame of its own gives exact counts. Distances match the geometry and leave the picture
unchanged."""
import json
import os
import re

import numpy

import program

# With one thread, occluded bricks are found in the same order in every run.
VIEW = ["--tf", "solid.tf", "--renderer", "cpu", "--threads", "1", "--size", "256x256", "--fov",
        "60", "--look", "64,64,64", "--eye", "64,-43,64", "--classify", "pre"]
COUNTS = ("splats_projected", "splats_drawn")


def contents(path):
    with open(path, "rb") as f:
        return f.read()


def bytes_read(frame):
    return sum(axis["bytes_read"] for axis in frame["lists"].values())


def splats_read(lists):
    return sum(axis["splats_read"] for axis in lists.values())


class Costs(program.ProgramTest):
    def render(self, *options):
        r = self.works("render", *options, "-o", "r.exr", "--size", "24x24", "--tf", "grey",
                       "--explain", "--stats", "stats.json")
        with open("stats.json", encoding="utf-8") as f:
            stats = json.load(f)
        costs = {name: int(count) for name, count in
                 re.findall(r"(?m)^cost (\w+(?: halo)?) +\S+ \w+ read, (\d+) \w+$",
                            r.stdout.decode())}
        lists = stats["frames"][0]["lists"]
        self.assertEqual(costs, {name: one["splats_read"] for name, one in lists.items()
                                 if one["splats_read"]})
        return stats, costs

    def test_reported_reads_equal_the_records_of_the_lists(self):
        program.write_nrrd("ball.nrrd", program.ball((24, 28, 32)))
        info = self.brick("ball.nrrd", "ball.trip", "--range", "100:")
        self.assertGreater(info["halo"], 0)
        along_y = ["ball.trip", "--renderer", "cpu", "--method", "axis", "--view", "front"]
        stats, costs = self.render(*along_y)
        self.assertEqual(stats["classify"], "post")
        self.assertEqual(costs, {"y": info["kept"], "y halo": info["halo"]})
        stats, costs = self.render(*along_y, "--classify", "pre")
        self.assertEqual((stats["classify"], stats["kernel"]), ("pre", "exact"))
        self.assertEqual(costs, {"y": info["kept"]})
        stats, costs = self.render("ball.trip", "--renderer", "integral")
        self.assertEqual((stats["field"], stats["tolerance"]), ("stored", 1e-3))
        for options, tolerance in (["--samples=1"], 1e-4), (["--tolerance=0.01"], 0.01):
            self.assertEqual(self.render("ball.trip", "--renderer", "integral", *options)[0]["tolerance"],
                             tolerance)
        self.assertFalse({"classify", "kernel", "method", "compositing"} & set(stats))
        self.assertEqual(costs, {"z": info["kept"], "z halo": info["halo"]})

    def test_each_region_reports_its_own_reads(self):
        program.write_nrrd("whole.nrrd", program.ball((24, 28, 32)))
        kept = []
        for name, first, last in ("a", 0, 10), ("b", 10, 24):
            kept.append(self.brick("whole.nrrd", f"{name}.trip", "--keep-all", "--levels", "0",
                                   "--region", f":,:,{first}:{last}")["kept"])
        self.assertNotEqual(*kept)
        for field in "stored", "splats":
            r = self.works("render", "a.trip", "b.trip", "-o", "r.exr", "--size", "8x8", "--tf",
                           "grey", "--explain", "--renderer", "integral", "--field", field)
            read = re.findall(r"(?m)^cost z +\S+ \w+ read, (\d+) ", r.stdout.decode())
            self.assertEqual([int(n) for n in read], kept)


class Levels(program.ProgramTest):
    def test_reads_of_coarse_lists_are_counted(self):
        ramp = numpy.add.outer(numpy.add.outer(numpy.arange(64), numpy.arange(64)),
                               numpy.arange(64)).astype("u1")
        program.write_nrrd("ramp.nrrd", ramp)
        self.works("brick", "ramp.nrrd", "-q", "--keep-all", "--tile", "16", "--levels-for", "both")
        for classify in "pre", "post":
            r = self.works("render", "ramp.trip", "-o", "r.exr", "--size", "32x32", "--renderer",
                           "cpu", "--tf", "grey", "--lod", "8", "--stats", "-", "--classify",
                           classify)
            lists = json.loads(r.stdout)["frames"][0]["lists"]
            coarse = {name: one for name, one in lists.items() if name[1:] and "halo" not in name}
            self.assertGreater(splats_read(coarse), 0, classify)
            self.assertGreater(bytes_read({"lists": coarse}), 0, classify)

    def test_without_coarse_levels_the_finest_is_drawn_with_a_warning(self):
        values = numpy.arange(96 * 64 * 64, dtype="u4").reshape(64, 64, 96).astype("u1")
        program.write_nrrd("v.nrrd", values)
        drawn = ["--size=32x32", "--renderer=cpu", "--tf=grey"]
        for kept, other in ("post", "pre"), ("pre", "post"):
            self.works("brick", "v.nrrd", "-q", "--keep-all", "--tile=16", "--force",
                       f"--levels-for={kept}")
            for classify in kept, other:
                options = [*drawn, f"--classify={classify}"]
                if classify == "post":
                    options += ["--samples=1", "--samples-per-sheet=2"]
                self.works("render", "v.trip", "-o", "finest.exr", "--lod=0", *options)
                r = self.works("render", "v.trip", "-o", "lod.exr", "--lod=8", *options)
                same = contents("lod.exr") == contents("finest.exr")
                self.assertEqual(same, classify == other)
                warned = f"v.trip: has no coarse levels for {classify}, " in r.stderr
                self.assertEqual(warned, classify == other)
        # Drawing a volume makes the coarse levels for the requested classification.
        for classify in "pre", "post":
            options = ["v.nrrd", "--size=32x32", "--renderer=cpu", f"--classify={classify}"]
            self.works("render", *options, "-o", "finest.exr")
            r = self.works("render", *options, "-o", "lod.exr", "--lod=8")
            self.assertNotEqual(contents("lod.exr"), contents("finest.exr"))
            self.assertNotIn("warning", r.stderr)


class Depth(program.ProgramTest):
    """Draws an opaque plate, one voxel thick, from straight ahead and from the side."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        plate = numpy.zeros((16, 16, 16), "u1")
        plate[6] = 200
        program.write_nrrd("plate.nrrd", plate)
        program.write("plate.tf", b"100 1 1 1 0\n150 1 1 1 0.9999\n")
        cls.works(cls(), "brick", "plate.nrrd", "-q", "--tf", "plate.tf")

    def distances(self, renderer, *view):
        arguments = ["--renderer", renderer, "--size", "32x32", "--tf", "plate.tf", *view]
        self.works("render", "plate.trip", "-o", "plain.exr", *arguments)
        self.works("render", "plate.trip", "-o", "p.exr", "--depth", "z.exr", *arguments)
        self.assertEqual(contents("plain.exr"), contents("p.exr"))
        names, z = program.read_exr_channels("z.exr")
        self.assertEqual(names, [b"Z"])
        return z[..., 0]

    def renderers(self):
        return "cpu", "reference", *program.GL

    def test_distances_to_a_plate(self):
        for renderer in self.renderers():
            straight = ["--look=7.5,7.5,6", "--up=0,1,0", "--classify=pre"]
            z = self.distances(renderer, "--eye=7.5,7.5,46", *straight, "--ortho=8")
            self.assertLess(abs(z - 40).max(), 0.01)
            z = self.distances(renderer, "--eye=7.5,7.5,46", *straight, "--fov=8")
            step = numpy.tan(numpy.radians(4)) * (2 * numpy.arange(32) + 1 - 32) / 32
            slope = numpy.sqrt(1 + step[:, None] ** 2 + step[None, :] ** 2)
            self.assertLess(abs(z - 40 * slope).max(), 0.01)
            z = self.distances(renderer, "--eye=7.5,7.5,46", *straight, "--ortho=64")
            self.assertTrue(numpy.isinf(z[0]).all() and numpy.isfinite(z[16, 16]))

    def test_distances_to_interpolated_values(self):
        """Interpolated values between 0 and 200 become visible at 100, half a voxel before the
        plate, and opaque at 150. The distance of a segment is the distance of its middle."""
        for renderer in self.renderers():
            for slices in 1, 4:
                z = self.distances(
                    renderer, "--eye=7.5,7.5,46", "--look=7.5,7.5,6", "--up=0,1,0", "--ortho=8",
                    "--classify=post", f"--samples-per-sheet={slices}",
                )
                self.assertGreater(z.min(), 39.5 - 0.5 / slices, (renderer, slices))
                self.assertLess(z.max(), 39.75 + 0.5 / slices, (renderer, slices))

    def test_distances_of_an_orbit_have_the_numbers_of_its_pictures(self):
        self.works("render", "plate.trip", "-o", "o.png", "--depth=oz.tif", "--orbit=2",
                   "--size=16x16", "--tf", "plate.tf")
        for name in "o-000.png", "o-001.png", "oz-000.tif", "oz-001.tif":
            self.assertTrue(os.path.getsize(name) > 0, name)

    def test_distances_are_refused_where_there_are_none(self):
        for options in (["--renderer=integral"], ["--target=rgba8"]):
            self.fails(2, "render", "plate.trip", "-o", "a.png", "--depth=z.exr", *options,
                       says="--depth")
        self.fails(2, "render", "plate.trip", "-o", "a.png", "--depth=z.png", says=".exr or .tif")


class Measured(program.ProgramTest):
    """Draws a nearly opaque cube of 128 voxels a side from close by, so that much of it is
    occluded."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        program.write_nifti("cube.nii", program.noise((128, 128, 128)))
        with open("solid.tf", "w") as f:
            f.write("# value r g b opacity\n0 0.3 0.5 0.9 0.9\n255 1 0.8 0.4 0.999\n")
        cls.brick(cls(), "cube.nii", "cube.trip", "--keep-all", "--tf", "solid.tf",
                  "--normals=stored")

    def render(self, *arguments):
        """Returns the output, the counts of the summary line without the time, and the bytes of the
        picture."""
        said = self.works("render", "cube.trip", "-o", "a.exr", *VIEW, *arguments).stdout.decode()
        summary = re.search(r"^a\.exr: .*, (.*) million splats, (.*) read, [\d.]+ s$", said, re.M)
        with open("a.exr", "rb") as f:
            return said, summary.groups(), f.read()

    def frame(self, *arguments):
        self.render("--stats", "s.json", *arguments)
        with open("s.json") as f:
            return json.load(f)["frames"][0]

    def test_measuring_changes_neither_reads_nor_the_picture(self):
        _, plain, picture = self.render()
        for measured in (["--stats", "s.json"], ["--explain"], ["--stats", "s.json", "--count"],
                         ["--explain", "--count"]):
            _, summary, same = self.render(*measured)
            self.assertEqual(summary, plain, measured)
            self.assertTrue(same == picture, measured)
        self.assertNotEqual(self.render("--occluded", "draw")[1], plain)

    def test_occluded_bricks_are_not_measured(self):
        frame = self.frame()
        self.assertGreater(frame["bytes_skipped"], 0)
        self.assertEqual(bytes_read(frame), bytes_read(self.frame("--occluded", "skip")))
        self.assertLess(bytes_read(frame), bytes_read(self.frame("--occluded", "draw")))

    def test_figures_that_were_not_counted_are_absent(self):
        frame = self.frame()
        self.assertNotIn("counted", frame)
        for axis in frame["lists"].values():
            for key in COUNTS:
                self.assertNotIn(key, axis)
        said = self.render("--explain")[0]
        self.assertIn("cost y ", said)
        self.assertNotRegex(said, "projected|[0-9] drawn|count ")

    def test_counts_include_occluded_bricks_and_leave_the_frame_alone(self):
        plain, counted, whole = self.frame(), self.frame("--count"), self.frame("--occluded", "draw")
        for axis in counted["lists"].values():  # the timed frame did not count
            for key in COUNTS:
                self.assertNotIn(key, axis)
        for key in "reads", "runs_skipped", "bytes_skipped":
            self.assertEqual(counted[key], plain[key])
        self.assertEqual(bytes_read(counted), bytes_read(plain))
        self.assertEqual(splats_read(counted["counted"]), splats_read(whole["lists"]))
        for axis in counted["counted"].values():
            self.assertLessEqual(axis["splats_drawn"], axis["splats_projected"])
            self.assertLessEqual(axis["splats_projected"], axis["splats_read"])
        said = self.render("--explain", "--count")[0]
        found = re.findall(r"^count \w +(\d+) splats, \d+ projected, \d+ drawn$", said, re.M)
        self.assertEqual(sum(map(int, found)), splats_read(counted["counted"]))

    def test_counting_does_not_change_timed_frames(self):
        """The reader caches bricks for the following frames. The counting pass does not fill this
        cache."""
        def frames(*more):
            stats = self.stats("cube.trip", *VIEW[:8], "--classify", "pre", "--orbit", "3",
                               "--occluded", "draw", *more)
            return stats["frames"]
        plain, counted = frames(), frames("--count")
        for a, b in zip(plain, counted):
            self.assertEqual((a["lists"], a["bytes_cached"]), (b["lists"], b["bytes_cached"]))
            self.assertEqual(splats_read(b["counted"]), splats_read(a["lists"]))

    def test_count_alone_is_refused(self):
        self.fails(2, "render", "cube.trip", "-o", "b.png", "--count", says="--stats or --explain")
        self.fails(2, "render", "cube.trip", "-o", "b.png", "--count", "--explain",
                   "--classify", "post", says="requires --classify pre")

    def test_count_alone_selects_pre(self):
        stats = self.stats("cube.trip", *VIEW[:-2], "--count")
        self.assertEqual(stats["classify"], "pre")
        said = self.works("render", "cube.trip", "-o", "a.exr", *VIEW[:-2], "--explain", "--count")
        self.assertIn("classify    pre", said.stdout.decode())
        self.assertEqual(self.stats("cube.trip", *VIEW[:-2])["classify"], "post")

    def test_splats_and_voxels_have_their_names(self):
        integral = "--renderer=integral"
        for *how, what in (["--classify=pre", "splats"], ["--classify=post", "voxels"],
                           [integral, "voxels"], [integral, "--field=splats", "splats"]):
            run = self.works("render", "cube.trip", "-o", "a.png", "--size=9x9", "--samples=1", *how)
            self.assertIn(f" million {what}, ".encode(), run.stdout)

    def test_compositing_is_in_the_plan_and_the_stats(self):
        stats = self.stats("cube.trip", *VIEW, "--compositing", "sheet")
        self.assertEqual((stats["classify"], stats["compositing"]), ("pre", "sheet"))
        said = self.render("--explain", "--compositing", "sheet")[0]
        self.assertRegex(said, "(?m)^compositing sheet: ")
        for more in ["--classify", "post"], ["--renderer", "integral"]:
            self.fails(2, "render", "cube.trip", "-o", "b.png", "--compositing", "sheet", *more,
                       says="--compositing")

    def test_the_kernel_is_in_the_plan_and_the_stats(self):
        self.assertEqual(self.stats("cube.trip", *VIEW, "--kernel", "ewa")["kernel"], "ewa")
        said = self.render("--explain", "--kernel", "ewa", "--low-pass", "none")[0]
        self.assertRegex(said, "(?m)^kernel      ewa: ")
        self.assertRegex(said, "(?m)^low-pass    does not run")
        self.assertNotIn("flattening", said)


if __name__ == "__main__":
    program.main()
