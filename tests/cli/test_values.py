"""Tests that `brick` keeps values whatever lies outside of most of them: one hot voxel, fill values,
many decades, ids of 32 and 64 bits. NumPy makes the volumes. plain_reader.py reads the codes."""
import json
import os
import struct
import subprocess
import sys
import unittest

import numpy

import program

READER = os.path.join(os.environ["TRIP_SOURCE_DIR"], "tests", "stream", "plain_reader.py")
EDGE = 40


def grid():
    """Returns the coordinates of the voxels of a cube, from -1 to 1."""
    return numpy.moveaxis(numpy.indices((EDGE, EDGE, EDGE)), 0, -1) / ((EDGE - 1) / 2) - 1


def ball():
    """A soft ball of 0 to 800 in noise of 20 +- 5."""
    random = numpy.random.default_rng(1)
    radius = numpy.linalg.norm(grid(), axis=-1)
    noise = random.normal(20, 5, radius.shape)
    return (noise + 770 * numpy.clip(1.2 - 2 * radius, 0, 1)).astype("f4")


def hot_ball(value):
    volume = ball()
    volume[4, 4, 4] = value
    return volume


def fields():
    """Yields names and fields that even codes cannot hold."""
    random = numpy.random.default_rng(2)
    shape = (EDGE, EDGE, EDGE)
    radius = numpy.linalg.norm(grid(), axis=-1)
    yield "hot voxel", hot_ball(1e6)
    yield "1e20", hot_ball(3e20)
    yield "exponential", numpy.exp(12 * (1 - radius)).astype("f4")
    yield "decades", numpy.exp(60 * (1 - radius)).astype("f4")
    yield "lognormal", random.lognormal(0, 3, shape).astype("f4")
    cluster = random.normal(1e6, 1, shape).astype("f4")
    cluster[1, 2, 3:6] = -1e9, 0, 5e8
    yield "cluster", cluster
    signed = 10 ** random.uniform(-5, 5, shape) * random.choice((-1, 1), shape)
    yield "signed decades", signed.astype("f4")


def read_table(path):
    """Returns the value of each code of a data set, as FORMAT.md describes them."""
    with open(os.path.join(path, "index.trip"), "rb") as f:
        index = f.read()
    lo, hi = struct.unpack_from("<2d", index, 168)
    offset, entries, step = struct.unpack_from("<QII", index, 328)
    codes = numpy.arange(65536)
    if not offset:
        return lo + (hi - lo) * codes / 65535
    table = numpy.frombuffer(index, "<f8", entries, offset)
    return numpy.interp(codes / 2**step, numpy.arange(entries), table)


def read_codes(path):
    """Returns the codes of the kept voxels by position (i, j, k)."""
    out = subprocess.run([sys.executable, READER, path], capture_output=True, check=True).stdout
    codes = {}
    for line in out.decode().splitlines():
        words = line.split()
        if words[0] == "x":
            codes[tuple(map(int, words[1:4]))] = int(words[4])
    return codes


