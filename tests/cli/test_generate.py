"""Tests of triptych-generate. Its files hold the values that the test computes from the formulas of
the fields. Output that cannot be written leaves one line and no file."""
import json
import os
import re
import signal
import struct
import subprocess
import time
import unittest

import numpy

import program

try:
    import pyopenvdb
except ImportError:
    pyopenvdb = None


def positions(dims):
    """Returns x, y and z of the voxels as arrays [z, y, x]. The longest side spans -1 to 1."""
    step = 2 / (max(dims) - 1)
    axes = [(numpy.arange(n) - (n - 1) / 2) * step for n in dims]
    z, y, x = numpy.meshgrid(*axes[::-1], indexing="ij")
    return x, y, z


def marschner_lobb(dims, detail):
    x, y, z = positions(dims)
    rho = numpy.cos(2 * numpy.pi * 6 * detail * numpy.cos(numpy.pi * numpy.hypot(x, y) / 2))
    return (1 - numpy.sin(numpy.pi * z / 2) + 0.25 * (1 + rho)) / (2 * (1 + 0.25))


def shells(dims, detail):
    x, y, z = positions(dims)
    r2 = x * x + y * y + z * z
    waves = 0.5 + 0.5 * numpy.cos(8 * numpy.pi * detail * numpy.sqrt(r2))
    return numpy.where(r2 < 1, waves * (1 - r2) ** 2, 0)


def filaments(dims, detail):
    x, y, z = (4 * numpy.pi * detail * a for a in positions(dims))
    sin, cos = numpy.sin, numpy.cos
    gyroid = sin(x) * cos(y) + sin(y) * cos(z) + sin(z) * cos(x)
    schwarz = cos(x) + cos(y) + cos(z)
    return numpy.maximum(0, 1 - (gyroid**2 + schwarz**2) / 0.02) ** 2


def porous_share(dims, detail):
    """Returns the share of solid in each voxel of the scan, by the formulas of datasets/porous.h."""
    n = numpy.arange(24)
    k = 2 * numpy.pi * 3 * detail * 2 / (max(dims) - 1) * (0.6 + 0.8 * (n * 0.7548776662 % 1))
    along, around = (n + 0.5) / 24, 2 * numpy.pi * (n * 0.61803398875 % 1)
    across = numpy.sqrt(1 - along**2)
    waves = k * (across * numpy.cos(around), across * numpy.sin(around), along)
    axes = [numpy.arange(size) - (size - 1) / 2 for size in dims]
    z, y, x = numpy.meshgrid(*axes[::-1], indexing="ij")
    total, gradient = 0, numpy.zeros((3, *x.shape))
    for (kx, ky, kz), phase in zip(waves.T, 2 * numpy.pi * ((n + 1) * 0.5698402910 % 1)):
        angle = kx * x + ky * y + kz * z + phase
        total = total + numpy.cos(angle) * (2 / 24) ** 0.5
        gradient -= numpy.multiply.outer([kx, ky, kz], numpy.sin(angle) * (2 / 24) ** 0.5)
    slope = numpy.sqrt((gradient**2).sum(0))
    return numpy.clip(0.5 + (total - 0.772193214) / numpy.maximum(slope, 1e-9), 0, 1)


FIELDS = {"marschner-lobb": marschner_lobb, "shells": shells, "filaments": filaments}


def generate(field, dims, path, *arguments):
    program.skip_what_is_switched_off([path])
    size = "x".join(map(str, dims))
    return subprocess.run(
        [program.GENERATE, field, "--size", size, "-o", path, *map(str, arguments)],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
    )


def read_ply(path):
    """Returns the vertices of a binary PLY file."""
    with open(path, "rb") as f:
        names = []
        while (line := f.readline().strip()) != b"end_header":
            if line.startswith(b"property"):
                kind, name = line.split()[1:]
                names.append((name.decode(), {b"float": "<f4", b"uchar": "u1"}[kind]))
        return numpy.frombuffer(f.read(), names)


def centres(vertices):
    return numpy.stack([vertices[n].astype(float) for n in "xyz"], axis=1)


