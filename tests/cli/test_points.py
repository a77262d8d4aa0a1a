"""Tests of clouds of points as surfels: bricking, colours, sides that point up, and refusals. Expected
values are closed forms."""
import glob
import json
import math
import os
import pathlib
import shutil
import struct
import unittest

import numpy

import program

FRAME = ("--size", "65x65", "--look", "0,0,0", "--ortho", "2")
TYPES = {"x": "f8", "y": "f8", "z": "f8", "red": "u1", "green": "u1", "blue": "u1"}


def write_cloud(path, points, comments=(), **more):
    """Writes a PLY of points, with further properties by name."""
    points = numpy.asarray(points, float).reshape(-1, 3)
    columns = dict(zip("xyz", points.T), **more)
    kinds = {"f8": "double", "f4": "float", "u1": "uchar"}
    types = {name: TYPES.get(name, "f4") for name in columns}
    rows = numpy.empty(len(points), [(name, "<" + types[name]) for name in columns])
    for name, values in columns.items():
        rows[name] = values
    lines = ["ply", "format binary_little_endian 1.0", *("comment " + c for c in comments),
             f"element vertex {len(points)}",
             *(f"property {kinds[types[name]]} {name}" for name in columns), "end_header", ""]
    program.write(path, "\n".join(lines).encode() + rows.tobytes())


def write_las(path, points, classes):
    """Writes LAS 1.2 with points of format 0, in steps of 1 mm."""
    lo, hi = numpy.min(points, axis=0), numpy.max(points, axis=0)
    bounds = [v for pair in zip(hi, lo) for v in pair]
    head = (b"LASF" + struct.pack("<HHIHH8sBB32s32sHHHIIBHI5I3d3d6d", 0, 0, 0, 0, 0, bytes(8), 1, 2,
                                  b"", b"", 1, 2020, 227, 227, 0, 0, 20, len(points), len(points), 0,
                                  0, 0, 0, .001, .001, .001, 0, 0, 0, *bounds))
    rows = b"".join(struct.pack("<iiiHBBbBH", *(round(1000 * v) for v in p), 0, 9, c, 0, 0, 0)
                    for p, c in zip(points, classes))
    program.write(path, head + rows)


def grid(count, step=0.05):
    """Returns a square grid in the plane z = 0, about the origin."""
    at = (numpy.arange(count) - (count - 1) / 2) * step
    x, y = numpy.meshgrid(at, at)
    return numpy.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()])


