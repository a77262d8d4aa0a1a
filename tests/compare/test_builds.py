"""Tests builds.py by comparing the program with itself."""
import json
import os
import subprocess
import sys
import tempfile
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))


class BuildsTest(unittest.TestCase):
    def compare(self, *options):
        """Compares the program with itself on a small body. Returns exit status and JSON."""
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

    def test_bytes_per_splat_exclude_the_halo(self):
        status, rows = self.compare()
        self.assertEqual((status, len(rows)), (0, 2))
        for row in rows:
            self.assertEqual(row["kept"], 7 * 16 * 7)
            self.assertEqual(row["bytes_a_splat"], rows[0]["bytes_a_splat"])
            # Each of the three lists has at least a code and a normal of 3 bytes per splat.
            self.assertGreater(row["bytes_a_splat"], 3)
            for stage in "brick", "frame", "read", "draw":
                self.assertGreater(row[stage], 0)

    def test_pictures_have_the_same_bits_with_and_without_halo(self):
        status, rows = self.compare("--pictures")
        self.assertEqual([row["halo"] for row in rows], ["0", "1", "0", "1"])
        self.assertEqual(status, 0)
        for row in rows:
            self.assertEqual(row["views"], rows[0]["views"])
        self.assertEqual(len(set(rows[0]["views"])), 6)


if __name__ == "__main__":
    unittest.main(verbosity=2)
