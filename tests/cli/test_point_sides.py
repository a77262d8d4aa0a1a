"""Tests of the sides of normals that clouds without normals and scanners get. Expected sides are those of
known surfaces."""
import os
import subprocess

import numpy

import program
from test_points import write_cloud

PRINT = os.environ["TRIP_PRINT_SURFELS"]


def torus(count, seed, noise=0.0):
    """Returns random points of a torus with radii 2 and 0.6, and their outward normals."""
    r = numpy.random.default_rng(seed)
    u, w = r.uniform(0, 2 * numpy.pi, (2, count))
    normals = numpy.column_stack([numpy.cos(u) * numpy.cos(w), numpy.sin(u) * numpy.cos(w), numpy.sin(w)])
    ring = 2 * numpy.column_stack([numpy.cos(u), numpy.sin(u), 0 * u])
    return ring + 0.6 * normals + r.normal(0, noise, (count, 3)), normals


class Sides(program.ProgramTest):
    def surfels(self, *arguments):
        """Returns positions and normals."""
        self.works("brick", *arguments, "-q")
        out = subprocess.run([PRINT, arguments[-1]], check=True, stdout=subprocess.PIPE).stdout
        rows = numpy.frombuffer(out).reshape(-1, 6)
        return rows[:, :3], rows[:, 3:]

    def right(self, normals, expected):
        return ((normals * expected).sum(axis=1) > 0).mean()

    def outward(self, at):
        """The outward normals of a torus."""
        ring = at * [1, 1, 0]
        return at - 2 * ring / numpy.linalg.norm(ring, axis=1)[:, None]

    def test_normals_of_closed_surfaces_point_outwards(self):
        """Most points of a torus do not see outwards from its middle. The cloud has several tiles."""
        for noise, share in (0, 1), (0.02, 0.99):
            write_cloud("torus.ply", torus(20000, 1, noise)[0])
            at, normals = self.surfels("torus.ply", "-o", f"torus{noise}.trip")
            self.assertGreaterEqual(self.right(normals, self.outward(at)), share)
            middle = self.right(numpy.sign((normals * at).sum(axis=1))[:, None] * normals, self.outward(at))
            self.assertLess(middle, 0.7)

    def test_each_of_several_surfaces_has_its_side(self):
        apart = numpy.array([0, 0, 9])
        write_cloud("two.ply", numpy.concatenate([torus(9000, 2)[0], torus(9000, 3)[0] + apart]))
        at, normals = self.surfels("two.ply", "-o", "two.trip")
        at = numpy.where(at[:, 2:] > 4.5, at - apart, at)
        self.assertEqual(self.right(normals, self.outward(at)), 1)

    def test_land_without_a_flight_faces_up(self):
        """Steep hills, whose slopes a view from far above leaves to chance."""
        x, y = numpy.random.default_rng(4).uniform(-3, 3, (2, 20000))
        z = 2 * numpy.sin(3 * x) * numpy.cos(2 * y)
        program.write("land.xyz", "".join(f"{a:.6f} {b:.6f} {c:.6f}\n" for a, b, c in zip(x, y, z)).encode())
        at, normals = self.surfels("land.xyz", "-o", "land.trip")
        up = numpy.column_stack([-6 * numpy.cos(3 * at[:, 0]) * numpy.cos(2 * at[:, 1]),
                                 4 * numpy.sin(3 * at[:, 0]) * numpy.sin(2 * at[:, 1]), numpy.ones(len(at))])
        self.assertGreater(self.right(normals, up), 0.995)

    def test_normals_of_a_file_keep_their_sides(self):
        points, normals = torus(5000, 5)
        sides = numpy.random.default_rng(6).choice([-1, 1], 5000)
        own = dict(zip(("nx", "ny", "nz"), (normals * sides[:, None]).T))
        write_cloud("own.ply", points, **own)
        at, got = self.surfels("own.ply", "-o", "own.trip")
        row_of = {tuple(p): i for i, p in enumerate(numpy.round(points, 4))}
        rows = [row_of.get(tuple(p)) for p in numpy.round(at, 4)]
        found = [(i, k) for i, k in enumerate(rows) if k is not None]
        self.assertGreater(len(found), 2000)
        mine, theirs = numpy.array(found).T
        self.assertEqual(self.right(got[mine], (normals * sides[:, None])[theirs]), 1)

    def test_few_points_have_sides(self):
        for name, points in ("one", [[0, 0, 0]]), ("same", [[0, 0, 0]] * 300), ("line", [[i, 0, 0] for i in range(40)]):
            write_cloud(name + ".ply", points)
            self.assertTrue(numpy.isfinite(self.surfels(name + ".ply", "-o", name + ".trip")[1]).all())


if __name__ == "__main__":
    program.main()
