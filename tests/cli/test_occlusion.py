"""Tests of ambient occlusion of clouds (render/gaussians/openness.h). White points show the openness
as brightness. Expected values come from integrals over even directions, by the exact distance to
the surfaces in each direction, or from closed forms."""
import math
import os
import unittest

import numpy

import program
from test_points import grid, write_cloud

RANGE = 0.25  # of the diagonal of the box of the points


def directions(count=200000):
    """Returns even directions over the upper half of a sphere, and weights: cosine over pi."""
    n = numpy.arange(count) + 0.5
    z, turn = n / count, numpy.pi * (1 + 5**0.5) * n
    r = numpy.sqrt(1 - z * z)
    return numpy.stack([r * numpy.cos(turn), r * numpy.sin(turn), z], 1), 2 * z / count


def meets(origin, way, axis, at, lo, hi):
    """Returns the distances to a rectangle across an axis, or infinity."""
    with numpy.errstate(divide="ignore", invalid="ignore"):
        far = (at - origin[axis]) / way[:, axis]
        point = origin + far[:, None] * way
        inside = far > 1e-9
        for a in range(3):
            if a != axis:
                inside &= (point[:, a] >= lo[a]) & (point[:, a] <= hi[a])
    return numpy.where(inside, far, numpy.inf)


def openness(origin, walls, reach, count=200000):
    """The share of the light from above that reaches a point of a floor with the normal z."""
    way, weight = directions(count)
    near = numpy.min([meets(numpy.asarray(origin, float), way, *wall) for wall in walls], axis=0)
    return 1 - (weight * numpy.exp(-near / reach)).sum()


def reach_of(points):
    return RANGE * numpy.linalg.norm(points.max(axis=0) - points.min(axis=0))


def white(path, points, normals=None, turn=None):
    """Writes white points. `turn` is a matrix."""
    turn = numpy.eye(3) if turn is None else turn
    n = len(points)
    more = {}
    if normals is not None:
        more = dict(zip(("nx", "ny", "nz"), (normals @ turn.T).T))
    write_cloud(path, points @ turn.T, red=[255] * n, green=[255] * n, blue=[255] * n, **more)


def turned(about, degrees):
    """Returns the matrix of a turn about an axis."""
    x, y, z = numpy.asarray(about, float) / numpy.linalg.norm(about)
    k = numpy.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    a = math.radians(degrees)
    return numpy.eye(3) + math.sin(a) * k + (1 - math.cos(a)) * (k @ k)


def sheet(u, v, at, across, step):
    """Returns points of a rectangle across an axis, and their normals."""
    a = numpy.arange(u[0] + step / 2, u[1], step)
    b = numpy.arange(v[0] + step / 2, v[1], step)
    p, q = numpy.meshgrid(a, b)
    points = numpy.insert(numpy.column_stack([p.ravel(), q.ravel()]), across, at, axis=1)
    return points, numpy.eye(3)[[across] * len(points)]


def corner(step):
    """A floor with a wall of height 1 along its edge x = 0."""
    return [numpy.concatenate(both) for both in
            zip(sheet((0, 2), (-2, 2), 0, 2, step), sheet((-2, 2), (0, 1), 0, 0, step))]


CORNER_WALL = (0, 0.0, (-9, -2, 0), (9, 2, 1))
CORNER_VIEW = ((1, 0, 5), (1, 0, 0), 2)  # straight down on the floor, 0.01 a pixel


