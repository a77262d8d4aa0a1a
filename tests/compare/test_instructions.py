"""Tests how instructions.py reads a callgrind file and finds the functions of the program."""
import json
import os
import shutil
import subprocess
import sys
import tempfile
import unittest

import instructions

HERE = os.path.dirname(os.path.abspath(__file__))

# main has 5 instructions of its own and calls sum twice, for 100. sum has 40 of its own and calls
# leaf, for 60.
PROFILE = """\
events: Ir
fn=(1) main
16 2
+1 3
cfn=(2) sum
calls=2 30
* 100

fn=(2)
30 40
cfn=(3) leaf
calls=6 50
+2 60

fn=(3)
50 60
totals: 105
"""


class InstructionsTest(unittest.TestCase):
    def test_the_cost_of_a_function_includes_its_callees(self):
        costs, total = instructions.function_costs(PROFILE.splitlines())
        self.assertEqual(costs, {"main": 105, "sum": 100, "leaf": 60})
        self.assertEqual(total, 105)

    def test_a_stage_is_the_sum_of_its_functions(self):
        costs = dict(trip_cpu_cull=3, stage=10, project=20, trip_cpu_sort_chunk=7,
                     trip_cpu_link_pane_lists=1, pane_begin=2, pane_blend=40, pane_end=8,
                     pane_finish=7, other=2)
        stages = instructions.stage_costs(costs, 100)
        self.assertEqual(stages, {"hiding": 3, "projection": 30, "binning": 8, "blend": 50,
                                  "merge": 7, "rest": 2})

    def test_a_stage_without_functions_is_an_error(self):
        with self.assertRaises(SystemExit):
            instructions.stage_costs(dict(stage=10, trip_cpu_sort_chunk=7, pane_blend=40), 100)

    def count(self, *options):
        with tempfile.TemporaryDirectory() as folder:
            volume, data = os.path.join(folder, "v.raw"), os.path.join(folder, "v.trip")
            with open(volume, "wb") as file:
                file.write(bytes(200 if 4 < i % 16 < 12 else 0 for i in range(16 ** 3)))
            program = os.environ["TRIP_PROGRAM"]
            subprocess.run([program, "brick", volume, "-o", data, "--size=16,16,16", "--type=uint8",
                            "-q"], check=True)
            done = subprocess.run([sys.executable, "-B", os.path.join(HERE, "instructions.py"), data,
                                   "--triptych=" + program, "--isa=plain", "--size=64x64", "--json",
                                   *options], check=True, stdout=subprocess.PIPE)
        return json.loads(done.stdout)

    @unittest.skipIf(os.environ.get("TRIP_SANITIZE"), "a sanitized program does not run in valgrind")
    @unittest.skipUnless(shutil.which("valgrind"), "no valgrind")
    def test_every_stage_of_a_frame_is_counted(self):
        result = self.count()
        self.assertGreater(result["splats"], 1000)
        self.assertGreater(result["pixels"], result["splats"])
        for stage, n in result["instructions"]["plain"].items():
            self.assertGreater(n, result["splats"] if stage != "merge" else 64 * 64, stage)

    @unittest.skipIf(os.environ.get("TRIP_SANITIZE"), "a sanitized program does not run in valgrind")
    @unittest.skipUnless(shutil.which("valgrind"), "no valgrind")
    def test_every_stage_of_a_post_frame_is_counted(self):
        result = self.count("--classify=post")
        self.assertEqual(result["pixels"], 64 * 64)
        self.assertGreater(result["voxels"], 1000)
        for stage, n in result["instructions"]["plain"].items():
            self.assertGreater(n, result["voxels"], stage)


if __name__ == "__main__":
    test = unittest.main(verbosity=2, exit=False).result
    sys.exit(77 if test.wasSuccessful() and test.skipped else not test.wasSuccessful())
