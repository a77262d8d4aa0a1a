"""What a scene or view does not call for is not there: no shader is compiled for it, no byte read,
no pass run, no instruction taken. Where all effects are on and none matters the picture is the same."""
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
# By define of the shaders: what calls for it, with --classify post and pre where that is another
# shader. Light is there where nothing is said; "uneven.trip" in the place of options is drawn instead
# of the even grid.
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
    "WIDE": [["--kernel", "cubic"]],
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
        # One voxel of 4096 is hot, and that hardly.
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
        # Linear in the value, and a little less so.
        program.write("line.tf", b"0 .6 .3 .1 0\n255 .6 .3 .1 .1\n")
        program.write("bent.tf", b"0 .6 .3 .1 0\n128 .61 .3 .1 .0502\n255 .6 .3 .1 .1\n")

    def draw(self, *arguments, **options):
        """The picture's bytes and what is said of it."""
        run = self.works("render", "ball.trip", "-o", "a.exr", *SIZE, *arguments, **options)
        with open("a.exr", "rb") as f:
            return f.read(), run.stdout.decode()

    def shaders_without(self, define):
        """A folder of shaders of which none may be compiled with it."""
        shutil.rmtree("shaders", ignore_errors=True)
        shutil.copytree(SHADERS, "shaders")
        for name in os.listdir("shaders"):
            path = os.path.join("shaders", name)
            with open(path, encoding="utf-8") as f:
                text = f.read()
            program.write(path, f"#ifdef {define}\n#error uncalled for\n#endif\n{text}".encode())
        return dict(os.environ, TRIPTYCH_SHADER_DIR=os.path.abspath("shaders"))

    @unittest.skipIf("GL" in program.SWITCHED_OFF, "built without OpenGL")
    def test_no_shader_is_compiled_for_it(self):
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

    def test_no_byte_is_read_and_no_pass_is_run_for_it(self):
        """A measured volume calls for no effect; each that is on reads and runs."""
        for renderer, classify in itertools.product(("cpu", *program.GL), ("pre", "post")):
            options = ["--tf", "solid.tf", "--renderer", renderer, "--explain", "--classify", classify]
            plain, said = self.draw(*options)
            same, auto = self.draw(*options, "--effects", "auto", "--light", "1,1,1")
            self.assertNotRegex(said + auto, "(?m)^light ")
            read = re.compile(r"(?m)^cost .*|million splats, .* read")
            self.assertEqual(read.findall(said), read.findall(auto))
            for on in ["shadows", "--light", "1,1,1"], ["occlusion"], ["cueing"], EFFECTS[4:]:
                on = on if on[0][0] != "-" else ["emission", *on]
                other, said = self.draw(*options, "--effects", *on)
                self.assertNotEqual(other, plain, on)
                self.assertEqual(bool(re.search(r"(?m)^light .* read in ", said)),
                                 on[0] in ("shadows", "occlusion"), on)

    def test_a_function_is_looked_up_only_where_it_is_not_linear(self):
        for renderer in "cpu", "reference", *program.GL:
            for function, closed in ("line.tf", renderer != "reference"), ("bent.tf", False):
                run = self.works("render", "ball.trip", "-o", "a.exr", *SIZE, "--renderer", renderer,
                                 "--tf", function, "--classify", "post", "--stats", "-")
                self.assertEqual(json.loads(run.stdout)["closed_form"], closed, (renderer, function))

    def test_the_kernels_that_draw_are_named(self):
        """Of grids with uneven spacing those of sheets are plain ones, those of splats the processor's."""
        def device(data, *options):
            run = self.works("render", data, "-o", "a.exr", *SIZE, "--renderer", "cpu", *options,
                             "--stats", "-")
            return json.loads(run.stdout)["device"]
        usual = device("ball.trip")
        self.assertEqual(device("uneven.trip", "--classify", "pre"), usual)
        self.assertEqual(device("uneven.trip"), "CPU, plain, 1 thread")
        _, said = self.draw("--renderer", "cpu", "--kernel", "cubic", "--explain")
        self.assertRegex(said, "(?m)^drawn by    cpu: CPU, plain, 1 thread$")

    def test_where_effects_do_not_matter_all_of_them_change_nothing(self):
        """Nothing is dense enough to shade or to glow, and what is far has the colour it fades to."""
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
    def test_what_a_function_comes_to_is_worked_out_once(self):
        found = []
        for frames in 1, 3:
            self.works("--tool=callgrind", "--callgrind-out-file=cost", program.PROGRAM, "render",
                       "ball.trip", "-o", "a.tif", *SIZE, "--renderer", "cpu", "--engine", "pread",
                       "--tf", "line.tf", "--orbit", frames, "--in-flight", 1,
                       program="valgrind")
            found.append(self.costs()[0]["trip_closed_form_find"])
        self.assertEqual(found[0], found[1])

    @unittest.skipIf(os.environ.get("TRIP_SANITIZE"), "a sanitized program does not run in valgrind")
    @unittest.skipUnless(shutil.which("valgrind"), "no valgrind")
    def test_no_instruction_is_taken_for_it(self):
        """Of what draws, exactly; of the whole run little, for the decision."""
        def cost(effects, *look):
            self.works("--tool=callgrind", "--callgrind-out-file=cost", program.PROGRAM, "render",
                       "ball.trip", "-o", "a.tif", *SIZE, "--renderer", "cpu", "--engine", "pread",
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
