"""Compares the deviations of coarse levels with the voxels of the volume itself, for a real scan of
which most voxels are dropped and whose sizes are no powers of two."""
import os
import subprocess
import sys

import numpy
import program

READER = os.path.join(os.environ["TRIP_SOURCE_DIR"], "tests", "stream", "plain_reader.py")
SIZE = (103, 94, 161)  # of the tooth, along i, j, k


def read_lists(path):
    """Returns an array of the records of each list, by name."""
    run = subprocess.run([sys.executable, READER, path], stdout=subprocess.PIPE, text=True)
    if run.returncode == program.SKIPPED:
        sys.exit(program.SKIPPED)
    assert run.returncode == 0
    lists = {}
    for line in run.stdout.splitlines():
        name, rest = line.split(" ", 1)
        lists.setdefault(name, []).append(rest)
    return {name: numpy.array([r.split() for r in rows], float) for name, rows in lists.items()}


def deviation_code(variance):
    return 255 * numpy.sqrt(numpy.sqrt(numpy.maximum(variance, 0)) / 32767.5)


class Level:
    """The cubes of a level, from the known voxels of the volume. Arrays have a border of one cube
    that holds nothing."""

    def __init__(self, level, values, known):
        edge = 2**level
        shape = [-(-n // edge) for n in values.shape]
        padded = [(0, s * edge - n) for s, n in zip(shape, values.shape)]
        cubes = tuple(n for s in shape for n in (s, edge))
        parts = lambda a: numpy.pad(a, padded).reshape(cubes).sum((1, 3, 5))
        self.count = parts(known.astype(float))
        some = numpy.maximum(self.count, 1)
        mean = parts(numpy.where(known, values, 0)) / some
        self.variance = parts(numpy.where(known, values * values, 0)) / some - mean * mean
        self.mean = numpy.pad(mean, 1)
        self.there = numpy.pad(self.count > 0, 1)
        self.part = (1 - 4.0**-level) / 24

    def shown(self, listed):
        """Returns the part of the variance that interpolation shows, and a bound of its error if
        means are rounded. A cube with a neighbour that is listed, but covers no known voxel, is
        NaN, since only `brick` knows the value of this neighbour."""
        shown, rounded = numpy.zeros((2, *self.count.shape))
        own = self.mean[1:-1, 1:-1, 1:-1]
        for axis in range(3):
            for first in 0, 2:
                at = [slice(1, -1)] * 3
                at[axis] = slice(first, first + self.count.shape[axis])
                at = tuple(at)
                by = numpy.where(self.there[at], own - self.mean[at], 0)
                by[listed[at] & ~self.there[at]] = numpy.nan
                shown += by * by * self.part
                rounded += (4 * abs(by) + 4) * self.part
        return shown, rounded


class Deviations(program.ProgramTest):
    def check_list(self, records, level):
        listed = numpy.zeros([n + 2 for n in level.count.shape], bool)
        at = tuple(records[:, :3].astype(int).T[::-1])  # the arrays are by k, j, i
        listed[tuple(a + 1 for a in at)] = True
        self.assertFalse((level.there & ~listed).any())
        shown, rounded = (a[at] for a in level.shown(listed))
        variance, count = level.variance[at], level.count[at]
        rounded += 4 * numpy.sqrt(numpy.maximum(variance, 0)) + 4 + 1e-4 * variance
        code = numpy.rint(255 * numpy.sqrt(records[:, 4] / 32767.5))
        self.assertTrue((code[count == 0] == 0).all())
        sure = (count > 0) & ~numpy.isnan(shown)
        self.assertGreater(sure.sum(), count.size / 4)
        low = deviation_code(variance - shown - rounded)[sure] - 0.5
        high = deviation_code(variance - shown + rounded)[sure] + 0.5
        self.assertTrue(((code[sure] >= low) & (code[sure] <= high)).all())
        self.assertGreater((high - low < 3).mean(), 0.25)
        return (count == 0).sum()

    def test_deviations_are_those_of_the_volume(self):
        tooth = os.path.join(program.DATASETS, "tooth.nhdr")
        self.works("brick", tooth, "-o", "tooth.trip", "-q", "--levels=3")
        values = numpy.fromfile(tooth.replace(".nhdr", ".raw"), ">u2").reshape(SIZE[::-1])
        values = values.astype(float)
        lists = read_lists("tooth.trip")
        known = numpy.zeros(values.shape, bool)
        for name in "z", "z0.halo":
            at = tuple(lists[name][:, :3].astype(int).T[::-1])
            self.assertTrue((values[at] == lists[name][:, 3]).all())  # codes are values
            known[at] = True
        self.assertLess(known.mean(), 0.5)
        added = 0
        for number in 1, 2, 3:
            level = Level(number, values, known)
            rows = [sorted(map(tuple, lists[f"{axis}{number}.values"])) for axis in "xyz"]
            self.assertTrue(rows[0] == rows[1] == rows[2])
            added += self.check_list(lists[f"z{number}.values"], level)
        self.assertGreater(added, 0)

    def test_info_tells_the_bytes(self):
        self.works("brick", os.path.join(program.DATASETS, "tooth.nhdr"), "-o", "b.trip", "-q")
        for entry in self.info("b.trip")["lists"]:
            name = f"b.trip/{entry['axis']}{entry['level']}.deviations"
            size = os.path.getsize(name) if entry["kind"] == "values" else 0
            self.assertEqual(entry["deviation_bytes"], size)
            self.assertEqual(size > 0, entry["level"] > 0)

    def test_codes_of_knots_deviate_from_their_mean(self):
        """All cubes of level 1 hold the same eight values, so that interpolation shows nothing."""
        values = numpy.array([0.001, 0.002, 0.01, 0.05, 2, 2.5, 300, 9e4], "f4")
        cubes = numpy.tile(values.reshape(2, 2, 2), (16, 12, 9))
        program.write_nrrd("knots.nrrd", cubes)
        self.works("brick", "knots.nrrd", "-o", "knots.trip", "-q", "--keep-all", "--levels=2")
        info = self.info("knots.trip")
        self.assertLess(info["code_step_min"], info["code_step_max"])
        lists = read_lists("knots.trip")
        codes = lists["z"][:, 3]
        self.assertEqual(len(codes), cubes.size)
        self.assertEqual(len(set(codes)), 8)
        for name in "x1.values", "y1.values", "z2.values":
            deviations = lists[name][:, 4]
            self.assertEqual(len(set(deviations)), 1)
            code = deviation_code(codes.var())
            self.assertAlmostEqual(255 * (deviations[0] / 32767.5) ** 0.5, code, delta=0.51)


if __name__ == "__main__":
    program.main()
