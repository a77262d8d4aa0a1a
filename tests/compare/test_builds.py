"""builds.py: a program against itself."""
import json
import os
import subprocess
import sys
import tempfile
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))


class BuildsTest(unittest.TestCase):
    def compare(self, *options):
        """Of the program with itself, a ball of 400 or so voxels."""
        program = os.environ["TRIP_PROGRAM"]
        with tempfile.TemporaryDirectory() as folder:
            volume = os.path.join(folder, "v.raw")
            with open(volume, "wb") as file:
                file.write(bytes(200 if 4 < i % 16 < 12 and i // 256 > 8 else 3 * (i % 5)
                                 for i in range(16 ** 3)))
            done = subprocess.run(
                [sys.executable, "-B", os.path.join(HERE, "builds.py"), volume, "--json",
                 "--triptych=" + program, "--triptych=" + program, "--size=40x40", "--repeat=1",
                 "--work=" + folder, "--memory=64M",
                 "--brick=--size=16,16,16 --type=uint8 --range=100:255", *options],
                stdout=subprocess.PIPE, check=False)
        return done.returncode, json.loads(done.stdout)

    def test_bytes_a_splat_are_those_of_the_lists_without_the_halo(self):
        status, rows = self.compare()
        self.assertEqual((status, len(rows)), (0, 2))
        for row in rows:
            self.assertEqual(row["kept"], 7 * 16 * 7)
            self.assertEqual(row["bytes_a_splat"], rows[0]["bytes_a_splat"])
            # Three lists of a code, a mask's bits and a normal at least; then the index.
            self.assertGreater(row["bytes_a_splat"], 3 * (1 + 3))
            for stage in "brick", "frame", "read", "draw":
                self.assertGreater(row[stage], 0)

    def test_every_picture_has_the_same_bits_with_a_halo_and_without(self):
        status, rows = self.compare("--pictures")
        self.assertEqual([row["halo"] for row in rows], ["0", "1", "0", "1"])
        self.assertEqual(status, 0)
        for row in rows:
            self.assertEqual(row["views"], rows[0]["views"])
        self.assertEqual(len(set(rows[0]["views"])), 6)


if __name__ == "__main__":
    unittest.main(verbosity=2)
