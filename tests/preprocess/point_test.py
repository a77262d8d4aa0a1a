"""Parts of the tests of the readers of points: reads a file with the program print_points."""
import os
import subprocess
import sys
import tempfile
import unittest

try:
    import numpy as np
except ImportError:
    print("skipped: python3-numpy is not installed")
    sys.exit(77)

PRINT = os.environ["TRIP_PRINT_POINTS"]
ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
NORMAL, RADIUS, COLOUR, INTENSITY, CLASSIFICATION, RETURNS, TIME, SCAN, UNCERTAINTY = (
    1 << i for i in range(9))


class Read:
    """The points of a file, as print_points writes them."""

    def __init__(self, path):
        made = subprocess.run([PRINT, path], capture_output=True)
        self.code = made.returncode
        self.lines = made.stderr.decode().splitlines()
        v = np.frombuffer(made.stdout, dtype="<f8").reshape(-1, 18)
        self.position, self.normal, self.radius, self.colour = v[:, :3], v[:, 3:6], v[:, 6], v[:, 7:10]
        self.intensity, self.scan, self.classification = v[:, 10], v[:, 11], v[:, 12]
        self.return_number, self.returns, self.time = v[:, 13], v[:, 14], v[:, 15]
        self.uncertainty, self.footprint = v[:, 16], v[:, 17]
        if self.code:
            return
        (self.format, points, attributes, left_out, empty, self.extras,
         self.comments) = self.lines.pop().split("|")
        self.points, self.attributes = int(points), int(attributes)
        self.left_out, self.empty = int(left_out), int(empty)
        self.notes = [line[5:] for line in self.lines if line.startswith("note|")]
        self.scans = [[float(x) for x in line.split("|")[1:]] for line in self.lines
                      if line.startswith("scan|")]


class PointTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()

    def tearDown(self):
        self.folder.cleanup()

    def path(self, name, data=None):
        path = os.path.join(self.folder.name, name)
        if data is not None:
            with open(path, "wb") as file:
                file.write(data)
        return path

    def read(self, name, data):
        """Reads a file with these bytes, which must succeed."""
        return self.read_path(self.path(name, data))

    def read_path(self, path):
        made = Read(path)
        self.assertEqual(made.code, 0, made.lines)
        self.assertEqual(made.points, len(made.position))
        return made

    def refused(self, name, data, says):
        """The file must be refused with one line that has a text."""
        made = Read(self.path(name, data))
        self.assertEqual(made.code, 1, (name, made.lines))
        self.assertEqual(len(made.lines), 1, made.lines)
        self.assertIn(says, made.lines[0])
        self.assertTrue(made.lines[0].startswith("triptych: "), made.lines[0])

    def same(self, a, b, error=0.0):
        np.testing.assert_allclose(a, b, rtol=0, atol=error)
