"""Tests that a scene pays only for features that it uses. For an unused feature the program
compiles no shader, reads no byte, runs no pass and executes no instruction. If all effects are on
but have no effect on the scene, the picture stays the same."""
import itertools
import json
import os
import re
import shutil
import sys
import unittest

import numpy

import program

sys.path.insert(0, os.path.join(os.environ["TRIP_SOURCE_DIR"], "tests", "compare"))
import instructions

SHADERS = os.path.join(os.environ["TRIP_SOURCE_DIR"], "shaders")
SIZE = ["--size", "40x40", "--threads", "1"]
UNTRIED = ["--samples-per-sheet", "2", "--samples", "1", "--lod", "0"]  # makes no trial
# For each define of the shaders: options that need it, with --classify post and also with pre if it
# uses another shader. Shading is on by default. "uneven.trip" stands for a data set to draw instead
# of ball.trip.
CALLED_FOR = {
    "SHADED": [[]],
    "PARALLEL": [["--ortho", "20"], ["--ortho", "20", "--classify", "pre"]],
    "DEPTH": [["--depth", "z.exr"], ["--depth", "z.exr", "--classify", "pre"]],
    "CUED": [["--effects", "cueing"], ["--effects", "cueing", "--classify", "pre"]],
    "SHADOWS": [["--effects", "shadows", "--light", "1,1,1"],
                ["--effects", "shadows", "--light", "1,1,1", "--classify", "pre"]],
    "OCCLUSION": [["--effects", "occlusion"], ["--effects", "occlusion", "--classify", "pre"]],
    "EMISSION": [["--effects", "emission", "--emission", "heat.trip"],
                 ["--effects", "emission", "--emission", "heat.trip", "--classify", "pre"]],
    "NEAREST": [["--interpolation", "nearest"]],
    "WIDE": [["--interpolation", "cubic"]],
    "AFFINE": [["--kernel", "ewa", "--classify", "pre"]],
    "UNEVEN": [["uneven.trip"], ["uneven.trip", "--classify", "pre"]],
    "SUMS": [["--compositing", "sheet", "--classify", "pre"]],
    "FLATTENED": [["--flatten", "2", "--kernel", "ewa", "--classify", "pre"]],
    "CLOSED": [["--tf", "solid.tf"]],
}
EFFECTS = ["--effects", "shadows,occlusion,cueing,emission", "--light", "1,1,1", "--emission",
           "heat.trip", "--temperature", "1:100000"]


