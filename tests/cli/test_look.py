"""Tests of transfer functions without a file: presets by name, windows, opacity scales, automatic
transfer functions, and volumes without visible voxels."""
import json
import os
import re
import shutil
import subprocess
import unittest

import numpy

import program

try:
    import pyopenvdb
except ImportError:
    pyopenvdb = None

FRONT = ["--size", "64x64", "--no-shading", "--renderer", "cpu", "--method", "axis"]


def chest(shape=(24, 40, 40)):
    """Returns a volume in Hounsfield units: air, and a body of muscle with lungs and a bone."""
    z, y, x = numpy.indices(shape)
    volume = numpy.full(shape, -1000, "i2")
    body = ((x - 20) / 17) ** 2 + ((y - 20) / 13) ** 2 < 1
    volume[body] = 50
    volume[body & (abs(abs(x - 20) - 8) < 4) & (abs(y - 20) < 6)] = -820
    volume[(abs(x - 20) < 2) & (abs(y - 28) < 2)] = 700
    random = numpy.random.default_rng(1)
    return (volume + random.integers(-12, 13, shape)).astype("i2")


class Look(program.ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        program.write_nrrd("chest.nrrd", chest())
        cls.works(cls(), "brick", "chest.nrrd", "--keep-all", "-q")
        values = program.ball((20, 20, 20), dtype="u1")
        program.write_nrrd("ball.nrrd", values)
        cls.works(cls(), "brick", "ball.nrrd", "--keep-all", "-q")

    def kind(self, path, *options):
        return json.loads(
            self.works("brick", path, "--json", "--force", "-o", "k.trip", *options).stdout
        )["function_kind"]

    def test_lost_precision_is_reported(self):
        """Warnings name fog that is too thin for the format of the layers, and peaks narrower than
        a code."""
        program.write("thin.tf", b"0 1 1 1 0.0001\n")
        program.write("thick.tf", b"0 1 1 1 0.1\n")
        program.write("peak.tf", b"0 1 1 1 0\n100.001 1 1 1 0\n100.0015 1 1 1 1\n100.002 1 1 1 0\n")
        for tf, options, says in (
                ("thin", ["--target", "rgba16f"], "--compositing sheet rounds once per sheet"),
                ("thin", ["--target", "rgba8"], "--compositing sheet"),
                ("thin", ["--target", "rgba8", "--compositing", "sheet"], "--target rgba32f"),
                ("thin", ["--target", "rgba32f"], ""),
                ("thin", ["--classify", "pre", "--opacity-scale", "1e-4"], "layers of rgba32f"),
                ("thin", ["--target", "rgba16f", "--compositing", "sheet"], "--target rgba32f"),
                ("thin", ["--compositing", "sheet", "--opacity-scale", "1e-4"], "reference rounds nothing"),
                ("thin", ["--opacity-scale", "1e-4"], ""),  # by default `post`
                ("thick", ["--target", "rgba16f"], ""),
                ("peak", [], "a peak at 100.0015 that is narrower than")):
            run = self.works("render", "ball.trip", "-o", "lost.exr", "--size", "16x16", "--renderer", "cpu",
                             "--tf", tf + ".tf", "--orbit", "2", *options)
            self.assertEqual(run.stderr.count("warning: ball.trip: "), says != "", run.stderr)
            self.assertIn(says, run.stderr)

    def test_normalised_colours_are_divided_by_their_opacity(self):
        view = ["--size=32x32", "--renderer", "cpu", "--tf", "viridis", "--opacity-scale", "0.2",
                "--samples-per-sheet", "4", "--samples", "1", "--lod", "0"]
        plain = self.picture("ball.trip", *view, "--background", "none").astype(float)
        drawn = self.picture("ball.trip", *view, "--background", "1,0,0", "--normalise")
        covered, free = plain[..., 3] > 0.01, plain[..., 3] == 0
        self.assertTrue(covered.sum() > 100 and free.sum() > 100)
        means = plain[covered][:, :3] / plain[covered][:, 3:]
        self.assertLess(abs(drawn[covered][:, :3] - means).max(), 1e-3)
        self.assertTrue((drawn[..., 3] == 1).all())
        self.assertLess(abs(drawn[free][:, :3] - (1, 0, 0)).max(), 1e-3)

    def test_opacity_scale_multiplies_extinction(self):
        view = ["--eye=9.5,-60,9.5", "--look=9.5,9.5,9.5", "--ortho=24", "--size=32x32"]
        view += ["--renderer", "reference", "--method", "axis", "--tf", "viridis"]
        for classify, terminated in ("pre", 1 / 8192), ("post", 1 / 512), ("post", 1 / 50):
            by = [*view, "--classify", classify, "--early-termination", terminated]
            once = self.picture("ball.trip", *by)[..., 3].astype(float)
            self.assertGreater(once.max(), 0.5)
            for scale in (0.25, 1, 3):
                scaled = self.picture("ball.trip", *by, "--opacity-scale", scale)[..., 3]
                expected = 1 - (1 - once) ** scale
                # The expected opacity of a pixel is unknown after early termination.
                open_still = (1 - once > terminated) & (1 - expected > terminated)
                self.assertGreater(open_still.mean(), 0.4, (classify, scale))
                off = abs(scaled - expected)
                self.assertLess(off[open_still].max(), 2e-4, (classify, scale))

    def test_early_termination_is_checked_and_reported(self):
        pre = ["--classify", "pre"]
        for options, says in (
            (["--early-termination=0.11"], "0.11 is not between 0 and 0.1"),
            (["--early-termination=-0.01"], "-0.01 is not between 0 and 0.1"),
            (["--early-termination=little"], "not a number"),
            (["--early-termination=0.01", "--renderer", "integral"], "does not apply to --renderer integral"),
            (["--early-termination=0.01", "--traversal", "ascending"], "requires --traversal outward"),
            *(([*pre, "--early-termination=0.01", "--renderer", gl], "draws all splats") for gl in program.GL),
        ):
            self.fails(2, "render", "ball.trip", "-o", "a.png", "--size=32x32", *options, says=says)
        for options, saturation in (pre, 1 / 8192), (["--classify", "post"], 1 / 512), (["--early-termination=0.02"], 0.02):
            run = self.works("render", "ball.trip", "-o", "a.png", "--size=32x32", "--renderer", "cpu", "--explain",
                             *options, "--stats", "a.json")
            os.unlink("a.png")
            self.assertIn(f"below {saturation:g} of transmittance".encode(), run.stdout)
            with open("a.json") as f:
                self.assertEqual(json.load(f)["early_termination"], saturation)
            os.unlink("a.json")


    def test_the_old_names_of_two_options_draw_the_same(self):
        view = ["render", "ball.trip", "--size", "40x40", "--renderer", "cpu", "--classify", "post"]
        self.works(*view, "-o", "new.exr", "--samples-per-sheet=3", "--early-termination=0.05")
        self.works(*view, "-o", "old.exr", "--slices=3", "--saturation=0.05")
        self.works(*view, "-o", "default.exr")
        new, old, default = map(program.read_exr, ("new.exr", "old.exr", "default.exr"))
        self.assertTrue((new == old).all())
        self.assertFalse((new == default).all())
    def test_a_window_moves_the_transfer_function(self):
        shape = [(0, 0.1, 0.2, 0.9, 0), (0.5, 0.2, 0.9, 0.3, 0.1), (1, 1, 0.5, 0.1, 0.6)]

        def write(path, scale, offset, head=""):
            lines = [f"{v * scale + offset} {r} {g} {b} {o}\n" for v, r, g, b, o in shape]
            program.write(path, (head + "".join(lines)).encode())

        write("plain.tf", 50, 30)
        write("normalised.tf", 1, 0, "values normalised\n")
        write("moved.tf", 80, 60)
        moved = self.picture("ball.trip", *FRONT, "--tf", "moved.tf")
        for name in ("plain.tf", "normalised.tf"):
            windowed = self.picture(
                "ball.trip", *FRONT, "--tf", name, "--window=80", "--level=100"
            )
            self.assertLess(abs(windowed - moved).max(), 1e-5)
        self.assertGreater(abs(moved - self.picture("ball.trip", *FRONT)).max(), 0.1)

    def test_window_requires_level(self):
        for option in ("--window=5", "--level=5"):
            self.fails(2, "render", "ball.trip", "-o", "a.png", option, says="together")

    def test_a_bare_name_is_a_preset_and_a_path_is_a_file(self):
        program.write("bone", b"0 0 1 0 1\n")
        by_name = self.picture("ball.trip", *FRONT, "--tf", "bone")
        self.assertTrue((by_name == self.picture("ball.trip", *FRONT, "--tf", "preset:bone")).all())
        green = self.picture("ball.trip", *FRONT, "--tf", "./bone")
        self.assertGreater(green[32, 32, 1], 0.9)
        self.assertEqual(green[..., 0].max(), 0)
        self.assertGreater(by_name[32, 32, 0], 0.3)
        os.unlink("bone")

    def test_a_mistyped_name_suggests_a_preset(self):
        for slip, preset in (("bnoe", "bone"), ("bone.tf", "bone"), ("ct-bones", "ct-bone")):
            self.fails(
                1, "render", "ball.trip", "-o", "a.png", "--tf", slip, says=f"preset:{preset}?"
            )
            self.fails(1, "brick", "ball.nrrd", "-o", "b.trip", "--tf", slip, says=f"{preset}?")

    def test_every_preset_in_the_help_draws(self):
        page = self.works("render", "--help=all").stdout.decode()
        names = [
            *("auto", "ct", "mr", "fog", "labels", "simulation", "ct-bone", "ct-soft", "ct-lung"),
            *("ct-skin", "grey", "bone", "hot-metal", "viridis", "vessels", "xray"),
        ]
        for name in names:
            self.assertRegex(page, rf"\b{name}\b")
            self.works("render", "chest.trip", "-o", "a.png", "--size=20x20", "--tf", name)

    def test_presets_for_ct_warn_of_other_values(self):
        run = self.works("render", "ball.trip", "-o", "a.png", "--size=20x20", "--tf", "ct-bone")
        self.assertRegex(run.stderr, r"warning: ball.trip: the values from 0 to 200 do not look like the Houns")
        run = self.works("render", "chest.trip", "-o", "a.png", "--size=20x20", "--tf", "ct-bone")
        self.assertEqual(run.stderr, "")

    def test_a_volume_gets_each_warning_once(self):
        for _ in "bricked", "found":
            run = self.works("render", "ball.nrrd", "-o", "a.png", "--size=20x20", "--tf", "ct-bone")
            self.assertEqual(run.stderr.count("do not look like the Hounsfield units"), 1)

    def test_a_transparent_transfer_function_is_reported(self):
        program.write("nothing.tf", b"300 1 1 1 0\n400 1 1 1 1\n")
        run = self.works("render", "ball.trip", "-o", "a.png", "--size=20x20", "--tf=nothing.tf")
        self.assertIn("no value from 0 to 200 is visible", run.stderr)

    def test_an_empty_picture_is_reported(self):
        ground = ("--size=20x20", "--background=0.5,0.2,0.1,0.5", "-o", "a.png")
        why = "check the view, the clipping and the transfer function"
        for options in (
            ["--clip-box=1e4,1e4,1e4,2e4,2e4,2e4"],
            ["--eye=500,500,500", "--look=900,900,900"],
            ["--eye=500,500,500", "--look=900,900,900", "--renderer=integral"],
            ["--eye=500,500,500", "--look=900,900,900", "--renderer=reference", "--classify=pre"],
        ):
            run = self.works("render", "ball.trip", *ground, *options)
            self.assertEqual(run.stderr.count("\n"), 1, run.stderr)
            self.assertIn(f"warning: a.png: the picture is empty: {why}", run.stderr)
        self.assertEqual(self.works("render", "ball.trip", *ground).stderr, "")
        away = dict(triptych_path=1, frames_per_second=1, keys=[
            dict(seconds=s, eye=[9.5, -90, 9.5], look=look, up=[0, 0, 1], fov=30)
            for s, look in ((0, [9.5, 9.5, 9.5]), (1, [900, -90.5, 9.5]))])
        program.write("away.json", json.dumps(away).encode())
        run = self.works("render", "ball.trip", *ground, "--path=away.json")
        self.assertIn(f"warning: a.png: 1 of 2 pictures are empty: {why}", run.stderr)

    def test_kinds_of_volumes_are_recognised(self):
        self.assertEqual(self.kind("chest.nrrd"), "ct")
        self.assertEqual(self.kind("ball.nrrd"), "simulation")
        parts = numpy.zeros((16, 16, 16), "u2")
        parts[4:12, 4:12, 4:12] = numpy.indices((8, 8, 8)).sum(0) // 4 * 3 + 5
        program.write_nrrd("parts.nrrd", parts)
        self.assertEqual(self.kind("parts.nrrd"), "labels")
        random = numpy.random.default_rng(2)
        head = abs(random.normal(0, 12, (32, 32, 32)))
        head[8:24, 6:26, 6:26] = random.normal(500, 120, (16, 20, 20))
        program.write_nifti("head.nii", numpy.clip(head, 0, 1500).astype("u2"))
        self.assertEqual(self.kind("head.nii"), "mr")
        self.assertEqual(
            self.kind(os.path.join(program.DATASETS, "wdas_cloud_sixteenth.vdb")), "fog"
        )
        self.assertEqual(self.kind(os.path.join(program.DATASETS, "tooth.nhdr")), "simulation")

    def test_auto_is_the_same_for_drawing_and_bricking(self):
        for name in ("chest.nrrd", "ball.nrrd"):
            self.works("brick", name, "-q", "--force", "-o", "auto.trip")
            kept = self.picture("auto.trip", *FRONT)
            self.assertGreater(kept[..., 3].max(), 0.3)
            self.assertTrue((kept == self.picture("auto.trip", *FRONT, "--tf", "auto")).all())
            self.works("brick", name, "-q", "--force", "-o", "given.trip", "--tf", "auto")
            self.assertTrue((kept == self.picture("given.trip", *FRONT)).all())

    def test_one_value_is_fog_of_moderate_depth(self):
        for value in (0, 7):
            program.write_nrrd("even.nrrd", numpy.full((32, 32, 32), value, "u1"))
            run = self.works("brick", "even.nrrd", "-q", "--force")
            self.assertIn(f"every voxel has the value {value}", run.stderr)
            alpha = self.picture("even.trip", *FRONT)[..., 3]
            # The optical depth through the cube is 1.2. Oblique rays are up to sqrt(3) times as
            # long.
            self.assertGreater(alpha[32, 32], 1 - numpy.exp(-1.1))
            self.assertLess(alpha.max(), 1 - numpy.exp(-1.2 * 3**0.5))

    @unittest.skipUnless(pyopenvdb, "no pyopenvdb")
    def test_a_sparse_grid_of_one_value_is_fog_of_moderate_depth(self):
        grid = pyopenvdb.FloatGrid()
        z, y, x = numpy.indices((33, 33, 33)) - 16
        inside = x * x + y * y + z * z < 15**2
        grid.copyFromArray(numpy.where(inside, 3, 0).astype("f4"))
        grid.name, grid.gridClass = "density", pyopenvdb.GridClass.FOG_VOLUME
        pyopenvdb.write("even.vdb", grids=[grid])
        self.works("brick", "even.vdb", "-q", "--force", "-o", "even_vdb.trip")
        alpha = self.picture("even_vdb.trip", *FRONT)[..., 3]
        # The diameter of the ball is 1.24 times the edge of a cube with as many voxels.
        self.assertGreater(alpha[32, 32], 0.5)
        self.assertLess(alpha.max(), 1 - numpy.exp(-1.2 * 1.24 * 1.1))

    def test_a_binary_solid_stays_solid(self):
        solid = numpy.zeros((32, 32, 32), "u1")
        solid[8:24, 8:24, 8:24] = 128
        program.write_nrrd("solid.nrrd", solid)
        self.works("brick", "solid.nrrd", "-q", "--force")
        self.assertGreater(self.picture("solid.trip", *FRONT)[32, 32, 3], 0.99)

    def test_the_printed_brick_command_works(self):
        name = "it's a ball; $x.raw"
        program.write_raw(name, program.ball((20, 20, 20)))
        brick = ["--size=20,20,20", "--spacing=1,1,2", "-q", "-o", "again.trip", "--force"]
        program.write("low.tf", b"10 1 1 1 0\n20 1 1 1 0.5\n200 1 1 1 0.5\n")
        views = [["--tf", "low.tf"], ["--window=100", "--level=60"]]
        for view in views:
            self.works("brick", name, "--range=150:255", *brick)
            run = self.works("render", "again.trip", "-o", "a.png", "--size=20x20", *view)
            command = re.search(r"to keep them: triptych (brick .*)\n", run.stderr)
            self.assertTrue(command, run.stderr)
            subprocess.run(
                f"'{program.PROGRAM}' {command[1]} -q", shell=True, check=True, stderr=subprocess.PIPE
            )
            run = self.works("render", "again.trip", "-o", "a.png", "--size=20x20", *view)
            self.assertEqual(run.stderr, "")
            self.assertEqual(self.info("again.trip")["spacing"], [1, 1, 2])

    def again(self, source, *options):
        """Runs the printed command. Returns the output of `info` for the data set before and
        after."""
        before = self.brick(source, "again.trip", "--range=150:255", *options)
        run = self.works("render", "again.trip", "-o", "a.png", "--size=20x20", "--tf", "low.tf")
        command = re.search(r"to keep them: triptych (brick .*)\n", run.stderr)
        self.assertTrue(command, run.stderr)
        shutil.rmtree("again.trip")
        subprocess.run(
            f"'{program.PROGRAM}' {command[1]} -q", shell=True, check=True, stderr=subprocess.PIPE
        )
        return before, self.info("again.trip")

    def test_the_printed_brick_command_has_all_options(self):
        program.write("low.tf", b"10 1 1 1 0\n20 1 1 1 0.5\n200 1 1 1 0.5\n")
        program.write_nrrd("ball.nrrd", program.ball((20, 20, 20)))
        options = "--normals=none", "--tile=16", "--slab-sheets=3"
        before, after = self.again("ball.nrrd", *options)
        for key, value in ("tile_voxels", 16), ("slab_sheets", 3), ("normals", False):
            self.assertEqual((before[key], after[key]), (value, value), key)
        for z, image in enumerate(program.ball((20, 20, 20))):
            program.write_tiff(f"s{z + (z > 9)}.tif", image)
        before, after = self.again("s%d.tif", "--allow-gaps")
        self.assertEqual(before["dims"], after["dims"])


if __name__ == "__main__":
    program.main()