class Values(program.ProgramTest):
    def test_any_hundredth_of_the_values_has_64_codes(self):
        for name, volume in fields():
            with self.subTest(name):
                program.write_nrrd("v.nrrd", volume)
                info = self.brick("v.nrrd", "v.trip", "--keep-all", "--fill", "none",
                                  "--normals", "none", "--levels", "0")
                self.assertEqual(info["kept"], volume.size)
                self.assertEqual(info["codes"], "knots")
                self.assertEqual(info["value_max"], volume.max())
                self.works("info", "--verify", "v.trip")
                values = read_table("v.trip")
                self.assertTrue((numpy.diff(values) > 0).all())
                data = numpy.sort(volume.ravel()).astype(float)
                window = data.size // 100
                lo, hi = data[:-window], data[window:]
                count = numpy.searchsorted(values, hi) - numpy.searchsorted(values, lo)
                self.assertGreaterEqual(count[hi > lo].min(), 64)

    def test_stored_codes_are_the_nearest(self):
        for name, volume in fields():
            if name not in ("hot voxel", "signed decades"):
                continue
            program.write_nrrd("v.nrrd", volume)
            self.brick("v.nrrd", "v.trip", "--keep-all", "--normals", "none", "--levels", "0")
            values, stored = read_table("v.trip"), read_codes("v.trip")
            self.assertEqual(len(stored), volume.size)
            steps = numpy.diff(values)
            at = numpy.array(list(stored))
            code = numpy.array(list(stored.values()))
            value = volume[at[:, 2], at[:, 1], at[:, 0]].astype(float)
            longer = numpy.maximum(steps[numpy.clip(code, 0, 65534)],
                                   steps[numpy.clip(code - 1, 0, 65534)])
            self.assertTrue((abs(values[code] - value) <= 0.5001 * longer).all(), name)

    def test_the_typical_range_ends_at_the_first_large_gap(self):
        plain = ball()
        for value in (1e6, 2000, -3000, 1e20):
            volume = hot_ball(value)
            program.write_nrrd("v.nrrd", volume)
            for options in ((), ("--keep-all",)):
                info = self.brick("v.nrrd", "v.trip", "--fill", "none", *options)
                others = numpy.delete(plain.ravel(), (4 * EDGE + 4) * EDGE + 4)
                self.assertEqual(info["typical_min"], others.min())
                self.assertEqual(info["typical_max"], others.max())
                self.assertEqual(info["outside"], 1)
                self.assertIn(numpy.float32(value), (info["value_min"], info["value_max"]))

    def test_a_lone_value_leaves_functions_and_histogram(self):
        """The automatic function comes from the other values."""
        program.write_nrrd("v.nrrd", ball())
        wanted = self.brick("v.nrrd", "v.trip")["source"]
        for value in (1e6, -1e6, 2000):
            program.write_nrrd("v.nrrd", hot_ball(value))
            source = self.brick("v.nrrd", "v.trip")["source"]
            self.assertEqual(source["transfer_function"], wanted["transfer_function"])
            self.assertEqual(source["histogram"]["value_max"], wanted["histogram"]["value_max"])
            difference = numpy.subtract(source["histogram"]["counts"],
                                        wanted["histogram"]["counts"])
            self.assertEqual(abs(difference).sum(), 1)  # the voxel itself
        volume = (ball() * 2).astype("i2")
        program.write_nrrd("v.nrrd", volume)
        wanted = self.brick("v.nrrd", "v.trip")["source"]["transfer_function"]
        volume[4, 4, 4] = 32767
        program.write_nrrd("v.nrrd", volume)
        info = self.brick("v.nrrd", "v.trip")
        self.assertEqual(info["source"]["transfer_function"], wanted)
        self.assertEqual((info["codes"], info["outside"]), ("even", 1))

    def test_a_continuous_tail_is_typical(self):
        for name, volume in fields():
            if name not in ("exponential", "lognormal", "signed decades"):
                continue
            program.write_nrrd("v.nrrd", volume)
            info = self.brick("v.nrrd", "v.trip", "--keep-all", "--levels", "0")
            if name == "exponential":
                self.assertEqual(info["typical_max"], volume.max(), name)
            self.assertLess(info["outside"], volume.size // 1000)


class Fills(program.ProgramTest):
    def check(self, volume, fill, *options):
        """Checks that the voxels with the fill value are absent, and that --fill none keeps them."""
        program.write_nrrd("v.nrrd", volume)
        self.assertEqual(self.info("v.nrrd")["fills"], [fill])
        self.assertNotIn("fills", json.loads(self.works("info", "v.nrrd", "--json", "--fill",
                                                        "none").stdout))
        self.assertRegex(self.works("info", "v.nrrd").stdout.decode(),
                         r"(?m)^values .*; \S+ counts as absent, --fill none keeps it$")
        others = volume[volume != volume.dtype.type(fill)].astype(float)
        run = self.works("brick", "v.nrrd", "-o", "v.trip", "--force", "--json", *options)
        summary, info = json.loads(run.stdout), self.info("v.trip")
        count = volume.size - others.size
        self.assertIn(f"note: v.nrrd: {count} voxels with {summary_text(fill)}, far outside",
                      run.stderr)
        self.assertIn("--fill none keeps them", run.stderr)
        self.assertEqual(summary["not_finite"], count)
        self.assertEqual((info["value_min"], info["value_max"]), (others.min(), others.max()))
        self.assertEqual(info["source"]["fills"], [fill])
        kept = self.brick("v.nrrd", "v.trip", "--fill", "none", *options)
        self.assertIn(float(volume.dtype.type(fill)), (kept["value_min"], kept["value_max"]))
        self.assertNotIn("fills", kept["source"])
        return info

    def test_a_hot_voxel_changes_only_its_own_pixels(self):
        """In a fixed view, only pixels of the eight cells around the voxel change. The default view
        moves by less than a tenth of a voxel."""
        program.write_nifti("ball.nii", ball())
        program.write_nifti("hot.nii", hot_ball(1e6))
        view = "--eye=-30,-30,10", "--look=19.5,19.5,19.5", "--up=0,0,1"
        voxel = 300 / (2 * 42 * numpy.tan(numpy.radians(15)))  # pixels at the centre's distance
        for renderer in ("cpu", *program.GL):
            for where in view, ():
                both = [self.picture(name, "--renderer", renderer, "--size=300x300", *where)
                        for name in ("ball.nii", "hot.nii")]
                difference = numpy.abs(both[0] - both[1]).max(axis=-1)
                self.assertLess(255 * numpy.median(difference), 1.5)
                changed = numpy.nonzero(difference > (2 if where else 10) / 255)
                self.assertTrue(len(changed[0]) > 0 or not where)
                for pixels in changed:
                    self.assertLess(numpy.ptp(pixels) if len(pixels) else 0, 6 * voxel, (renderer, where))

    def test_a_window_shows_the_same_whatever_lies_outside(self):
        """Values beyond 30 are far outside of a window from 0 to 10, in every cell."""
        radius = numpy.linalg.norm(grid(), axis=-1)
        field = numpy.exp(12 * (1 - radius)).astype("f4")
        program.write_nifti("all.nii", field)
        program.write_nifti("to-30.nii", numpy.minimum(field, 30))
        for renderer in ("cpu", "integral", *program.GL):
            both = [self.picture(name, "--renderer", renderer, "--size=200x200", "--window=10",
                                 "--level=5", "--tf=grey", "--no-shading")
                    for name in ("all.nii", "to-30.nii")]
            self.assertLess(255 * numpy.abs(both[0] - both[1]).mean(), 0.5, renderer)

    def test_values_that_nobody_declared_are_absent(self):
        for fill in (1e20, -1e30, 9.96921e36, -9999, -32768, 3.4028234663852886e38):
            volume = ball()
            volume[..., :2] = fill
            self.check(volume, fill)
            self.check(volume, fill, "--keep-all")  # without a scan

    def test_16_bit_scans_have_fill_values(self):
        volume = (ball() * 5 - 1024).astype("i2")  # -1024 to about 3000
        volume[:, :9] = -32768
        self.check(volume, -32768)
        self.check(volume, -32768, "--keep-all")

    def test_the_data_set_is_the_one_without_the_planes(self):
        """NaN in place of the fill value gives the same lists."""
        volume = ball()
        volume[..., :2] = 1e20
        program.write_nrrd("v.nrrd", volume)
        self.brick("v.nrrd", "a.trip")
        volume[..., :2] = numpy.nan
        program.write_nrrd("v.nrrd", volume)
        self.brick("v.nrrd", "b.trip")
        for name in sorted(os.listdir("a.trip")):
            if name == "index.trip":
                continue
            with open(f"a.trip/{name}", "rb") as a, open(f"b.trip/{name}", "rb") as b:
                self.assertEqual(a.read(), b.read(), name)

    def test_the_user_names_the_fill_value(self):
        volume = (ball() * 10).astype("i4") + 16777216  # no longer exact as floats
        volume[:5] = 16777217
        program.write_nrrd("v.nrrd", volume)
        count = int((volume == 16777217).sum())
        run = self.works("brick", "v.nrrd", "-o", "v.trip", "--force", "--json",
                         "--keep-all", "--fill", "16777217")
        self.assertEqual(json.loads(run.stdout)["not_finite"], count)
        self.assertIn(f"{count} values are not finite or are the fill value", run.stderr)
        self.assertIn("--fill=16777217", self.info("v.trip")["source"]["source_options"])
        self.assertEqual(self.info("v.trip")["source"]["fills"], [16777217])
        self.fails(2, "brick", "v.nrrd", "-o", "w.trip", "--fill", "much", says="--fill")

    def test_values_near_the_others_are_kept(self):
        volume = ball() - 1000
        volume[4, 4, 4] = -1500
        volume[5, 5, 5] = -999
        program.write_nrrd("v.nrrd", volume)
        self.assertNotIn("fills", self.brick("v.nrrd", "v.trip")["source"])
        self.assertNotIn("fills", self.info("v.nrrd"))


def summary_text(fill):
    """Returns a number as the program prints it."""
    return f"{fill:.17g}" if fill == int(fill) and abs(fill) < 1e15 else f"{fill!r}"


class Ids(program.ProgramTest):
    def labels(self, ids, dtype):
        """Returns balls of radius 0.35 in a background of 0, and the voxels of each."""
        volume = numpy.zeros((EDGE, EDGE, EDGE), dtype)
        places = [(-0.5, -0.5, -0.5), (0.5, -0.5, -0.5), (-0.5, 0.5, -0.5), (0.5, 0.5, 0.5),
                  (-0.5, -0.5, 0.5)]
        for place, label in zip(places, ids):
            volume[numpy.linalg.norm(grid() - place, axis=-1) < 0.35] = label
        return volume, [int((volume == label).sum()) for label in ids]

    def brick_labels(self, volume, *options):
        program.write_raw("v.raw", volume)
        kind = {"u4": "uint32", "i8": "int64", "u8": "uint64", "f4": "float"}[volume.dtype.str[1:]]
        return self.brick("v.raw", "v.trip", "--size", "40,40,40", "--type", kind, *options)

    def test_ids_stay_distinct(self):
        for ids, dtype in (((1, 2, 100000, 100001, 4000000000), "u4"),
                           ((5, 2**53 + 1, 2**60, 2**60 + 1, 2**63 + 2**62), "u8"),
                           ((3, 4, 2**62, 2**62 + 1, 2**62 + 2), "i8"),
                           ((1, 2, 100000, 100001, 1000001), "f4")):
            volume, counts = self.labels(ids, dtype)
            info = self.brick_labels(volume)
            self.assertEqual((info["codes"], info["ids"]), ("ids", 6))
            self.assertEqual(info["source"]["function_kind"], "labels")
            self.assertEqual(info["kept"], sum(counts))
            values = read_table("v.trip")[:6]
            self.assertTrue((numpy.diff(values) > 0).all())
            self.assertTrue(numpy.allclose(values[1:], [float(i) for i in ids], rtol=1e-15))
            for (i, j, k), code in read_codes("v.trip").items():
                self.assertEqual(volume[k, j, i], ([0, *ids])[code])
            self.works("info", "--verify", "v.trip")
            for label, count in zip(values[1:], counts):  # each alone
                one = self.brick_labels(volume, f"--range={label!r}:{label!r}")
                self.assertEqual(one["kept"], count)

    def test_each_id_has_a_colour(self):
        volume, _ = self.labels((1, 2, 100000, 100001, 4000000000), "u4")
        text = self.brick_labels(volume)["source"]["transfer_function"]
        points = [tuple(map(float, line.split())) for line in text.splitlines()[2:]]
        colours = {p[1:4] for p in points if p[4] > 0}
        self.assertEqual(len(colours), 5)
        self.assertEqual([p[0] for p in points if p[4] > 0],
                         [v for i in (1, 2, 100000, 100001, 4000000000)
                          for v in (i - 0.5, i + 0.5)])

    def test_each_ball_has_its_own_colour_alone(self):
        """Opaque balls without light show the colours of their ids and the background only."""
        volume, _ = self.labels((1, 2, 100000, 100001, 4000000000), "u4")
        info = self.brick_labels(volume)
        points = [tuple(map(float, line.split()))
                  for line in info["source"]["transfer_function"].splitlines()[2:]]
        with open("solid.tf", "w") as out:
            out.write("unit 0.0001\n")
            out.writelines(f"{p[0]} {p[1]} {p[2]} {p[3]} {1 if p[4] > 0 else 0}\n" for p in points)
        colours = {tuple(round(255 * c) for c in p[1:4]) for p in points if p[4] > 0}
        for renderer in ("cpu", "integral", *program.GL):
            pixels = self.picture("v.trip", "--renderer", renderer, "--size=100x100", "--tf=solid.tf",
                                  "--no-shading", "--samples=1").reshape(-1, 4)
            opaque = pixels[pixels[:, 3] > 0.99]
            seen = {tuple(int(round(255 * c)) for c in p[:3]) for p in opaque}
            near = {c for c in colours for p in seen if max(abs(a - b) for a, b in zip(c, p)) <= 2}
            self.assertEqual(near, colours, renderer)
            for p in seen:
                self.assertTrue(any(max(abs(a - b) for a, b in zip(c, p)) <= 2 for c in colours),
                                (renderer, p))

    def test_coarse_levels_have_no_other_ids(self):
        volume, _ = self.labels((1, 2, 100000, 100001, 4000000000), "u4")
        program.write_raw("v.raw", numpy.tile(volume, (3, 3, 3)))
        self.brick("v.raw", "v.trip", "--size", "120,120,120", "--type", "uint32", "--levels", "3",
                   "--levels-for", "both")
        out = subprocess.run([sys.executable, READER, "v.trip"], capture_output=True, check=True)
        codes = {int(line.split()[4]) for line in out.stdout.decode().splitlines()
                 if ".values" in line.split()[0] or line.split()[0] == "z"}
        self.assertLessEqual(codes, set(range(6)))

    def test_too_many_ids_are_numbered(self):
        cells = numpy.arange(42**3).reshape(42, 42, 42) * 50021 + 7
        volume = numpy.repeat(numpy.repeat(numpy.repeat(cells, 4, 0), 4, 1), 4, 2).astype("u4")
        program.write_raw("v.raw", volume)
        run = self.works("brick", "v.raw", "-o", "v.trip", "--force", "--size", "168,168,168",
                         "--type", "uint32", "--levels", "0", "--region", "0:8,0:8,0:8")
        self.assertIn("more than 65535 ids", run.stderr)
        info, stored = self.info("v.trip"), read_codes("v.trip")
        self.assertEqual(info["source"]["function_kind"], "labels")
        values = numpy.rint(read_table("v.trip"))
        for (i, j, k), code in stored.items():  # one number for each id
            first = (i // 4 * 4, j // 4 * 4, k // 4 * 4)
            self.assertEqual(values[code], values[stored[first]])
        numbers = {values[c] for c in stored.values()}
        self.assertTrue(len(numbers) == 8 and min(numbers) >= 1 and max(numbers) <= 16383)

    def test_measured_integers_are_no_ids(self):
        volume = (numpy.exp(ball().astype(float) / 50) + 1000).astype("u4")
        self.assertNotEqual(self.brick_labels(volume)["codes"], "ids")


if __name__ == "__main__":
    program.main()