def logit(vertices):
    """Returns the opacities as the generator writes them: limited to 1e-6 and its complement."""
    o = numpy.float32(1) / (1 + numpy.exp(-vertices["opacity"].astype(float)))
    o = numpy.clip(o.astype("f4").astype(float), 1e-6, 1 - 1e-6)
    return numpy.log(o / (1 - o))


def height(x, z):
    """The height of the ground of a landscape (datasets/landscape.h)."""
    return 0.8 * numpy.sin(0.35 * x + 0.6) * numpy.cos(0.27 * z) + 0.2 * numpy.sin(0.9 * z + 0.4 * x)


def read_raw(path, dims, scalar):
    return numpy.fromfile(path, scalar).reshape(dims[::-1])


def read_vdb(path, dims):
    grid = pyopenvdb.read(path, "density")
    values = numpy.zeros(dims, "f4")
    grid.copyToArray(values)
    return values.transpose(2, 1, 0), grid


class Generate(program.ProgramTest):
    def made(self, field, dims, path, *arguments):
        r = generate(field, dims, path, *arguments)
        self.assertEqual((r.returncode, r.stderr), (0, ""))

    def test_files_hold_the_values_of_the_formulas(self):
        dims = 61, 40, 53
        for field, formula in FIELDS.items():
            for detail in 1, 2.5:
                wanted = formula(dims, detail)
                for name, scalar, top in ("uint8", "u1", 255), ("uint16", "<u2", 65535):
                    self.made(field, dims, "v.raw", "--type", name, "--detail", detail)
                    codes = read_raw("v.raw", dims, scalar)
                    self.assertLess(abs(codes - wanted * top).max(), 0.5 + 1e-6, field)
                self.made(field, dims, "v.raw", "--type", "float", "--detail", detail)
                self.assertLess(abs(read_raw("v.raw", dims, "<f4") - wanted).max(), 1e-6, field)

    def test_the_porous_scan_has_two_phases_and_normal_noise(self):
        """The values minus the shares of the formula leave the noise alone. Its moments and its
        correlations have the standard errors 1 / sqrt(n) of a normal distribution."""
        for dims, detail in ((300, 90, 70), 1.3), ((45, 61, 52), 1):
            self.made("porous", dims, "v.raw", "--detail", detail)
            codes = read_raw("v.raw", dims, "<u2").astype("f8")
            self.made("porous", dims, "v.raw", "--detail", detail, "--type", "float")
            self.assertLessEqual(abs(read_raw("v.raw", dims, "<f4") - codes).max(), 0.5)
            share = porous_share(dims, detail)
            noise = (codes - 12000 - 20000 * share) / 900
            error = 5 / noise.size**0.5
            for phase in noise[share == 0], noise[share == 1], noise:
                within = 5 / phase.size**0.5
                self.assertLess(abs(phase.mean()), within)
                self.assertLess(abs(phase.std() - 1), within)
                self.assertLess(abs((phase**3).mean()), within * 15**0.5)
                self.assertLess(abs((phase**4).mean() - 3), within * 96**0.5)
            for axis in 0, 1, 2:
                for away in 1, 2:
                    a, b = numpy.split(noise, [away], axis)[1], numpy.split(noise, [-away], axis)[0]
                    self.assertLess(abs((a * b).mean()), 1.1 * error, (axis, away))

    def test_the_threshold_of_the_porous_scan_gives_its_porosity(self):
        """A sum of many waves with the variance 1 is normal. It exceeds 0.7722 in 22 % of the
        volume. This volume is 24 waves wide."""
        dims = 512, 512, 60
        self.made("porous", dims, "v.raw", "--detail", 4)
        solid = read_raw("v.raw", dims, "<u2") > (12000 + 32000) / 2
        self.assertLess(abs(solid.mean() - 0.22), 0.01)

    def test_the_defaults_of_the_porous_scan(self):
        self.made("porous", (1024, 1024, 2), "v.nrrd")
        with open("v.nrrd", "rb") as f:
            head = f.read(300).split(b"\n\n")[0]
        self.assertIn(b"type: uint16", head)
        self.assertIn(b"# porous, detail 4", head)
        r = subprocess.run([program.GENERATE, "--help"], capture_output=True, text=True)
        self.assertIn("porous: 1024x1024x300", " ".join(r.stdout.split()))

    def test_the_header_describes_the_data(self):
        dims = 20, 10, 30
        self.made("cloud", dims, "v.raw", "--type", "uint16")
        self.made("cloud", dims, "v.nrrd", "--type", "uint16")
        with open("v.nrrd", "rb") as f:
            head, data = f.read().split(b"\n\n", 1)
        for line in b"type: uint16", b"sizes: 20 10 30", b"endian: little", b"encoding: raw":
            self.assertIn(line, head.split(b"\n"))
        with open("v.raw", "rb") as f:
            self.assertEqual(f.read(), data)

    @unittest.skipUnless(pyopenvdb, "python3-openvdb is not installed")
    def test_openvdb_reads_the_same_values(self):
        """The sides are not multiples of the cubes of 128 and the nodes of 4096 voxels."""
        for field in "shells", "cloud", "filaments":
            for dims in (60, 60, 60), (130, 70, 257), (10, 4110, 9):
                self.made(field, dims, "v.raw", "--type", "float", "--detail", 1)
                self.made(field, dims, "v.vdb", "--detail", 1)
                values, grid = read_vdb("v.vdb", dims)
                wanted = read_raw("v.raw", dims, "<f4")
                self.assertTrue((values == wanted).all(), (field, dims))
                self.assertEqual(grid.activeVoxelCount(), numpy.count_nonzero(wanted))
                self.assertEqual(grid.gridClass, "fog volume")

    def test_the_number_of_threads_does_not_change_files(self):
        for field, name in ("cloud", "a.raw"), ("cloud", "a.vdb"), ("porous", "a.raw"):
            contents = set()
            for threads in 1, 3, 8:
                self.made(field, (290, 80, 70), name, "--threads", threads)
                with open(name, "rb") as f:  # a VDB file begins with a random identifier
                    contents.add(f.read()[64:])
            self.assertEqual(len(contents), 1, (field, name))

    def test_a_landscape_has_similar_copies_on_its_ground(self):
        """The copies are turned about y and scaled. The lowest ones touch the ground at the formula's
        height, apart from the 2 % that may be strays."""
        given = [os.path.join(program.DATASETS, name) for name in ("donut_slice.ply", "train-1000.ply")]
        r = subprocess.run([program.GENERATE, "landscape", *given, "-n", "40000", "-o", "land.ply"],
                           capture_output=True, text=True)
        self.assertEqual((r.returncode, r.stdout, r.stderr), (0, "", ""))
        land = read_ply("land.ply")
        self.assertEqual(len(land), 40000)
        scenes = [read_ply(path) for path in given]
        at, seen, scales = 0, set(), []
        while at < len(land):
            ground, at = land[at:at + 256], at + 256
            numpy.testing.assert_allclose(ground["y"], -height(ground["x"], ground["z"]), atol=1e-5)
            which = [n for n, s in enumerate(scenes)
                     if at < len(land) and land["opacity"][at] == numpy.float32(logit(s)[0])]
            if not which or at + len(scenes[which[0]]) > len(land):
                break
            scene = scenes[which[0]]
            copy, at = land[at:at + len(scene)], at + len(scene)
            seen.add(which[0])
            scales.append(self.check_copy(scene, copy, ground))
        self.assertEqual(seen, {0, 1})
        self.assertGreater(max(scales) - min(scales), 0.05)

    def check_copy(self, scene, copy, ground):
        a, b = centres(scene), centres(copy)
        size = numpy.linalg.norm(a[0] - a, axis=1)
        far = size.argmax()
        scale = numpy.linalg.norm(b[0] - b[far]) / size[far]
        numpy.testing.assert_allclose(numpy.linalg.norm(b[0] - b, axis=1), scale * size,
                                      atol=1e-4 * scale * size[far])
        numpy.testing.assert_allclose(b[:, 1] - b[0, 1], scale * (a[:, 1] - a[0, 1]),
                                      atol=1e-4 * scale * size[far])
        for name in "scale_0", "scale_1", "scale_2":
            numpy.testing.assert_allclose(copy[name], scene[name] + numpy.log(scale), atol=1e-4)
        for name in "f_dc_0", "f_dc_1", "f_dc_2":
            numpy.testing.assert_array_equal(copy[name], scene[name])
        low = numpy.sort(a[:, 1])[len(a) - 1 - int(0.02 * (len(a) - 1))]
        stands = b[0, 1] + scale * (low - a[0, 1])
        middle = [(ground[n].min() + ground[n].max()) / 2 for n in "xz"]
        self.assertAlmostEqual(stands, -height(*middle), places=3)
        width = max(numpy.ptp(numpy.sort(a[:, i])[int(0.02 * (len(a) - 1)):len(a) - int(0.02 * (len(a) - 1))])
                    for i in (0, 2))
        self.assertTrue(0.699 < scale * width < 1.201, scale * width)
        return scale * width

    def test_a_scene_file_plants_objects_on_a_cloud_of_the_ground(self):
        """A landscape has y down, and the scene file y up. The two objects stand at the formula's
        height below their middles, apart from the 2 % that may be strays."""
        for arguments in ((("tree", "-n", "3000", "-o", "tree.ply")),
                          ("landscape", "tree.ply", os.path.join(program.DATASETS, "lamp.ply"), "-n",
                           "20", "-o", "land.json")):
            r = subprocess.run([program.GENERATE, *arguments], capture_output=True, text=True)
            self.assertEqual((r.returncode, r.stdout, r.stderr), (0, "", ""))
        with open("land.json", encoding="utf-8") as f:
            ground, *objects = json.load(f)["objects"]
        self.assertEqual(ground, {"data": "land-ground.ply"})
        self.assertEqual(len(objects), 20)
        at = read_ply("land-ground.ply")
        self.assertEqual(len(at), (5 * 16) ** 2)
        numpy.testing.assert_allclose(at["y"], height(at["x"], -at["z"]), atol=1e-5)
        tree = centres(read_ply("tree.ply"))
        planted = [numpy.reshape(o["matrix"], (4, 4)) for o in objects if o["data"].endswith("tree.ply")]
        self.assertTrue(0 < len(planted) < 20)
        self.assertTrue(all(o["data"].startswith("/") for o in objects))
        cut = int(0.02 * (len(tree) - 1))
        low, high = (numpy.sort(tree, axis=0)[n] for n in (cut, len(tree) - 1 - cut))
        for m in planted:
            scale = numpy.linalg.norm(m[0, :3])
            numpy.testing.assert_allclose(m[:3, :3] @ m[:3, :3].T, scale**2 * numpy.eye(3), atol=1e-12)
            self.assertGreater(numpy.linalg.det(m[:3, :3]), 0)
            stands = m @ [(low[0] + high[0]) / 2, low[1], (low[2] + high[2]) / 2, 1]
            self.assertAlmostEqual(stands[1], height(stands[0], -stands[2]), places=6)
            numpy.testing.assert_allclose((m @ [0, 1, 0, 0])[:3], [0, scale, 0], atol=1e-9)

    def test_points_of_a_tree_lie_evenly_on_its_trunk(self):
        """The trunk is a cone with radii 0.03 and 0.021 and the height 0.3. Branches begin above."""
        r = subprocess.run([program.GENERATE, "tree", "-n", "200000", "-o", "tree.ply"],
                           capture_output=True, text=True)
        self.assertEqual((r.returncode, r.stdout, r.stderr), (0, "", ""))
        tree = read_ply("tree.ply")
        self.assertEqual(len(tree), 200000)
        at = centres(tree)
        normals = numpy.stack([tree["n" + n].astype(float) for n in "xyz"], axis=1)
        numpy.testing.assert_allclose(numpy.linalg.norm(normals, axis=1), 1, atol=1e-5)
        trunk = at[:, 1] < 0.28
        self.assertGreater(trunk.sum(), 1000)
        radius = numpy.hypot(at[trunk, 0], at[trunk, 2])
        numpy.testing.assert_allclose(radius, 0.03 - 0.03 * at[trunk, 1], atol=1e-6)
        numpy.testing.assert_allclose((normals * at)[trunk][:, [0, 2]].sum(1), radius, atol=1e-6)
        low = (at[:, 1] < 0.14).sum() / trunk.sum()
        share = (0.03 + 0.0258) / (0.03 + 2 * 0.0258 + 0.0216)
        self.assertLess(abs(low - share), 4 * (share * (1 - share) / trunk.sum()) ** 0.5)
        leaves = tree["green"] > tree["red"]
        self.assertTrue(0.5 < leaves.mean() < 0.99)

    def test_a_landscape_of_clouds_is_las_with_similar_copies(self):
        """NumPy decodes the records by the LAS specification. The copies are turned about z and scaled,
        so they keep distances and heights up to the scale. A cloud without colours is black."""
        lamp = read_ply(os.path.join(program.DATASETS, "lamp.ply"))
        bare = numpy.random.default_rng(5).normal(size=(900, 3)).round(3)
        numpy.savetxt("bare.xyz", bare, "%.3f")
        given = [(centres(lamp), numpy.stack([lamp[n] for n in ("red", "green", "blue")], axis=1)),
                 (bare, numpy.zeros((900, 3), int))]
        r = subprocess.run([program.GENERATE, "landscape", os.path.join(program.DATASETS, "lamp.ply"), "bare.xyz",
                            "-n", "300000", "-o", "land.las"], capture_output=True, text=True)
        self.assertEqual((r.returncode, r.stdout, r.stderr), (0, "", ""))
        at, colours, classes = self.decode_las("land.las", 300000)
        side = int((sum(len(c) for c, _ in given) / 2 / 4) ** 0.5)
        first, seen = 0, set()
        while first + side**2 < len(at):
            ground, first = at[first:first + side**2], first + side**2
            numpy.testing.assert_allclose(ground[:, 2], 100 * height(*(ground[:, :2] / 100).T), atol=2e-3)
            self.assertTrue((classes[first - side**2:first] == 2).all())
            which = int(not colours[first].any())
            cloud, rgb = given[which]
            if first + len(cloud) > len(at):
                break
            copy = at[first:first + len(cloud)]
            numpy.testing.assert_array_equal(colours[first:first + len(cloud)], rgb * 257)
            up = cloud[:, 2] if which else -cloud[:, 1]
            far = numpy.linalg.norm(cloud - cloud[0], axis=1)
            away = numpy.linalg.norm(copy - copy[0], axis=1)
            scale = away[far.argmax()] / far.max()
            numpy.testing.assert_allclose(away, scale * far, atol=3e-3)
            numpy.testing.assert_allclose(copy[:, 2] - copy[0, 2], scale * (up - up[0]), atol=3e-3)
            first += len(cloud)
            seen.add(which)
        self.assertEqual(seen, {0, 1})

    def decode_las(self, path, count):
        """Returns the positions from the corner of the landscape, the colours and the classes."""
        with open(path, "rb") as f:
            data = f.read()
        self.assertEqual((data[:4], data[24], data[25], data[104]), (b"LASF", 1, 4, 2))
        begin, = struct.unpack_from("<I", data, 96)
        size, old_count = struct.unpack_from("<HI", data, 105)
        numbers = struct.unpack_from("<12d", data, 131)
        new_count, *of_return = struct.unpack_from("<16Q", data, 247)
        record = numpy.dtype([("at", "<i4", 3), ("intensity", "<u2"), ("returns", "u1"), ("class", "u1"),
                              ("rest", "u1", 4), ("rgb", "<u2", 3)])
        self.assertEqual((size, old_count, new_count, len(data)),
                         (record.itemsize, count, count, begin + size * count))
        rows = numpy.frombuffer(data, record, offset=begin)
        at = rows["at"] * numpy.array(numbers[:3]) + numpy.array(numbers[3:6])
        self.assertEqual(list(numbers[6:]), [f(axis) for axis in at.T for f in (max, min)])
        number = rows["returns"] & 7
        self.assertEqual(of_return, [int((number == n).sum()) for n in range(1, 16)])
        r = subprocess.run([program.PROGRAM, "info", path], capture_output=True, text=True)
        lines = dict(line.split(None, 1) for line in r.stdout.splitlines())
        self.assertEqual((lines["format"], lines["points"]), ("LAS 1.4, point format 2", str(count)))
        shown = [float(n) for n in re.findall(r"-?[0-9.]+", lines["bounds"])]
        numpy.testing.assert_allclose(shown, [f(axis) for axis in at.T for f in (min, max)], rtol=1e-9)
        return at - (500000, 4900000, 0), rows["rgb"].astype(int), rows["class"]

    def test_wrong_landscapes_are_refused(self):
        donut = os.path.join(program.DATASETS, "donut_slice.ply")
        for arguments, says in ((("landscape", "-o", "x.ply"), "at least one SCENE"),
                                (("landscape", donut, "-s", "9", "-o", "x.ply"), "do not apply"),
                                (("landscape", donut, "-n", "0", "-o", "x.ply"), "--count"),
                                (("cloud", donut, "-o", "x.raw"), "one argument too many"),
                                (("cloud", "-n", "5", "-o", "x.raw"), "--count applies"),
                                (("landscape", donut, "-o", "x.raw"), "must end in .ply"),
                                (("tree", "-o", "x.raw"), "must end in .ply"),
                                (("landscape", donut, "-n", "16384", "-o", "x.json"), "at most 16383"),
                                (("landscape", "nowhere.ply", "-o", "x.json"), "nowhere.ply"),
                                (("tree", donut, "-o", "x.ply"), "one argument too many"),
                                (("tree", "-j", "2", "-o", "x.ply"), "do not apply to tree"),

                                (("landscape", donut, "-o", "x.raw"), "must end in .ply, .las or .json"),
                                (("landscape", "empty.ply", "-o", "x.las"), "empty.ply"),
                                (("landscape", "nowhere.ply", "-o", "x.ply"), "nowhere.ply")):
            r = subprocess.run([program.GENERATE, *arguments], capture_output=True, text=True)
            self.assertIn(r.returncode, (1, 2), arguments)
            self.assertIn(says, r.stderr)
            self.assertFalse(os.path.exists(arguments[-1]))

    def test_output_that_cannot_be_written_leaves_nothing(self):
        os.mkdir("folder.raw")
        for name, status in ("nowhere/v.vdb", 1), ("nowhere/v.raw", 1), ("v.xyz", 2):
            r = generate("shells", (20, 20, 20), name)
            self.assertEqual(r.returncode, status)
            self.assertRegex(r.stderr, r"\Atriptych: [^\n]+\n\Z")
            self.assertIn(name, r.stderr)
        before = set(os.listdir("."))
        for name in "i.raw", "i.nrrd", "i.vdb":
            program.skip_what_is_switched_off([name])
            process = subprocess.Popen(
                [program.GENERATE, "cloud", "--size", "1500", "-o", name],
                stderr=subprocess.PIPE,
                text=True,
            )
            program.await_handler(process)
            while process.poll() is None and program.processor_seconds(process) < 0.3:
                time.sleep(0.01)
            process.send_signal(signal.SIGINT)
            said = process.communicate()[1]
            self.assertEqual(process.returncode, 1)
            self.assertRegex(said, r"\Atriptych: [^\n]*interrupted\n\Z")
            self.assertEqual(set(os.listdir(".")), before)

    def test_a_full_disk_leaves_one_line(self):
        for name in "v.raw", "v.vdb":
            program.skip_what_is_switched_off([name])
            script = (
                'mkdir -p disk && mount -t tmpfs -o size=1m none disk && "$0" shells '
                f"--size 128 --type float -o disk/{name}; echo status $? && ls -A disk"
            )
            r = subprocess.run(
                ["unshare", "--mount", "--map-root-user", "sh", "-c", script, program.GENERATE],
                capture_output=True,
                text=True,
            )
            if "disk/" not in r.stderr:
                self.skipTest(f"a small disk cannot be mounted here: {r.stderr.strip()}")
            self.assertEqual(r.stdout, "status 1\n")
            self.assertRegex(r.stderr, r"\Atriptych: [^\n]*No space left on device[^\n]*\n\Z")


if __name__ == "__main__":
    program.main()