class Occlusion(program.ProgramTest):
    def view(self, eye, look, height, up=(0, 1, 0), size="200x200", turn=None):
        turn = numpy.eye(3) if turn is None else turn
        place = [f"--{name}={','.join(repr(float(x)) for x in turn @ numpy.asarray(v, float))}"
                 for name, v in (("eye", eye), ("look", look), ("up", up))]
        return (*place, "--ortho", height, "--size", size, "--effects", "occlusion")

    def open(self, path, view, *options, **more):
        """Returns the red channel of an opaque parallel view."""
        picture = self.picture(path, *self.view(*view, **more), *options)
        self.assertGreater(picture[:, :, 3].min(), 0.9)
        return picture[:, :, 0] / picture[:, :, 3]

    def test_the_expected_values_follow_the_closed_form(self):
        """The form factor of a long wall of height h: (1 - d / sqrt(d^2 + h^2)) / 2."""
        wall = (0, 0.0, (-9, -1e4, 0), (9, 1e4, 1))
        for d in 0.02, 0.3, 2.0:
            self.assertAlmostEqual(openness((d, 0, 0), [wall], 1e9), (1 + d / math.hypot(d, 1)) / 2,
                                   delta=0.002)

    def test_a_plane_at_any_angle_does_not_hide_itself(self):
        points, normals = sheet((-1, 1), (-1, 1), 0, 2, 0.01)
        for about, degrees in ((1, 0, 0), 0), ((1, 0, 0), 3), ((1, 0.3, 0), 30), ((1, 0.5, 0.2), 47):
            turn = turned(about, degrees)
            white("plane.ply", points, normals, turn)
            for eye in 5, -5:
                got = self.open("plane.ply", ((0, 0, eye), (0, 0, 0), 1.9), turn=turn)
                self.assertGreater(got.min(), 0.98, (degrees, eye))

    def test_a_wall_hides_half_of_the_floor_beside_it(self):
        """Farther than four cells the floor has the exact openness within 0.06. Nearer, the wall
        counts as up to two cells nearer."""
        points, normals = corner(0.015)
        cell = 4 / 64
        for turn in numpy.eye(3), turned((1, 0.4, 0.3), 33):
            white("corner.ply", points, normals, turn)
            got = self.open("corner.ply", CORNER_VIEW, turn=turn)[90:110]
            for column in 3, 8, 15, 22, 30, 50, 80, 120, 160:
                d = (column + 0.5) * 0.01
                want = openness((d, 0, 0), [CORNER_WALL], reach_of(points), 20000)
                bound = 0.06 if d > 4 * cell else 0.11
                self.assertLess(abs(got[:, column] - want).max(), bound, (d, want, got[:, column]))

    def test_the_bottom_of_a_box_is_darker_at_its_sides(self):
        parts = [sheet((-1, 1), (-1, 1), 0, 2, 0.015)]
        for at in -1, 1:
            for axis in 0, 1:
                points, normals = sheet((-1, 1), (0, 1), at, axis, 0.015)
                parts.append((points, -at * normals))
        points, normals = (numpy.concatenate(part) for part in zip(*parts))
        turn = turned((1, 0.4, 0.3), 33)
        white("box.ply", points, normals, turn)
        got = self.open("box.ply", ((0, 0, 5), (0, 0, 0), 1.98), size="198x198", turn=turn)
        walls = [(axis, float(at), (-1, -1, 0), (1, 1, 1)) for axis in (0, 1) for at in (-1, 1)]
        for x, y in (0, 0), (-0.5, 0), (-0.5, 0.5), (-0.85, 0):
            row, column = (int(99 - 100 * y), int(99 + 100 * x))
            want = openness((x, y, 0), walls, reach_of(points), 20000)
            self.assertLess(abs(got[row - 1:row + 2, column - 1:column + 2] - want).max(), 0.09,
                            (x, y, want))
        self.assertLess(got[5, 5], got[5, 99] - 0.1)

    def test_points_of_any_density_have_the_same_openness(self):
        """A cloud of 1/6 of the points, and one with each point twice. Radii come from neighbours."""
        got = []
        for step, times in (0.01, 1), (0.025, 1), (0.01, 2):
            points, normals = corner(step)
            shift = numpy.repeat(numpy.arange(times), len(points))[:, None] * step / 2
            white("corner.ply", numpy.tile(points, (times, 1)) + shift * [0, 1, 0],
                  numpy.tile(normals, (times, 1)))
            got.append(self.open("corner.ply", CORNER_VIEW)[20:180, 10:])
        for other in got[1:]:
            self.assertLess(abs(other - got[0]).mean(), 0.01)
            self.assertLess(abs(other - got[0]).max(), 0.04)

    def test_memory_threads_renderers_and_orders_agree(self):
        points, normals = corner(0.02)
        white("corner.ply", points, normals)
        view = self.view(*CORNER_VIEW)
        one = self.picture("corner.ply", *view, "--memory", "1G")
        for options in ("--memory", "64M"), ("--threads", "1"), ("--threads", "2"):
            numpy.testing.assert_array_equal(one, self.picture("corner.ply", *view, *options), str(options))
        other = self.picture("corner.ply", *view, "--renderer", "reference")
        self.assertLess(255 * abs(one - other).mean(), 0.05)
        for order in ("--order", "depth"), ("--order", "lists"), ("--order", "sheets", "--sheet", "0.05"), \
                ("--renderer", "integral"), *(("--renderer", gl, "--order", order) for gl in program.GL
                                              for order in ("lists", "deferred")):
            got = self.picture("corner.ply", *view, *order)[20:180, 20:]
            self.assertLess(abs(got[:, :, 0] / got[:, :, 3] - one[20:180, 20:, 0]).mean(), 0.01, order)

    def test_light_follows_the_formula_of_volumes(self):
        points, normals = corner(0.02)
        white("corner.ply", points, normals)
        open_share = self.open("corner.ply", CORNER_VIEW)[90:110, 10:]
        lit = self.open("corner.ply", CORNER_VIEW, "--light", "world:0,0.8660254,0.5")[90:110, 10:]
        half = math.cos(math.radians(30))
        expected = 0.3 * open_share + 0.7 * 0.5 + 0.2 * half**24
        self.assertLess(abs(lit - expected).max(), 0.003)

    def test_objects_occlude_themselves_wherever_they_are(self):
        """A turned, larger object has the openness that it has alone. A lid above it has no effect."""
        points, normals = corner(0.02)
        white("corner.ply", points, normals)
        lid, down = sheet((-3, 3), (-3, 3), 3, 2, 0.05)
        white("lid.ply", lid, down)
        turn = turned((0.2, 1, 0.4), 71)
        matrix = numpy.zeros((4, 4))
        matrix[:3, :3], matrix[3, 3] = 3 * turn, 1
        program.write("scene.json", str({"objects": [
            {"data": "corner.ply", "matrix": matrix.ravel().tolist()},
            {"data": "lid.ply"}]}).replace("'", '"').encode())
        alone = self.open("corner.ply", CORNER_VIEW)
        eye, look, height = CORNER_VIEW
        both = self.open("scene.json", (3 * numpy.array(eye), 3 * numpy.array(look), 3 * height),
                         turn=turn)
        seen = abs(both - alone) < 0.01
        self.assertGreater(seen[20:180, 10:].mean(), 0.98)

    def test_each_side_has_its_own_openness(self):
        """Nothing lies behind a floor with a wall. The object is seen where it lies, and far away."""
        points, normals = corner(0.02)
        white("corner.ply", points, normals)
        shift = numpy.array([3.0, -5, 20])
        matrix = numpy.eye(4)
        matrix[:3, 3] = shift
        program.write("moved.json", str({"objects": [{"data": "corner.ply", "matrix":
                                                      matrix.ravel().tolist()}]}).replace("'", '"').encode())
        for name, to in ("corner.ply", 0 * shift), ("moved.json", shift):
            for lens in (), ("--fov", "5"):
                seen = []
                for height in 5, -5:
                    view = self.view(numpy.array([0.5, 0, height]) + to, numpy.array([0.5, 0, 0]) + to, 0.4,
                                     size="20x20")
                    view = view[:3] + (lens or view[3:5]) + view[5:]
                    seen.append(self.picture(name, *view)[8:12, 8:12, 0])
                want = openness((0.5, 0, 0), [CORNER_WALL], reach_of(points), 20000)
                self.assertLess(abs(seen[0] - want).max(), 0.06, (name, lens))
                self.assertGreater(seen[1].min(), 0.97, (name, lens))

    def test_it_costs_nothing_unless_asked_and_is_kept(self):
        points, normals = corner(0.02)
        white("corner.ply", points, normals)
        plain = self.stats("corner.ply", "--size", "40")
        self.assertNotIn("light_bytes_read", plain["frames"][0])
        self.assertNotIn("effects", plain)
        stats = self.stats("corner.ply", "--size", "40", "--effects", "occlusion", "--orbit", "3",
                           "--in-flight", "1")
        self.assertEqual(stats["effects"], ["occlusion"])
        self.assertEqual([frame["light_bytes_read"] for frame in stats["frames"]],
                         [24 * len(points), 0, 0])
        said = self.works("render", "corner.ply", "-o", "a.png", "--size", "40", "--effects", "occlusion",
                          "--explain").stdout.decode()
        self.assertIn("occlusion   runs: asked for", said)
        self.assertRegex(said, r"light +41 x 73 x 25 nodes, 0.06\d* apart: the finest level")

    def test_clouds_of_one_point_and_strays_are_drawn(self):
        write_cloud("one.ply", [[1, 2, 3]], red=[255], green=[255], blue=[255])
        self.works("render", "one.ply", "-o", "one.png", "--size", "20", "--effects", "occlusion")
        points, normals = sheet((-1, 1), (-1, 1), 0, 2, 0.02)
        far = numpy.concatenate([points, [[0, 0, 1e6]]])
        white("far.ply", far, numpy.concatenate([normals, normals[:1]]))
        got = self.open("far.ply", ((0, 0, 5), (0, 0, 0), 1.8), "--clip-box", "-2,-2,-2,2,2,2")
        self.assertGreater(got.min(), 0.98)

    def test_it_is_refused_where_it_does_not_apply(self):
        white("a.ply", grid(4))
        scene = os.path.join(program.DATASETS, "train-1000.ply")
        for name, options, says in (
                (scene, ("--effects", "occlusion"), "clouds of points have occlusion"),
                ("a.ply", ("--light-cells", "64"), "requires --effects shadows, occlusion"),
                ("a.ply", ("--effects", "occlusion,shadows"), "must be occlusion, edl, auto or none")):
            self.leaves_nothing(2, "render", name, "-o", "no.png", *options, says=says)
        self.leaves_nothing(1, "render", "a.ply", "-o", "no.png", "--effects", "occlusion", "--light-cells",
                            "1024", "--memory", "32M", says="raise --memory or lower --light-cells")


if __name__ == "__main__":
    program.main()