class Uncalled(program.ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        # One voxel of 4096 has heat.
        heat = numpy.zeros((16, 16, 16), "u1")
        heat[0, 0, 0] = 255
        program.write_nrrd("ball.nrrd", program.ball((16, 16, 16)))
        program.write_nrrd("heat.nrrd", heat)
        for name in "ball", "heat":
            cls.brick(cls(), f"{name}.nrrd", f"{name}.trip", "--keep-all")
        for axis in "xyz":
            program.write(f"{axis}.txt", " ".join(str(i + i % 2 / 2) for i in range(16)).encode())
        cls.brick(cls(), "ball.nrrd", "uneven.trip", "--coordinates", "x.txt,y.txt,z.txt")
        for name, opacity in ("clear", 1e-5), ("solid", 0.5):
            program.write(f"{name}.tf", f"0 .6 .3 .1 {opacity}\n255 .6 .3 .1 {opacity}\n".encode())
        # A transfer function that is linear in the value, and one that is not quite linear.
        program.write("line.tf", b"0 .6 .3 .1 0\n255 .6 .3 .1 .1\n")
        program.write("bent.tf", b"0 .6 .3 .1 0\n128 .61 .3 .1 .0502\n255 .6 .3 .1 .1\n")

    def draw(self, *arguments, **options):
        """Returns the bytes of the picture and the text on standard output."""
        run = self.works("render", "ball.trip", "-o", "a.exr", *SIZE, *arguments, **options)
        with open("a.exr", "rb") as f:
            return f.read(), run.stdout.decode()

    def shaders_without(self, define):
        """Copies the shaders so that any shader compiled with `define` fails. Returns the
        environment that selects the copy."""
        shutil.rmtree("shaders", ignore_errors=True)
        shutil.copytree(SHADERS, "shaders")
        for name in os.listdir("shaders"):
            path = os.path.join("shaders", name)
            with open(path, encoding="utf-8") as f:
                text = f.read()
            program.write(path, f"#ifdef {define}\n#error uncalled for\n#endif\n{text}".encode())
        return dict(os.environ, TRIPTYCH_SHADER_DIR=os.path.abspath("shaders"))

    def test_shaders_are_compiled_only_for_features_in_use(self):
        program.need_gl()
        for define, scenes in CALLED_FOR.items():
            environment = self.shaders_without(define)
            for scene in scenes:
                classify = scene[scene.index("--classify") :] if "--classify" in scene else []
                self.draw("--renderer", "gl", "--no-shading", *classify, env=environment)
                unlit = [] if define == "SHADED" else ["--no-shading"]
                data = scene if define == "UNEVEN" else ["ball.trip", *scene]
                run = program.call("render", *data, "-o", "b.png", *SIZE, "--renderer", "gl", *unlit,
                                   env=environment)
                self.assertIn("uncalled for", run.stderr, (define, scene))

    def test_unused_effects_read_nothing_and_run_no_pass(self):
        """`--effects auto` turns no effect on for a measured volume. Each effect that is on changes
        the picture; shadows and occlusion read data for a light pass."""
        for renderer, classify in itertools.product(("cpu", *program.GL), ("pre", "post")):
            options = ["--tf", "solid.tf", "--renderer", renderer, "--explain", "--classify", classify]
            plain, said = self.draw(*options)
            same, auto = self.draw(*options, "--effects", "auto", "--light", "1,1,1")
            self.assertNotRegex(said + auto, "(?m)^light ")
            read = re.compile(r"(?m)^cost .*|[\d.]+(?: million)? (?:splats|voxels), .* read")
            self.assertEqual(read.findall(said), read.findall(auto))
            self.assertRegex(read.findall(said)[-1], "read$")
            for on in ["shadows", "--light", "1,1,1"], ["occlusion"], ["cueing"], EFFECTS[4:]:
                on = on if on[0][0] != "-" else ["emission", *on]
                other, said = self.draw(*options, "--effects", *on)
                self.assertNotEqual(other, plain, on)
                self.assertEqual(bool(re.search(r"(?m)^light .* read in ", said)),
                                 on[0] in ("shadows", "occlusion"), on)

    def test_only_nonlinear_transfer_functions_are_looked_up(self):
        for renderer in "cpu", "reference", *program.GL:
            for function, closed in ("line.tf", renderer != "reference"), ("bent.tf", False):
                run = self.works("render", "ball.trip", "-o", "a.exr", *SIZE, "--renderer", renderer,
                                 "--tf", function, "--classify", "post", "--stats", "-")
                self.assertEqual(json.loads(run.stdout)["closed_form"], closed, (renderer, function))

    def test_the_output_names_the_kernels(self):
        """For uneven grids, `post` uses plain kernels, and `pre` uses kernels for the processor."""
        def device(data, *options):
            run = self.works("render", data, "-o", "a.exr", *SIZE, "--renderer", "cpu", *options,
                             "--stats", "-")
            return json.loads(run.stdout)["device"]
        usual = device("ball.trip")
        self.assertEqual(device("uneven.trip", "--classify", "pre"), usual)
        self.assertEqual(device("uneven.trip"), "CPU, plain, 1 thread")
        _, said = self.draw("--renderer", "cpu", "--interpolation", "cubic", "--explain")
        self.assertRegex(said, "(?m)^drawn by    cpu: CPU, plain, 1 thread$")

    def test_effects_change_nothing_in_faint_fog(self):
        """The fog is too faint to cast shadows or to glow, and depth cueing fades to its own
        colour."""
        for renderer in "cpu", "reference", *program.GL:
            for classify in "pre", "post":
                options = [*SIZE, "--renderer", renderer, "--classify", classify, "--no-shading",
                           "--tf", "clear.tf", "--background", "0.6,0.3,0.1,0"]
                plain = self.picture("ball.trip", *options)
                forced = self.picture("ball.trip", *options, *EFFECTS)
                self.assertGreater(plain[..., 3].max(), 1e-4)
                self.assertLess(abs(forced - plain).max(), 0.02 * plain[..., 3].max())

    def costs(self):
        with open("cost", encoding="utf-8") as f:
            return instructions.function_costs(f)

    @unittest.skipIf(os.environ.get("TRIP_SANITIZE"), "a sanitized program does not run in valgrind")
    @unittest.skipUnless(shutil.which("valgrind"), "no valgrind")
    def test_the_closed_form_is_computed_once_for_all_frames(self):
        found = []
        for frames in 1, 3:
            self.works("--tool=callgrind", "--callgrind-out-file=cost", program.PROGRAM, "render",
                       "ball.trip", "-o", "a.tif", *SIZE, *UNTRIED, "--renderer", "cpu", "--engine", "pread",
                       "--tf", "line.tf", "--orbit", frames, "--in-flight", 1,
                       program="valgrind")
            found.append(self.costs()[0]["trip_closed_form_find"])
        self.assertEqual(found[0], found[1])

    @unittest.skipIf(os.environ.get("TRIP_SANITIZE"), "a sanitized program does not run in valgrind")
    @unittest.skipUnless(shutil.which("valgrind"), "no valgrind")
    def test_unused_effects_execute_no_instruction(self):
        """The drawing functions execute exactly the same instructions. The decision adds less than
        1 % to the whole run."""
        def cost(effects, *look):
            self.works("--tool=callgrind", "--callgrind-out-file=cost", program.PROGRAM, "render",
                       "ball.trip", "-o", "a.tif", *SIZE, *UNTRIED, "--renderer", "cpu", "--engine", "pread",
                       "--light", "1,1,1", "--effects", effects, *look,
                       program="valgrind", env=dict(os.environ, TRIPTYCH_ISA="plain"))
            costs, total = self.costs()
            drawing = [costs[name] for name in ("sheet_pane", "pane_merge", "sheet_gradients",
                                                "sheet_between", "trip_cpu_store_decode")]
            return drawing, total
        drawing, total = cost("none")
        same, more = cost("auto")
        self.assertEqual(same, drawing)
        self.assertLess(abs(more - total), 0.01 * total)
        looked_up, whole = cost("none", "--tf", "bent.tf")
        closed, less = cost("none", "--tf", "line.tf")
        self.assertLess(closed[0], 0.98 * looked_up[0])
        self.assertEqual(closed[1:], looked_up[1:])
        self.assertLess(less, whole)
        lit, most = cost("occlusion")
        self.assertGreater(lit[0], drawing[0])
        self.assertGreater(most, 1.05 * total)


if __name__ == "__main__":
    program.main()
