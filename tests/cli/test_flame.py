"""Tests of emission: the heat in an OpenVDB file makes the soot of a flame glow."""
import glob
import json
import os

import numpy

import program

FLAME = os.path.join(program.DATASETS, "densityAndHeat.vdb")
LOOK = ("--tf", "soot.tf", "--size", "40x60", "--no-shading", "--up", "0,0,1", "--background", "none")
HEAT = ("--emission", "heat.trip")
GLOWS = ("--effects", "emission", *HEAT)


class Emission(program.ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        program.write("soot.tf", b"unit voxel\nvalues data\n0 0 0 0 0\n1 0 0 0 0.35\n")
        for grid in ("density", "heat"):
            run = program.call("brick", FLAME, "--grid", grid, "-o", f"{grid}.trip", "-q")
            assert run.returncode == 0, run.stderr

    def draw(self, *options, renderer="cpu"):
        return self.picture("density.trip", *LOOK, "--renderer", renderer, *options)

    @staticmethod
    def bytes_of(path):
        with open(path, "rb") as f:
            return f.read()

    def test_hot_soot_glows_red_to_yellow_below_the_smoke(self):
        cold, flame = self.draw(), self.draw(*GLOWS)
        self.assertEqual(cold[..., :3].max(), 0)
        numpy.testing.assert_array_equal(flame[..., 3], cold[..., 3])
        red, green, blue = (flame[..., k] for k in range(3))
        rounding = 1e-4
        self.assertTrue((red > green - rounding).all() and (green > blue - rounding).all())
        self.assertGreater(red.max(), 0.4)
        rows = red.sum(axis=1)
        self.assertGreater(rows[30:].sum(), 10 * rows[:30].sum())

    def test_hotter_soot_is_bluer(self):
        def share_of_blue(*options):
            flame = self.draw(*GLOWS, *options).sum(axis=(0, 1))
            return flame[2] / flame[0]

        self.assertLess(share_of_blue("--temperature", "0:1800"), share_of_blue())
        self.assertLess(share_of_blue(), share_of_blue("--temperature", "0:9000"))

    def test_emission_runs_only_with_heat_and_costs_nothing_without(self):
        for options, runs in (((*GLOWS,), True), (("--effects", "auto", *HEAT), True),
                              (("--effects", "auto"), False), ((), False)):
            text = self.works("render", "density.trip", "-o", "a.png", *LOOK, "--explain",
                              "--renderer", "cpu", *options).stdout.decode()
            self.assertIn("emission    runs: " if runs else "emission    does not run: ", text)
            self.assertEqual(text.count("\nheat "), 2 if runs else 0, text)
        numpy.testing.assert_array_equal(self.draw("--effects", "auto"), self.draw())

    def test_stats_have_the_bytes_read_of_heat(self):
        """Heat is read once for all frames and then kept."""
        draw = ("render", "density.trip", "-o", "a.png", *LOOK, "--orbit", "2", "--stats", "-")
        whole = sum(os.path.getsize(path) for path in glob.glob("heat.trip/**", recursive=True))
        for renderer in ("cpu", *program.GL):
            frames = json.loads(self.works(*draw, *GLOWS, "--renderer", renderer).stdout)["frames"]
            first, second = (frame["heat_bytes_read"] for frame in frames)
            self.assertEqual(second, 0)
            self.assertTrue(0 < first < whole, (first, whole))
        cold = json.loads(self.works(*draw, "--renderer", "cpu").stdout)["frames"]
        self.assertNotIn("heat_bytes_read", cold[0])

    def test_renderers_agree_with_the_integral(self):
        exact = self.draw(*GLOWS, "--samples", "1", renderer="integral")
        for renderer in ("cpu", "reference", *program.GL):
            off = abs(self.draw(*GLOWS, "--classify", "post", renderer=renderer) - exact)
            self.assertLess(off.max(), 0.02, renderer)

    def test_emission_is_the_same_with_frames_in_flight(self):
        frames = []
        for count in ("1", "2"):
            self.works("render", "density.trip", "-o", "o.png", *LOOK, *GLOWS, "--orbit", "2",
                       "--in-flight", count)
            frames.append([self.bytes_of("o-%03d.png" % i) for i in range(2)])
        self.assertEqual(*frames)

    def test_contradictory_options_are_refused(self):
        draw = ("render", "density.trip", "-o", "bad.png", *LOOK)
        for options, says in (
            (HEAT, "--effects emission"),
            (("--effects", "emission"), "--emission HEAT.trip"),
            (("--effects", "cueing", *HEAT), "--effects emission"),
            (("--temperature", "0:2000"), "requires --emission"),
            ((*GLOWS, "--temperature", "2000:1000"), "smaller first"),
            ((*GLOWS, "--temperature", "-5:1000"), "from 0 to 100000"),
        ):
            self.fails(2, *draw, *options, says=says)
        self.fails(1, *draw, "--effects", "emission", "--emission", "none.trip", says="none.trip")


if __name__ == "__main__":
    program.main()
