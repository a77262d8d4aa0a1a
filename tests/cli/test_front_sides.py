"""Tests of --sides front: surfels are drawn from the side of their normals alone, and bricks of backs
are not read (the cones of stream/GAUSSIANS.md). Expected pictures are closed forms. The cones are read
by the second reader tests/gaussians/plain_scene.py."""
import json
import os
import shutil
import sys

import numpy

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "gaussians"))
import plain_scene  # noqa: E402
import program  # noqa: E402
from test_deferred import ball, coloured  # noqa: E402
from test_points import grid, write_cloud  # noqa: E402

FRONT = ("--sides", "front")
ORTHO = ("--size", "200x200", "--eye", "0,0,9", "--look", "0,0,0", "--up", "0,1,0", "--ortho", "2.5")


def write_part(path, count, keep=lambda at: at[:, 2] < 9):
    """Writes the part of a unit sphere that `keep` selects. Colours tell positions."""
    at, normal = ball(count)
    at, normal = at[keep(at)], normal[keep(at)]
    colours = ((at + 1) * 127).round()
    write_cloud(path, at, red=colours[:, 0], green=colours[:, 1], blue=colours[:, 2], nx=normal[:, 0],
                ny=normal[:, 1], nz=normal[:, 2])


def radii():
    """Returns the distance of each pixel of the view ORTHO from the middle, in units of the scene."""
    y, x = (numpy.mgrid[:200, :200] + 0.5 - 100) * 2.5 / 200
    return numpy.hypot(x, y)


