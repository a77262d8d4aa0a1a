"""Tests of the deferred pictures of clouds (render/surfels/surfel_picture.h) by the program: they
depend neither on memory, threads, earlier pictures nor on what is hidden. Expected colours are
closed forms."""
import json
import math
import os
import sys
import unittest

import numpy

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "gaussians"))
import discs  # noqa: E402
import program  # noqa: E402
from test_points import grid, write_cloud

VIEW = ("--size", "160x120", "--eye", "0,0,8", "--look", "0,0,0", "--up", "0,1,0", "--fov", "30")


def coloured(path, points, rgb, **more):
    n = len(points)
    write_cloud(path, points, red=[rgb[0]] * n, green=[rgb[1]] * n, blue=[rgb[2]] * n, **more)


def ball(count, radius=1):
    """Returns points that are spread evenly over a sphere, and their normals."""
    n = numpy.arange(count) + 0.5
    z, turn = 1 - 2 * n / count, numpy.pi * (1 + 5**0.5) * n
    at = numpy.stack([numpy.cos(turn) * (1 - z * z) ** 0.5, numpy.sin(turn) * (1 - z * z) ** 0.5, z], 1)
    return radius * at, at


class Deferred(program.ProgramTest):
    def write_json(self, path, value):
        program.write(path, json.dumps(value).encode())
        return path

    def test_a_scan_is_close_to_cast_discs(self):
        """The ray caster of discs.py shows the nearest disc of each ray. Disc radii come from its own
        search for neighbours. Few pixels lie more than a pixel beyond the other silhouette."""
        lamp = os.path.join(program.DATASETS, "lamp.ply")
        cloud = discs.shape(discs.read_ply(lamp))
        lo, hi = numpy.percentile(cloud["centre"], [2, 98], axis=0)
        middle, size = (lo + hi) / 2, numpy.linalg.norm(hi - lo)
        for turn, bound in (0.3, 2.5), (-0.6, 2.5):
            eye = middle + size * numpy.array([math.sin(turn), 0.2, math.cos(turn)])
            view = {"eye": eye, "look": middle, "up": numpy.array([0.0, 1, 0]), "fov": 40, "size": (240, 240)}
            options = [f"--{k}={','.join(map(repr, map(float, view[k])))}" for k in ("eye", "look", "up")]
            picture = self.picture(lamp, *options, "--fov", "40", "--size", "240x240", "--background",
                                   "transparent")
            apart = discs.compare(picture, discs.draw(cloud, view, 3))
            self.assertLess(apart["colour"], bound, apart)
            self.assertLess(apart["differing"], 0.03, apart)
            self.assertLess(apart["beyond"], 30, apart)  # of 57,600 pixels

    def test_overlapping_scans_of_one_wall_have_the_mean_colour(self):
        """Two scans of a wall lie closer than a radius, with noise. Neither hides the other in
        spots: each pixel has nearly the mean of red and green."""
        r = numpy.random.default_rng(1)
        one, two = grid(90), grid(90) + [0.02, 0.02, 0]
        points = numpy.concatenate([one, two])
        points[:, 2] += r.uniform(-0.008, 0.008, len(points))
        n = len(one)
        write_cloud("scans.ply", points, red=[200] * n + [0] * n, green=[0] * n + [200] * n,
                    blue=[0] * 2 * n, nx=[0] * 2 * n, ny=[0] * 2 * n, nz=[1] * 2 * n)
        view = ("--size", "120x120", "--eye", "0,0,9", "--look", "0,0,0", "--up", "0,1,0", "--ortho", "2")
        picture = self.picture("scans.ply", *view)
        self.assertTrue((picture[:, :, 3] == 1).all())
        far = 255 * abs(picture[:, :, :2] - 100 / 255)
        self.assertLess(far.mean(), 25)
        # by depth, each pixel shows the scan with the nearer point there
        self.assertGreater((255 * abs(self.picture("scans.ply", *view, "--order", "depth")[:, :, :2] -
                                      100 / 255)).mean(), 2 * far.mean())

    def test_what_is_hidden_is_not_read_and_does_not_count(self):
        """A wall covers the picture. 200,000 points behind it change no bit."""
        r = numpy.random.default_rng(5)
        coloured("wall.ply", 0.9 * grid(160) + [0, 0, 2], (200, 120, 40))
        coloured("behind.ply", r.uniform(-1, 1, (200000, 3)), (0, 0, 255))
        self.write_json("both.json", {"objects": [{"data": "behind.ply"}, {"data": "wall.ply"}]})
        self.write_json("alone.json", {"objects": [{"data": "wall.ply"}]})
        for more in (), ("--ortho", "3"):
            view = VIEW[:-2] + more if more else VIEW
            one, two = (self.picture(name, *view) for name in ("alone.json", "both.json"))
            numpy.testing.assert_array_equal(one, two)
            self.assertTrue((one[:, :, 3] == 1).all())
            numpy.testing.assert_allclose(one[60, 80, :3], numpy.array((200, 120, 40)) / 255, atol=0.005)
            frame = self.stats("both.json", *view)["frames"][0]
            fates = frame["surfels"]
            self.assertEqual(fates["objects_in_view"], 2)
            self.assertGreater(fates["unread"], 150000)
            self.assertEqual(fates["planned"], fates["unread"] + fates["read"])
            self.assertLessEqual(fates["visible"], fates["read"] - fates["hidden"] - fates["outside"])
            self.assertLess(frame["bytes_read"], 24 * 60000)

    def test_memory_threads_and_renderers_agree(self):
        at, normal = ball(60000)
        colours = ((at + 1) * 127).round()
        write_cloud("ball.ply", at, red=colours[:, 0], green=colours[:, 1], blue=colours[:, 2],
                    nx=normal[:, 0], ny=normal[:, 1], nz=normal[:, 2])
        view = ("--size", "200x150", "--eye", "1,2,3", "--look", "0,0,0")
        one = self.picture("ball.ply", *view)
        for options in ("--memory", "32M"), ("--threads", "1"), ("--threads", "5"):
            numpy.testing.assert_array_equal(one, self.picture("ball.ply", *view, *options), str(options))
        for renderer in ("reference", *program.GL):
            other = self.picture("ball.ply", *view, "--renderer", renderer)
            self.assertLess(255 * abs(one - other).mean(), 0.05)
            stats = self.stats("ball.ply", *view, "--renderer", renderer)
            self.assertEqual((stats["renderer"], stats["order"]), (renderer, "deferred"))
        self.fails(1, "render", "ball.ply", "-o", "x.png", "--size", "4000", "--memory", "24M",
                   says="raise --memory")

    def test_small_clouds_have_coarse_levels(self):
        """A ball of 8000 points, 12 pixels wide, is drawn from a fifth of them at most. Its distance from the
        mean of 8 x 8 rays per pixel is at most twice that of the picture of all points."""
        at, normal = ball(8000)
        colours = ((at + 1) * 127).round()
        write_cloud("small.ply", at, red=colours[:, 0], green=colours[:, 1], blue=colours[:, 2],
                    nx=normal[:, 0], ny=normal[:, 1], nz=normal[:, 2])
        view = ("--size", "32x32", "--eye", "1,2,30", "--look", "0,0,0", "--fov", "10.2")
        truth = self.picture("small.ply", *view, "--lod", "0", "--samples", "8")
        self.assertTrue(90 < (truth[:, :, 3] > 0.5).sum() < 140)
        apart = [255 * abs(self.picture("small.ply", *view, *options) - truth).mean()
                 for options in ((), ("--lod", "0"))]
        self.assertLess(apart[0], 2 * apart[1])
        self.assertLess(self.stats("small.ply", *view)["frames"][0]["surfels"]["planned"], 1600)

    def test_a_large_turn_between_two_pictures_leaves_no_holes(self):
        """Figure 3 of Guennebaud et al. 2004. Each picture of a path has the bits of a picture alone,
        whatever was visible before."""
        at, normal = ball(40000)
        colours = numpy.where((at[:, :1] * at[:, 1:2] * at[:, 2:] > 0), 230, 40).repeat(3, 1)
        write_cloud("ball.ply", at, red=colours[:, 0], green=colours[:, 1], blue=colours[:, 2],
                    nx=normal[:, 0], ny=normal[:, 1], nz=normal[:, 2])
        eyes = [0, 0, 4], [3.5, 1, -2], [0, 0, 4], [-4, 0, 0.5]
        keys = [{"seconds": i, "eye": eye, "look": [0, 0, 0], "up": [0, 1, 0], "fov": 40}
                for i, eye in enumerate(eyes)]
        self.write_json("turn.json", {"triptych_path": 1, "frames_per_second": 1, "keys": keys})
        self.works("render", "ball.ply", "-o", "turn.exr", "--path", "turn.json", "--size", "160x160",
                   "--in-flight", "1")
        names = sorted(n for n in os.listdir(".") if n.startswith("turn") and n.endswith(".exr"))
        self.assertEqual(len(names), len(eyes))
        for name, eye in zip(names, eyes):
            alone = self.picture("ball.ply", "--size", "160x160", "--fov", "40", "--look", "0,0,0", "--up",
                                 "0,1,0", "--eye", ",".join(map(str, eye)))
            numpy.testing.assert_array_equal(program.read_exr(name), alone, name)
            y, x = numpy.mgrid[:160, :160] + 0.5
            # the ball's silhouette lies at the angle asin(1 / distance)
            radius = 80 * numpy.tan(numpy.arcsin(1 / numpy.linalg.norm(eye))) / numpy.tan(numpy.radians(20))
            far = numpy.hypot(x - 80, y - 80)
            self.assertTrue((alone[far < radius - 2, 3] > 0.999).all())
            self.assertTrue((alone[far > radius + 2.5, 3] == 0).all())

    def test_levels_keep_a_fine_texture_from_aliasing(self):
        """Figure 4 of Guennebaud et al. 2004: a checkerboard with squares far below a pixel is grey.
        The selected surfels alone would be black or white."""
        points = grid(400, 0.01)
        i, k = numpy.divmod(numpy.arange(len(points)), 400)
        value = 255 * ((i // 2 + k // 2) % 2)
        n = len(points)
        write_cloud("board.ply", points, red=value, green=value, blue=value, nx=[0] * n, ny=[0] * n,
                    nz=[1] * n)
        view = ("--size", "60x60", "--eye", "0,0,9", "--look", "0,0,0", "--up", "0,1,0", "--ortho", "5")
        fine, coarse = (255 * self.picture("board.ply", *view, "--lod", lod)[10:-10, 10:-10, 0]
                        for lod in ("0", "1"))
        self.assertLess(abs(coarse.mean() - 127.5), 4)
        self.assertLess(coarse.std(), 12)
        self.assertGreater(fine.std(), 3 * coarse.std())

    def test_instances_count_once_each(self):
        """A row of balls. The first one hides the others, which are smaller."""
        at, normal = ball(5000, 0.5)
        coloured("ball.ply", at, (90, 160, 20), nx=normal[:, 0], ny=normal[:, 1], nz=normal[:, 2])
        row = [{"data": "ball.ply", "translate": [0, 0, -1.2 * i], "scale": 0.3 if i else 1}
               for i in range(2000)]
        self.write_json("row.json", {"objects": row})
        stats = self.stats("row.json", "--size", "300x300", "--eye", "0,0,3", "--look", "0,0,0", "--up",
                           "0,1,0", "--ortho", "1.5")["frames"][0]["surfels"]
        self.assertEqual(stats["objects_in_view"], 2000)
        self.assertLess(stats["read"], 20 * 5000)
        aside = self.stats("row.json", "--size", "100x100", "--eye", "0,0,3", "--look", "9,0,3", "--up",
                           "0,1,0", "--fov", "40")["frames"][0]["surfels"]
        self.assertEqual((aside["objects_in_view"], aside["planned"]), (0, 0))

    def test_bench_measures_the_selection(self):
        at, normal = ball(300)
        coloured("ball.ply", at, (90, 160, 20), nx=normal[:, 0], ny=normal[:, 1], nz=normal[:, 2])
        self.works("brick", "ball.ply", "-o", "ball.trip", "-q")
        tables = json.loads(self.works("bench", "surfels", "ball.trip", "--repeat", "1", "--size", "64",
                                       "--json").stdout)["tables"]
        rows = {r["scene"]: r for r in tables["selection"]["rows"]}
        self.assertEqual([rows[n]["objects"] for n in ("single", "dynamic", "forest")], [1, 200, 6800])
        self.assertEqual(rows["single"]["surfels"], 300)
        # half of a ball is hidden, and pixels hold several points
        self.assertTrue(0.5 < rows["single"]["culled"] < 0.95)
        away = [r["away"] for r in rows.values()]  # coarse bricks face all sides, others one
        self.assertTrue(all(0 <= share < 0.5 for share in away) and max(away) > 0, away)
        for r in tables["selection"]["rows"]:
            self.assertAlmostEqual(r["speedup"], r["fps"] / r["without_fps"], places=6)
        reads = {(r["scene"], r["selection"]): r["bytes"] for r in tables["passes"]["rows"]}
        self.assertGreaterEqual(reads["single", "without"], 2 * 24 * 300)
        self.fails(2, "bench", "surfels", says="made of a cloud of points")
        donut = os.path.join(program.DATASETS, "donut_slice.ply")
        self.works("brick", donut, "-o", "donut.trip", "-q")
        self.fails(2, "bench", "surfels", "donut.trip", says="is no cloud of surfels")

    def test_what_does_not_apply_is_refused(self):
        coloured("a.ply", grid(9), (1, 2, 3))
        for options, says in ((("--kernel", "exact"), "does not apply to --order deferred"),
                              (("--early-termination", "0.1"), "does not apply to --order deferred"),
                              (("--h", "0.5"), "nothing to merge"),
                              (("--renderer", "integral"), "has no order")):
            self.leaves_nothing(2, "render", "a.ply", "-o", "x.png", "--order", "deferred", *options,
                                says=says)
        donut = os.path.join(program.DATASETS, "donut_slice.ply")
        self.leaves_nothing(2, "render", donut, "-o", "x.png", "--order", "deferred",
                            says="deferred requires clouds of points")


if __name__ == "__main__":
    program.main()