class Points(program.ProgramTest):
    def front(self, data, *options, eye="0,0,5", up="0,1,0"):
        """Draws in a parallel view of height 2, along z unless told otherwise."""
        return self.picture(data, *FRAME, "--eye", eye, "--up", up, *options)

    # ---- lists ----

    def test_the_view_of_lists_has_the_shares_of_the_weights(self):
        """In an opaque wall each list adds its colour times its share. The view of weights has the
        shares alone."""
        write_cloud("wall.ply", grid(80) * 2, red=[255] * 6400, green=[255] * 6400, blue=[255] * 6400)
        view = ("--size", "65x65", "--eye", "2,1.2,2.5", "--look", "0,0,0", "--up", "0,1,0",
                "--fov", "40", "--order", "lists")
        for h in "0.5", "0.9":
            lists = self.picture("wall.ply", *view, "--h", h, "--show", "lists")
            shares = self.picture("wall.ply", *view, "--h", h, "--show", "merge")
            self.assertGreater(lists[:, :, 3].min(), 0.95)
            self.assertLess(abs(lists[:, :, :3] / lists[:, :, 3:] - shares[:, :, :3]).max(), 0.02)
            self.assertTrue(all(shares[:, :, a].max() > 0.2 for a in (0, 2)))
        straight = self.front("wall.ply", "--order", "lists", "--show", "merge")
        numpy.testing.assert_allclose(straight[32, 32], [0, 0, 1, 1], atol=1e-6)
        for options, says in ((("--show", "lists"), "nothing to merge"),
                              (("--order", "lists", "--show", "levels"), "levels does not apply")):
            self.fails(2, "render", "wall.ply", "-o", "x.png", *options, says=says)

    # ---- shapes ----

    def test_a_point_is_half_opaque_at_its_radius(self):
        """exp(-(1 / 0.85)^2 / 2) is 0.5006. The filter of 0.3 square pixels widens 10 pixels a bit."""
        write_cloud("one.ply", [[0, 0, 0]])
        for options, radius in ((("--radius", "0.5"),), 0.5), ((("--radius", "0.25"),), 0.25):
            picture = self.front("one.ply", *options[0], "--order", "depth")
            self.assertGreater(picture[32, 32, 3], 0.98)
            at = 32 + int(round(radius * 65 / 2))
            exact = (at - 32) / (65 / 2) / radius
            expected = math.exp(-(exact / 0.85) ** 2 / 2)
            self.assertAlmostEqual(picture[32, at, 3], expected, delta=0.02)
            self.assertAlmostEqual(picture[at, 32, 3], expected, delta=0.02)

    def test_points_can_be_translucent(self):
        """The centre of a large point has the opacity 1 - (1 - 0.99)^X."""
        write_cloud("one.ply", [[0, 0, 0]])
        for scale in 0.1, 0.5:
            for order in "depth", "lists":
                picture = self.front("one.ply", "--radius", "0.9", "--order", order, "--opacity-scale",
                                     scale)
                self.assertAlmostEqual(picture[32, 32, 3], 1 - 0.01 ** scale, delta=1e-3)

    def test_the_radius_of_a_file_holds_and_a_factor_multiplies_it(self):
        write_cloud("one.ply", [[0, 0, 0]], radius=[0.2], nx=[0], ny=[0], nz=[1])
        order = "--order", "depth"
        plain, twice = self.front("one.ply", *order), self.front("one.ply", *order, "--radius", "2x")
        expected = 2 * math.pi * 0.85 ** 2 * (65 / 2) ** 2
        for picture, radius in (plain, 0.2), (twice, 0.4):
            # the mass of a Gaussian of opacity 0.99, and of its filter
            mass = picture[:, :, 3].sum() / 0.99 - 2 * math.pi * 0.3
            self.assertAlmostEqual(mass / (expected * radius ** 2), 1, delta=0.03)

    def test_a_deferred_point_is_a_disc(self):
        """Its area is that of the ellipse of surfel_picture.h. Deferred is the default."""
        turn = math.radians(60)
        write_cloud("one.ply", [[0, 0, 0]], radius=[0.3], nx=[0], ny=[0], nz=[1])
        write_cloud("turned.ply", [[0, 0, 0]], radius=[0.3], nx=[math.sin(turn)], ny=[0],
                    nz=[math.cos(turn)])
        for name, share in ("one.ply", 1), ("turned.ply", 0.5):
            picture = self.front(name)[:, :, 3]
            # u <= 2 ln 2, with 1.5 deviations of 0.85 radii and a filter of 0.4 square pixels.
            # Coverage rises from 0 to 1 over the pixel inside the rim.
            deviation = 1.5 * 0.85 * 0.3 * 65 / 2
            wide, high = (math.sqrt(2 * math.log(2) * ((deviation * s) ** 2 + 0.4)) - 0.5
                          for s in (share, 1))
            self.assertAlmostEqual(picture.sum() / (math.pi * wide * high), 1, delta=0.02)
            self.assertEqual(picture[32, 32], 1)
            self.assertEqual(picture[0, 0], 0)
            numpy.testing.assert_array_equal(picture, self.front(name, "--order", "deferred")[:, :, 3])

    def test_the_normal_of_a_file_turns_a_point(self):
        """Seen at 60 degrees from its normal, a disc is half as wide."""
        turn = math.radians(60)
        write_cloud("one.ply", [[0, 0, 0]], radius=[0.3], nx=[math.sin(turn)], ny=[0],
                    nz=[math.cos(turn)])
        picture = self.front("one.ply")[:, :, 3]
        across = (numpy.arange(65) - 32) ** 2
        spread = [(picture.sum(axis=a) * across).sum() / picture.sum() - 0.3 for a in (0, 1)]
        self.assertAlmostEqual(math.sqrt(spread[0] / spread[1]), 0.5, delta=0.02)

    def test_surfaces_have_no_holes(self):
        """Square and random points, straight on and from the side."""
        random = numpy.random.default_rng(4).uniform(-1.5, 1.5, (6000, 3)) * [1, 1, 0]
        for name, points, share in ("grid", grid(60), 0), ("random", random, 0.02):
            write_cloud(name + ".ply", points)
            for eye in "0,0,5", "3,0,4":
                inner = self.front(name + ".ply", eye=eye)[12:-12, 12:-12, 3]
                self.assertLessEqual((inner < 0.9 if share == 0 else inner < 0.5).mean(), share)
                self.assertGreater(inner.mean(), 0.95, (name, eye))

    def test_a_grid_at_utm_coordinates_keeps_its_steps(self):
        """Millimetres count beside 4,000,000 metres."""
        near, far = grid(40, 0.001), grid(40, 0.001) + [500000, 4000000, 100]
        write_cloud("near.ply", near)
        write_cloud("far.ply", far)
        view = ["--size", "65x65", "--ortho", "0.06", "--up", "0,1,0"]
        one = self.picture("near.ply", *view, "--look", "0,0,0", "--eye", "0,0,1", "--color", "height")
        two = self.picture("far.ply", *view, "--look", "500000,4000000,100", "--eye",
                           "500000,4000000,101", "--color", "height")
        # all points have one depth, so rounding decides their order
        self.assertLess(numpy.abs(one - two).max(), 0.05)
        self.assertLess(numpy.abs(one - two).mean(), 0.005)

    def test_strays_do_not_hide_the_cloud(self):
        """The default view shows the cloud, and strays stay small."""
        points = numpy.concatenate([grid(60), [[1e7, 0, 0], [0, -1e7, 3], [5e6, 1e7, 1e7]]])
        write_cloud("stray.ply", points)
        write_cloud("clean.ply", grid(60))
        # all points have one depth, and strays change the order of their records
        apart = numpy.abs(self.front("stray.ply") - self.front("clean.ply"))
        self.assertLess(apart.max(), 0.05)
        self.assertLess(apart.mean(), 0.002)
        shown = self.picture("stray.ply", "--size", "65x65")
        self.assertGreater((shown[:, :, 3] > 0.5).mean(), 0.2)

    def test_odd_clouds_are_drawn(self):
        """One point, equal points, points of a line, and two points have finite pictures."""
        line = numpy.column_stack([numpy.linspace(-1, 1, 50), numpy.zeros(50), numpy.zeros(50)])
        for points in [[0, 0, 0]], [[0, 0, 0]] * 500, line, [[-.5, 0, 0], [.5, 0, 0]]:
            write_cloud("odd.ply", points)
            picture = self.front("odd.ply")
            self.assertTrue(numpy.isfinite(picture).all())
            self.assertGreater(picture[:, :, 3].max(), 0.9)

    def test_memory_and_threads_do_not_change_the_data_set(self):
        r = numpy.random.default_rng(2)
        x, y = r.uniform(0, 30, (2, 40000))
        write_cloud("many.ply", numpy.column_stack([x * x, y, numpy.sin(x) + r.normal(0, .01, 40000)]))
        made = []
        for i, options in enumerate((("--threads", 1), ("--threads", 5), ("--threads", 1, "--memory", "12M"),
                                     ("--threads", 2, "--memory", "20M"))):
            self.works("brick", "many.ply", "-o", f"{i}.trip", "-q", *options)
            made.append([pathlib.Path(path).read_bytes() for path in sorted(glob.glob(f"{i}.trip/*"))])
            self.assertEqual(made[0], made[i], options)
            self.works("info", f"{i}.trip", "--verify")
        self.fails(1, "brick", "many.ply", "-o", "small.trip", "--memory", "2M", says="raise --memory")
        self.assertFalse(glob.glob("small.trip*"))

    def test_results_of_all_points_do_not_depend_on_memory_and_threads(self):
        r = numpy.random.default_rng(3)
        write_cloud("some.ply", r.normal(0, 1, (30000, 3)) * [9, 4, 1])
        made = []
        for i, options in enumerate((("--threads", 1), ("--threads", 3, "--memory", "24M"))):
            self.works("brick", "some.ply", "-o", f"s{i}.trip", "-q", "--outliers", 1, "--color", "density",
                       *options)
            made.append([pathlib.Path(path).read_bytes() for path in sorted(glob.glob(f"s{i}.trip/*"))])
        self.assertEqual(*made)

    # ---- outliers ----

    def test_outliers_are_those_of_a_computation_by_numpy(self):
        """Strays lie around a square. Pictures show the other points alone."""
        r = numpy.random.default_rng(5)
        points = numpy.concatenate([r.uniform(-.5, .5, (500, 3)), r.uniform(-1, 1, (40, 3))]) * [1, 1, 0]
        apart = numpy.linalg.norm(points[:, None] - points[None], axis=2)
        spread = numpy.sort(apart, axis=1)[:, 1:9].mean(axis=1)
        shape = {"radius": [.03] * 540, "nx": [0] * 540, "ny": [0] * 540, "nz": [1] * 540}
        write_cloud("strays.ply", points, red=[255] * 540, green=r.integers(0, 255, 540), blue=[0] * 540, **shape)
        rows = numpy.arange(540)
        for deviations in 0.5, 1, 3:
            kept = spread <= spread.mean() + deviations * spread.std(ddof=1)
            self.assertTrue(0 < (~kept).sum() < 60)
            shutil.rmtree("kept.trip", ignore_errors=True)
            run = self.works("brick", "strays.ply", "-o", "kept.trip", "--json", "--k", 8, "--outliers", deviations)
            done = json.loads(run.stdout)
            self.assertEqual((done["gaussians"], done["outliers"]), (kept.sum(), (~kept).sum()))
            self.assertIn(f"{(~kept).sum()} of 540 points are outliers", run.stderr)
            self.assert_shows("kept.trip", points[rows[kept]])
        self.assertNotIn("outliers", self.works("brick", "strays.ply", "-o", "all.trip").stderr)

    def assert_shows(self, data, points):
        """Only pixels near the points are covered, and every pixel at a point is."""
        seen = self.front(data)[:, :, 3] > 0.01
        x, y = (32.5 * (1 + points[:, 0])).astype(int), (32.5 * (1 - points[:, 1])).astype(int)
        near = numpy.zeros((75, 75), bool)
        for dx in range(-4, 5):
            for dy in range(-4, 5):
                near[numpy.clip(y + dy, 0, 74), numpy.clip(x + dx, 0, 74)] = True
        self.assertFalse((seen & ~near[:65, :65]).any())
        inside = (x >= 0) & (x < 65) & (y >= 0) & (y < 65)
        self.assertTrue(seen[y[inside], x[inside]].all())

    def test_few_points_have_no_outliers(self):
        for points in [[0, 0, 0]], [[0, 0, 0]] * 9, [[0, 0, 0], [1, 0, 0]]:
            write_cloud("few.ply", points)
            picture = self.front("few.ply", "--outliers", "1e-3", "--color", "density")
            self.assertGreater(picture[:, :, 3].max(), 0.9)

    # ---- colours ----

    def test_density_is_coloured_by_its_logarithm(self):
        """Each point has four neighbours at most `apart` away, one of them exactly so. Density is
        four times as high in each cluster as in the one before."""
        points = []
        for x, apart in (-.6, .08), (0, .04), (.6, .02):
            side, back = .45 * apart, -apart * math.sqrt(1 - .45 ** 2)
            points += [[x, 0, 0], *([x + side * a, side * b, back] for a, b in ((1, 0), (0, 1), (-1, 0), (0, -1)))]
        write_cloud("dense.ply", points)
        viridis = numpy.array([[68, 1, 84], [33, 145, 140], [253, 231, 37]]) / 255
        numpy.testing.assert_allclose(self.middle("dense.ply", "--color", "density", "--k", 4), viridis, atol=0.02)

    def test_points_have_their_own_colours(self):
        write_cloud("rgb.ply", [[0, 0, 0]], red=[255], green=[128], blue=[0])
        picture = self.front("rgb.ply", "--radius", 5)[32, 32]
        numpy.testing.assert_allclose(picture[:3] / picture[3], [1, 128 / 255, 0], atol=0.003)

    def middle(self, path, *options):
        """Returns the colours of three points along x, which are 0.6 apart."""
        picture = self.front(path, "--radius", 0.1, "--no-shading", *options)
        found = [picture[32, int(32.5 + x * 65 / 2)] for x in (-.6, 0, .6)]
        return numpy.array([c[:3] / c[3] for c in found])

    def test_points_are_coloured_by_their_attributes(self):
        at = [[-.6, 0, 0], [0, 0, 0], [.6, 0, 0]]
        write_cloud("a.ply", at, intensity=[10, 20, 30], classification=[2, 6, 9],
                    return_number=[1, 2, 3], number_of_returns=[3, 3, 3], gps_time=[7, 8, 9])
        viridis = numpy.array([[68, 1, 84], [33, 145, 140], [253, 231, 37]]) / 255
        for options, expected in ((("--color", "intensity"), [[0] * 3, [0.5] * 3, [1] * 3]),
                                  ((), [[0] * 3, [0.5] * 3, [1] * 3]),
                                  (("--color", "return"), viridis), (("--color", "time"), viridis)):
            numpy.testing.assert_allclose(self.middle("a.ply", *options), expected, atol=0.02,
                                          err_msg=str(options))
        ground, building, water = self.middle("a.ply", "--color", "classification")
        self.assertGreater(ground[0], ground[2])
        self.assertGreater(building[0], 2 * building[2])
        self.assertGreater(water[2], 2 * water[0])
        write_cloud("h.ply", [[-.6, -.2, 0], [0, 0, 0], [.6, .2, 0]], red=[0] * 3, green=[0] * 3,
                    blue=[0] * 3)
        done = self.works("brick", "h.ply", "-o", "h.trip", "--radius", "0.1")
        self.assertIn("is drawn by its heights", done.stderr)
        picture = self.front("h.trip", "--no-shading")[32, 32]
        numpy.testing.assert_allclose(picture[:3] / picture[3], viridis[1], atol=0.02)

    def test_the_cache_keeps_a_data_set_for_each_choice(self):
        write_cloud("c.ply", grid(20), red=[200] * 400, green=[0] * 400, blue=[0] * 400,
                    intensity=range(400))
        for options in (), ("--color", "intensity"), ("--k", 5), ("--radius", 0.1), ("--radius", "1.5x"):
            before = json.loads(self.works("cache", "list", "--json").stdout)
            one = self.front("c.ply", *options)
            two = self.front("c.ply", *options)
            after = json.loads(self.works("cache", "list", "--json").stdout)
            self.assertEqual(len(str(after)) > len(str(before)), True, options)
            numpy.testing.assert_array_equal(one, two)

    # ---- light ----

    def lit(self, turn, *options):
        """Returns the red of a grey point whose normal is turned from the view, over its alpha."""
        write_cloud("lit.ply", [[0, 0, 0]], radius=[1], nx=[math.sin(turn)], ny=[0],
                    nz=[math.cos(turn)], red=[102], green=[102], blue=[102], intensity=[5])
        picture = self.front("lit.ply", *options)[32, 32]
        return picture[0] / picture[3]

    def test_light_shades_points_by_their_normals(self):
        """The model of shade.h: ambient 0.3, diffuse 0.7, and 0.2 times the highlight's power 24."""
        for degrees in 0, 30, 60, 80:
            turn = math.radians(degrees)
            near = math.cos(turn)
            facing = min(1, 4 * near * near)
            head = 0.4 * (0.3 + 0.7 * near) + 0.2 * facing * near ** 24
            side = math.radians(degrees - 45)  # from the upper right of the z axis
            half = math.radians(degrees - 22.5)
            facing = min(1, max(0, 4 * math.cos(side) * near))
            aside = (0.4 * (0.3 + 0.7 * abs(math.cos(side)))
                     + 0.2 * facing * abs(math.cos(half)) ** 24)
            for options, expected in ((), 0.4), (("--light", "head"), head), \
                    (("--light", "head", "--order", "lists"), head), \
                    (("--light", "head", "--renderer", "reference"), head), \
                    (("--light", "world:1,0,1"), aside), (("--light", "point:900,0,900"), aside), \
                    (("--no-shading",), 0.4), \
                    (("--color", "intensity"), None), (("--color", "intensity", "--no-shading"), 0.5):
                if expected is None:  # half grey, with a light of its own
                    expected = 0.5 * (0.3 + 0.7 * near) + head - 0.4 * (0.3 + 0.7 * near)
                self.assertAlmostEqual(self.lit(turn, *options), expected, delta=0.006,
                                       msg=(degrees, options))

    def test_normals_from_neighbours_light_a_scan_as_its_own_normals_do(self):
        """The normals of the file come from the surface that its program fused."""
        path = os.path.join(program.DATASETS, "lamp.ply")
        data = pathlib.Path(path).read_bytes()
        at = data.index(b"end_header\n") + 11
        rows = numpy.frombuffer(data[at:], [("p", "<f4", 3), ("n", "<f4", 3), ("c", "u1", 3)])
        red, green, blue = rows["c"].T
        write_cloud("bare.ply", rows["p"], ["Vertical Axis: -y"], red=red, green=green, blue=blue)
        one, two = (self.picture(name, "--size", "200x200", "--light", "head")
                    for name in (path, "bare.ply"))
        self.assertGreater((one[:, :, 3] > 0.9).mean(), 0.1)
        self.assertLess(255 * numpy.abs(one - two).mean(), 1.5)

    def test_light_is_refused_for_scenes(self):
        scene = os.path.join(program.DATASETS, "train-1000.ply")
        self.works("brick", scene, "-o", "scene.trip", "-q")
        for name in scene, "scene.trip":
            for options in ("--light", "head"), ("--no-shading",):
                self.leaves_nothing(2, "render", name, "-o", "no.png", *options,
                                    says="does not apply to Gaussian scenes")
        write_cloud("a.ply", grid(4))
        self.leaves_nothing(2, "render", "a.ply", "-o", "no.png", "--effects", "shadows",
                            says="must be occlusion, edl, auto or none")

    # ---- up ----

    def test_scans_of_land_have_z_up_and_other_clouds_y(self):
        points = [[0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3]]
        write_las("a.las", points, [2] * 4)
        write_cloud("a.ply", points)
        write_cloud("c.ply", points, ["Vertical Axis: -y"])
        for name, options, up in (("a.las", (), "z"), ("a.ply", (), "y"), ("a.ply", ("--axes", "RAS"), "z"),
                                  ("a.ply", ("--axes", "RIP"), "-y"), ("a.las", ("--axes", "RSA"), "y"),
                                  ("c.ply", (), "-y"), ("c.ply", ("--axes", "RAS"), "z")):
            shutil.rmtree("up.trip", ignore_errors=True)
            self.works("brick", name, "-o", "up.trip", "-q", *options)
            done = json.loads(self.works("info", "up.trip", "--json").stdout)
            self.assertEqual((done["z_up"], done["y_down"], done["source"]["up"]),
                             (up == "z", up == "-y", up))
            self.works("info", "up.trip", "--verify")

    def test_a_view_of_a_scan_stands_upright(self):
        """A mast on a floor: its top is in the upper half of the picture."""
        x, y = numpy.meshgrid(range(20), range(20))
        floor = numpy.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()])
        mast = numpy.column_stack([numpy.full(60, 10), numpy.full(60, 10), numpy.linspace(0, 15, 60)])
        write_las("mast.las", numpy.concatenate([floor, mast]), [2] * 400 + [6] * 60)
        picture = self.picture("mast.las", "--size", "64x64", "--color", "classification")
        red = (picture[:, :, 0] > 2 * picture[:, :, 2]) & (picture[:, :, 3] > 0.9)
        rows = numpy.nonzero(red.any(axis=1))[0]
        self.assertLess(rows.min(), 24)
        self.assertGreater((picture[40:, :, 3] > 0.5).sum(), (picture[:24, :, 3] > 0.5).sum())

    # ---- refusals ----

    def test_options_of_clouds_are_refused_elsewhere(self):
        program.write_nrrd("v.nrrd", numpy.zeros((4, 4, 4), "u1"))
        scene = os.path.join(program.DATASETS, "train-1000.ply")
        write_cloud("a.ply", grid(4))
        self.works("brick", "a.ply", "-o", "a.trip", "-q")
        for options in ("--color", "height"), ("--k", 8), ("--radius", 1), ("--radius", "2x"), ("--outliers", 2):
            for name in "v.nrrd", scene:
                self.leaves_nothing(2, "brick", name, "-o", "no.trip", *options)
                self.leaves_nothing(2, "render", name, "-o", "no.png", *options)
            self.leaves_nothing(2, "render", "a.trip", "-o", "no.png", *options, says="is a data set")

    def test_options_that_clouds_ignore_are_refused(self):
        write_cloud("a.ply", grid(4))
        for options in (("--spacing", "1,1,1"), ("--grid", "x"), ("--fill", "0"), ("--levels", "2"),
                        ("--normals", "full"), ("--keep-all",), ("--dry-run",), ("--k", 2), ("--k", 65),
                        ("--radius", 0), ("--radius", "-1"), ("--radius", "x"), ("--radius", "nan"),
                        ("--outliers", 0), ("--outliers", "1001"),
                        ("--color", "blue"), ("--color", "rgb"), ("--color", "intensity"),
                        ("--color", "classification"), ("--color", "return"), ("--color", "time"),
                        ("--axes", "SAR"), ("--axes", "xyz")):
            self.leaves_nothing(2, "brick", "a.ply", "-o", "no.trip", *options)


if __name__ == "__main__":
    program.main()