class FrontSides(program.ProgramTest):
    def write_json(self, path, *objects):
        program.write(path, json.dumps({"objects": objects}).encode())

    def fates(self, *arguments):
        return self.stats(*arguments)["frames"][0]["surfels"]

    def without_cones(self, path, to):
        """Copies a data set and leaves out its cones."""
        shutil.rmtree(to, ignore_errors=True)
        shutil.copytree(path, to)
        scene = plain_scene.Scene(to)
        for bricks in scene.bricks:
            bricks["cone_axis"] = bricks["cone_cosine"] = 0
        scene.write_index()

    def test_cones_hold_all_normals(self):
        """Surfels and coarse surfels of a ball have outward normals. A scan has noise."""
        write_part("ball.ply", 150000)
        self.works("brick", "ball.ply", "-o", "ball.trip", "-q")
        self.works("brick", os.path.join(program.DATASETS, "lamp.ply"), "-o", "lamp.trip", "-q")
        coarse = set()
        for name in "ball.trip", "lamp.trip":
            scene, shares = plain_scene.Scene(name), []
            for axis, bricks in enumerate(scene.bricks):
                levels = numpy.repeat(scene.nodes["level"], scene.nodes["brick_count"][:, axis])
                for i, b in enumerate(bricks):
                    centre, normal, two_sided = scene.surfels(axis, i)
                    size = numpy.linalg.norm(b["cone_axis"].astype(float))
                    if name == "ball.trip":
                        coarse.add(levels[i] > 0)
                        self.assertFalse(two_sided.any())
                        out = centre / numpy.linalg.norm(centre, axis=1)[:, None]
                        self.assertGreater((normal * out).sum(1).min(), 0.98 if levels[i] else 0.9999)
                    shares.append(b["cone_cosine"] > 0)
                    if b["cone_cosine"] == 0:
                        self.assertEqual(size, 0)
                        continue
                    self.assertAlmostEqual(size, 1, places=6)
                    self.assertFalse(two_sided.any())
                    least = (normal @ (b["cone_axis"] / size)).min()
                    self.assertGreaterEqual(least, b["cone_cosine"])
                    self.assertLess(least, b["cone_cosine"] + 1e-5)  # no wider than needed
            self.assertGreater(numpy.mean(shares), 0.85 if name == "ball.trip" else 0)
            self.works("info", name, "--verify")
        self.assertEqual(coarse, {False, True})

    def test_the_far_side_of_a_ball_is_never_visible(self):
        """A ball without its near cap. Its near side is a ring. Through the hole, the far side shows
        its inside, which is a back."""
        for level in "0", "2":
            write_part("ring.ply", 200000, lambda at: at[:, 2] < 0.5)
            r, hole = radii(), 0.75 ** 0.5
            both, front = (self.picture("ring.ply", *ORTHO, "--lod", level, "--sides", sides)
                           for sides in ("both", "front"))
            self.assertTrue((both[r < 0.97, 3] > 0.999).all())
            self.assertTrue((front[r < hole - 0.04, 3] == 0).all())
            ring = (r > hole + 0.04) & (r < 0.97)
            self.assertTrue((front[ring, 3] > 0.999).all())
            # the ring has the colours of points with z > 0
            z = numpy.sqrt(1 - r[ring] ** 2)
            numpy.testing.assert_allclose(front[ring, 2] / front[ring, 3], (z + 1) * 127 / 255, atol=0.03)
            self.assertTrue((front[r > 1.04, 3] == 0).all())

    def test_half_of_a_ball_is_not_read(self):
        """Half of the surfels face away in a parallel view. Bricks of these alone are not read, if their
        cone says so. The cones decide as in the second reader."""
        eye = numpy.array([2.0, 3, 7])
        view = ("half.trip", "--size", "200x200", "--eye", "2,3,7", "--look", "0,0,0", "--ortho", "2.5",
                "--lod", "0")
        write_part("ball.ply", 300000)
        self.works("brick", "ball.ply", "-o", "half.trip", "-q")
        fates = self.fates(*view, *FRONT)
        scene = plain_scene.Scene("half.trip")
        first = [slice(n["first_brick"][2], n["first_brick"][2] + n["brick_count"][2])
                 for n in scene.nodes if n["level"] == 0]
        bricks = numpy.concatenate([scene.bricks[2][s] for s in first])
        sine = numpy.sqrt(1 - bricks["cone_cosine"].astype(float) ** 2)
        away = (bricks["cone_cosine"] > 0) & (-bricks["cone_axis"] @ (eye / numpy.linalg.norm(eye)) > sine)
        self.assertEqual(bricks["records"].sum(), 300000)
        self.assertEqual(fates["away"], bricks["records"][away].sum())
        self.assertEqual(fates["planned"], 300000)
        self.assertEqual(fates["planned"], fates["away"] + fates["unread"] + fates["read"])
        self.assertTrue(0.3 < fates["away"] / 300000 <= 0.5, fates)
        # the others are read, and one by one they are half of the ball
        self.assertAlmostEqual((fates["away"] + fates["outside"]) / 300000, 0.5, delta=0.002)
        self.assertEqual(self.fates(*view)["away"], 0)

    def test_a_bowl_from_inside_shows_the_background(self):
        write_part("bowl.ply", 100000, lambda at: at[:, 2] < 0)
        for eye, look in ("0.1,0.2,4", "0,0,0"), ("0,0,0", "0.1,0.2,-1"), ("0.2,-0.1,-0.3", "1,0,-1"):
            view = "bowl.ply", "--size", "150x100", "--eye", eye, "--look", look, "--up", "0,1,0"
            picture = self.picture(*view, *FRONT, "--background", "0,0.5,1")
            self.assertTrue((picture == picture[0, 0]).all())
            self.assertEqual(self.fates(*view, *FRONT)["visible"], 0)
            self.assertGreater(self.fates(*view)["visible"], 1000)
        outside = "bowl.ply", "--size", "150x100", "--eye", "0.1,0.2,-4", "--look", "0,0,0", "--up", "0,1,0"
        one, two = self.picture(*outside), self.picture(*outside, *FRONT)
        # the silhouette of the whole ball, as the bowl ends behind it
        y, x = numpy.mgrid[:100, :150] + 0.5
        far = numpy.hypot(x - 75, y - 50)
        radius = far[two[:, :, 3] > 0.5].max()
        numpy.testing.assert_allclose(one[far < radius - 2], two[far < radius - 2], atol=0.02)
        self.assertTrue((two[far < radius - 2, 3] > 0.999).all())

    def test_cones_change_no_bit(self):
        """Data sets with and without cones, from outside and inside, with perspective and in parallel,
        at levels of detail, and in instances that are turned and scaled."""
        chance = numpy.random.default_rng(3)
        write_part("ball.ply", 120000, lambda at: at[:, 0] + at[:, 1] < 0.9)
        self.works("brick", "ball.ply", "-o", "with.trip", "-q", "--force")
        self.without_cones("with.trip", "without.trip")
        for name in "with", "without":
            places = numpy.random.default_rng(8)
            self.write_json(f"{name}.json", *({
                "data": f"{name}.trip", "translate": places.uniform(-2, 2, 3).tolist(),
                "rotate": {"axis": places.normal(0, 1, 3).tolist(), "degrees": places.uniform(0, 360)},
                "scale": places.uniform(0.1, 1)} for _ in range(12)))
        culled = 0
        for kind in ".trip", ".json":
            for lens in ("--fov", "50"), ("--fov", "100"), ("--ortho", "3"):
                for level in "0", "1", "6":
                    eye = chance.normal(0, 1, 3) * (4 if level == "1" else 1.2)
                    options = ("--size", "120x90", "--eye", ",".join(map(str, eye)), "--look", "0,0,0", *lens,
                               "--lod", level, *FRONT)
                    one = self.picture("with" + kind, *options)
                    numpy.testing.assert_array_equal(one, self.picture("without" + kind, *options),
                                                  str(options))
                    self.assertEqual(self.fates("without" + kind, *options)["away"], 0)
                    culled += self.fates("with" + kind, *options)["away"] > 0
        self.assertGreater(culled, 8)
        one = self.picture("with.json", *options)
        for more in ("--memory", "32M"), ("--threads", "1"), ("--threads", "5"):
            numpy.testing.assert_array_equal(one, self.picture("with.json", *options, *more), str(more))
        # the reference reads bricks that face away
        self.assertEqual(self.fates("with.json", *options, "--renderer", "reference")["away"], 0)
        for renderer in ("reference", *program.GL):
            other = self.picture("with.json", *options, "--renderer", renderer)
            self.assertLess(255 * abs(one - other).mean(), 0.05)

    def test_both_sides_are_the_default_and_cones_cull_nothing(self):
        write_part("bowl.ply", 50000, lambda at: at[:, 2] < 0)
        self.works("brick", "bowl.ply", "-o", "with.trip", "-q", "--force")
        self.without_cones("with.trip", "without.trip")
        view = "--size", "120x90", "--eye", "0.5,1,3", "--look", "0,0,0"
        one = self.picture("with.trip", *view)
        for name, more in ("with", ("--sides", "both")), ("without", ()), ("without", ("--sides", "both")):
            numpy.testing.assert_array_equal(one, self.picture(f"{name}.trip", *view, *more))
        self.assertEqual(self.fates("with.trip", *view)["away"], 0)

    def test_instances_turn_their_sides(self):
        """A plate that faces z. Turned by 180 degrees about y, it shows its back."""
        n = 90 * 90
        coloured("plate.ply", grid(90), (200, 100, 50), nx=[0] * n, ny=[0] * n, nz=[1] * n)
        for angle, seen in (0, 1), (70, 1), (110, 0), (180, 0), (250, 0), (290, 1):
            self.write_json("scene.json", {"data": "plate.ply", "scale": 0.7,
                                            "rotate": {"axis": [0, 1, 0], "degrees": angle}})
            front = self.picture("scene.json", *ORTHO, *FRONT)
            self.assertEqual(front[100, 100, 3], seen, angle)
            self.assertEqual((front[:, :, 3] > 0).any(), bool(seen), angle)
            self.assertEqual(self.picture("scene.json", *ORTHO)[100, 100, 3], 1)
            self.assertEqual(self.fates("scene.json", *ORTHO, *FRONT)["away"] > 0, not seen)
        # a scene never mirrors a cloud, so normals cannot turn over
        self.write_json("mirrored.json", {"data": "plate.ply", "matrix": [
            -1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]})
        self.leaves_nothing(2, "render", "mirrored.json", "-o", "x.png", *FRONT, says="without mirroring")

    def test_a_thin_wall_does_not_show_its_back(self):
        """A wall with a red front and a blue back, thinner than the radius of its surfels. Both sides
        blend. Front sides alone are red from the front and blue from behind. Far away, coarse surfels
        have the colours of both sides, and leave no hole."""
        one = grid(200)
        two = one - [*(one[201, :2] - one[0, :2]) / 2, 0.005]  # between the points of the front
        aside = [[40, 0, 2]]  # no voxel of a level divides the wall in its middle
        n, points = len(one), numpy.concatenate([one, two, aside])
        write_cloud("wall.ply", points, red=[220] * n + [0] * (n + 1), green=[0] * (2 * n + 1),
                    blue=[0] * n + [220] * (n + 1), nx=[0] * (2 * n + 1), ny=[0] * (2 * n + 1),
                    nz=[1] * n + [-1] * (n + 1), radius=[0.035] * (2 * n + 1))
        self.works("brick", "wall.ply", "-o", "wall.trip", "-q")
        for z, channel in (9, 0), (-9, 2):
            view = ("wall.trip", "--size", "100x100", "--eye", f"0,0,{z}", "--look", "0,0,0", "--up", "0,1,0")
            both, front = (255 * self.picture(*view, "--ortho", "1", "--sides", sides)[20:-20, 20:-20]
                           for sides in ("both", "front"))
            self.assertGreater(both[:, :, 2 - channel].mean(), 60)
            numpy.testing.assert_allclose(front[:, :, channel], 220, atol=1)
            numpy.testing.assert_allclose(front[:, :, 2 - channel], 0, atol=1)
            far, all_far = (self.picture(*view, "--ortho", "50", *sides, "--lod", "4")[42:58, 42:58]
                            for sides in (FRONT, ()))
            numpy.testing.assert_array_equal(far, all_far)
            self.assertTrue((far[:, :, 3] > 0.99).all())
            numpy.testing.assert_allclose(255 * (far[:, :, 0] + far[:, :, 2]), 220, atol=1)
            self.assertGreater(255 * far[:, :, [0, 2]].min(), 50)  # the nearest ones count more
        scene, sides = plain_scene.Scene("wall.trip"), 0
        levels = numpy.repeat(scene.nodes["level"], scene.nodes["brick_count"][:, 0])
        for i, level in enumerate(levels):
            two_sided = scene.surfels(0, i)[2]
            self.assertTrue(level > 0 or not two_sided.any())
            self.assertFalse(two_sided.any() and scene.bricks[0]["cone_cosine"][i] > 0)
            sides += two_sided.sum()
        self.assertGreater(sides, 100)
        self.works("info", "wall.trip", "--verify")

    def test_a_hostile_cone_is_refused(self):
        write_part("ball.ply", 3000, lambda at: at[:, 2] > 0.3)
        self.works("brick", "ball.ply", "-o", "good.trip", "-q")
        good = plain_scene.Scene("good.trip")
        self.assertGreater(good.bricks[1]["cone_cosine"][0], 0)
        nan, infinite = float("nan"), float("inf")
        for number, (axis, cosine) in enumerate((
                ((nan, 0, 1), 0.5), ((0, 0, 1.001), 0.5), ((0, 0, 0.999), 0.5), ((infinite, 0, 0), 0.5),
                ((0, 0, 0), 0.5), ((0, 0, 1), 0), ((0, 0, 1), nan), ((0, 0, 1), 1.5), ((0, 0, 1), -0.5),
                ((3e38, 3e38, 0), 0.5), ((nan, 0, 0), 0))):
            shutil.copytree("good.trip", f"{number}.trip")
            scene = plain_scene.Scene(f"{number}.trip")
            scene.bricks[1]["cone_axis"][0], scene.bricks[1]["cone_cosine"][0] = axis, cosine
            scene.write_index()
            self.leaves_nothing(1, "render", f"{number}.trip", "-o", "x.png", *FRONT,
                                says="the cone of a brick's normals is invalid")
        # a cone of unit length that does not hold the normals hides surfels, which --verify finds
        good.bricks[1]["cone_axis"][0] = 0, 0, -1
        good.write_index()
        self.works("render", "good.trip", "-o", "y.png", *FRONT)
        self.fails(1, "info", "good.trip", "--verify", says="outside the cone of its brick")
        # scenes have no sides
        self.works("brick", os.path.join(program.DATASETS, "donut_slice.ply"), "-o", "donut.trip", "-q")
        donut = plain_scene.Scene("donut.trip")
        self.assertFalse(any(b["cone_cosine"].any() or b["cone_axis"].any() for b in donut.bricks))
        donut.bricks[0]["cone_axis"][0], donut.bricks[0]["cone_cosine"][0] = (0, 0, 1), 0.5
        donut.write_index()
        self.leaves_nothing(1, "render", "donut.trip", "-o", "z.png",
                            says="the cone of a brick's normals is invalid")

    def test_an_older_data_set_is_refused(self):
        write_part("ball.ply", 300)
        self.works("brick", "ball.ply", "-o", "old.trip", "-q")
        scene = plain_scene.Scene("old.trip")
        scene.index[8] = 2
        scene.write_index()
        self.leaves_nothing(1, "render", "old.trip", "-o", "x.png", says="version 2 of Gaussian scenes")

    def test_what_does_not_apply_is_refused(self):
        coloured("a.ply", grid(9), (1, 2, 3))
        for options, says in ((("--order", "depth"), "requires --order deferred"),
                              (("--order", "lists"), "requires --order deferred"),
                              (("--renderer", "integral"), "requires --order deferred"),
                              (("--early-termination", "0.1"), "requires --order deferred")):
            self.leaves_nothing(2, "render", "a.ply", "-o", "x.png", *FRONT, *options, says=says)
        donut = os.path.join(program.DATASETS, "donut_slice.ply")
        volume = os.path.join(program.DATASETS, "tooth.nhdr")
        for data in donut, volume:
            self.leaves_nothing(2, "render", data, "-o", "x.png", *FRONT, says="clouds of points only")
        # a translucent cloud stays deferred
        self.assertEqual(self.stats("a.ply", *ORTHO, *FRONT, "--opacity-scale", "0.3")["order"], "deferred")


if __name__ == "__main__":
    program.main()
