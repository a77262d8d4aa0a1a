"""Tests that `brick` keeps the voxels that NumPy counts, for every included data set and several
envelopes. The tests read the files with code of their own."""
import gzip
import os
import unittest

import numpy

import program

try:
    import pyopenvdb
except ImportError:
    pyopenvdb = None

TRANSFER_FUNCTION = """# two islands and a step
values data
{0} 1 0 0 0
{1} 1 0 0 0.25
{2} 1 1 0 0
{3} 1 1 0 0
{3} 1 1 1 0.5
{4} 1 1 1 0
"""


def read_tooth():
    path = os.path.join(program.DATASETS, "tooth.raw")
    return numpy.fromfile(path, ">u2")


def read_stent():
    with open(os.path.join(program.DATASETS, "stent.nrrd"), "rb") as f:
        data = f.read()
    return numpy.frombuffer(gzip.decompress(data[data.index(b"\n\n") + 2 :]), "<f4")


def read_grid(path, name):
    """Returns the values of the active voxels. Active tiles count as voxels."""
    grid = pyopenvdb.read(path, name)
    low, high = grid.evalActiveVoxelBoundingBox()
    values, active = numpy.zeros((2, *(h - l + 1 for l, h in zip(low, high))), numpy.float32)
    grid.copyToArray(values, ijk=low)
    grid.mapOn(lambda value: 1.0)
    grid.mapOff(lambda value: 0.0)
    grid.background = 0.0
    grid.copyToArray(active, ijk=low)
    return values[active == 1]


def opacity_positive(points, values):
    """Returns where the piecewise linear function through (value, opacity) is above zero. Values
    beyond the first or last point have its opacity. At a step the later point holds."""
    at = numpy.array([p[0] for p in points], float)
    opacity = numpy.array([p[1] for p in points], float)
    values = values.astype(float)
    above = numpy.searchsorted(at, values, side="right")
    low, high = numpy.clip(above - 1, 0, len(at) - 1), numpy.clip(above, 0, len(at) - 1)
    exactly = at[low] == values
    return numpy.where(
        exactly | (above == 0) | (above == len(at)),
        opacity[low] > 0,
        (opacity[low] > 0) | (opacity[high] > 0),
    )


def parse_points(text):
    lines = [l.split("#")[0].split() for l in text.splitlines()]
    return [(float(l[0]), float(l[4])) for l in lines if len(l) == 5]


class Counts(program.ProgramTest):
    def check(self, source, values, *options):
        values = values.ravel()
        finite = values[numpy.isfinite(values)].astype(numpy.float32)
        low, high = numpy.quantile(finite, [0.3, 0.9])
        middle = (low + high) / 2

        info = self.brick(source, "a.trip", "--keep-all", *options)
        self.assertEqual(info["kept"], finite.size)
        self.assertEqual(info["voxels"], values.size)
        self.assertEqual(numpy.float32(info["value_min"]), finite.min())
        self.assertEqual(numpy.float32(info["value_max"]), finite.max())

        for ranges in (
            [(high, 1e30)],
            [(low, middle), (middle, high)],
            [(middle, middle), (-1e30, low)],
        ):
            wanted = numpy.zeros(finite.size, bool)
            for a, b in ranges:
                wanted |= (finite >= a) & (finite <= b)
            texts = [f"--range={float(a)!r}:{float(b)!r}" for a, b in ranges]
            kept = self.brick(source, "a.trip", *texts, *options)["kept"]
            self.assertEqual(kept, wanted.sum(), texts)

        text = TRANSFER_FUNCTION.format(
            *numpy.quantile(finite.astype(float), [0.2, 0.35, 0.5, 0.75, 0.95])
        )
        with open("a.tf", "w") as f:
            f.write(text)
        wanted = opacity_positive(parse_points(text), finite)
        kept = self.brick(source, "a.trip", "--tf", "a.tf", *options)["kept"]
        self.assertEqual(kept, wanted.sum())

        info = self.brick(source, "a.trip", *options)
        points = parse_points(info["source"]["transfer_function"])
        self.assertEqual(info["kept"], opacity_positive(points, finite).sum())
        self.assertGreater(info["kept"], 0)

    def test_voxels_of_the_tooth_are_counted(self):
        self.check(os.path.join(program.DATASETS, "tooth.nhdr"), read_tooth())

    def test_voxels_of_the_stent_are_counted(self):
        self.check(os.path.join(program.DATASETS, "stent.nrrd"), read_stent())

    @unittest.skipUnless(pyopenvdb, "python3-openvdb is not installed")
    def test_voxels_of_active_tiles_are_counted(self):
        path = os.path.join(program.DATASETS, "wdas_cloud_sixteenth.vdb")
        self.check(path, read_grid(path, "density"))

    @unittest.skipUnless(pyopenvdb, "python3-openvdb is not installed")
    def test_each_of_two_grids_is_counted(self):
        path = os.path.join(program.DATASETS, "densityAndHeat.vdb")
        self.check(path, read_grid(path, "density"), "--grid", "density")
        self.check(path, read_grid(path, "heat"), "--grid", "heat")

    def test_values_that_are_not_finite_are_not_kept(self):
        values = program.noise((20, 30, 40), "f4")
        values[3:5], values[7, 8], values[9, 10, 11] = numpy.nan, numpy.inf, -numpy.inf
        program.write_nrrd("holes.nrrd", values)
        run = program.call("brick", "holes.nrrd", "-o", "holes.trip", "-q", "--keep-all")
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertIn(f"{(~numpy.isfinite(values)).sum()} values are not finite", run.stderr)
        self.assertEqual(self.info("holes.trip")["kept"], numpy.isfinite(values).sum())

    def test_every_type_keeps_the_same_voxels(self):
        values = program.noise((24, 20, 28), "u1").astype("f8") / 2
        for kind in "u1", "i1", "u2", "i2", "u4", "i4", "f4", "f8":
            typed = values.astype(kind)
            program.write_nrrd("typed.nrrd", typed, endian="big")
            kept = self.brick("typed.nrrd", "a.trip", "--range=40:90")["kept"]
            self.assertEqual(kept, ((typed >= 40) & (typed <= 90)).sum(), kind)

    def test_options_of_storage_do_not_change_the_count(self):
        source = os.path.join(program.DATASETS, "tooth.nhdr")
        wanted = self.brick(source, "a.trip")["kept"]
        for options in (
            ("--tile=16", "--slab-sheets=1"),
            ("--tile=128", "--slab-sheets=64"),
            ("--threads=1",),
            ("--memory=64M", "--threads=2"),
            ("--normals=none", "--halo=0"),
            ("--normals=full",),
            ("--code-bits=8",),
        ):
            self.assertEqual(self.brick(source, "a.trip", *options)["kept"], wanted, options)
            self.works("info", "--verify", "a.trip")


if __name__ == "__main__":
    program.main()
