"""Tests of eye-dome lighting of clouds and Gaussian scenes. Expected pictures come from a NumPy
computation on the plain picture and its distances, or from closed forms."""
import math
import os
import unittest

import numpy

import program
from test_points import grid, write_cloud

LAMP = os.path.join(program.DATASETS, "lamp.ply")
HEIGHT = 3.0  # of parallel views


def levels(distances, view):
    """The levels of pixels, from their distances."""
    size = len(distances)
    if view == "parallel":
        return distances * 2 * math.tan(math.radians(15)) / (HEIGHT * math.log(2))
    at = (numpy.arange(size) + 0.5 - size / 2) * 2 * math.tan(math.radians(15)) / size
    return numpy.log2(distances / numpy.sqrt(1 + at[:, None] ** 2 + at[None, :] ** 2))


def darkened(plain, distances, view, strength=0.4, radius=1.4):
    """Applies the definition to a premultiplied picture."""
    size = len(plain)
    level = levels(distances.astype(float), view)
    total = numpy.zeros((size, size))
    for i in range(8):
        right, down = (int(round(radius * f(i * math.pi / 4))) for f in (math.cos, math.sin))
        for y in range(size):
            for x in range(size):
                ny, nx = y + down, x + right
                if 0 <= ny < size and 0 <= nx < size and level[ny, nx] < level[y, x] < math.inf:
                    total[y, x] += plain[ny, nx, 3] * (level[y, x] - level[ny, nx])
    out = plain.astype(float)
    out[:, :, :3] *= numpy.exp(-300 * strength / 8 * total)[:, :, None]
    return out


class EyeDome(program.ProgramTest):
    def with_distances(self, *arguments):
        self.works("render", *arguments, "-o", "p.exr", "--depth", "d.exr",
                   program=program.QUICK_PROGRAM)
        _, distances = program.read_exr_channels("d.exr")
        return program.read_exr("p.exr"), distances[:, :, 0].astype(float)

    def assert_near(self, a, b, about):
        self.assertLess(255 * numpy.abs(a - b).max(), 0.02, about)

    def test_every_renderer_and_order_follows_the_definition(self):
        views = {"perspective": (), "parallel": ("--ortho", HEIGHT)}
        some = ("--edl-strength", "1.5", "--edl-radius", "3")
        for renderer, order, view, edl in (
                ("cpu", "depth", "perspective", ()), ("cpu", "depth", "parallel", some),
                ("cpu", "lists", "perspective", some), ("cpu", "sheets", "perspective", ()),
                ("reference", "depth", "perspective", some),
                *((gl, "lists", "perspective", ()) for gl in program.GL)):
            draw = (LAMP, "--size", "72x72", *views[view], "--renderer", renderer, "--order", order,
                    *(("--sheet", "0.05") if order == "sheets" else ()))
            plain, distances = self.with_distances(*draw)
            self.assertGreater((plain[:, :, 3] > 0.5).mean(), 0.1)
            numbers = {"strength": 1.5, "radius": 3} if edl else {}
            expected = darkened(plain, distances, view, **numbers)
            self.assertGreater(numpy.abs(expected - plain).mean(), 0.003)
            one, same = self.with_distances(*draw, "--effects", "edl", *edl)
            self.assert_near(one, expected, (renderer, order, view))
            self.assertTrue((same == distances).all())
            two = self.picture(*draw, "--effects", "edl", *edl)
            self.assertTrue((one == two).all())

    def test_several_rays_darken_before_their_mean(self):
        draw = (LAMP, "--lod", "0", "--size")
        fine = darkened(*self.with_distances(*draw, "96x96"), "perspective", radius=2 * 1.4)
        expected = fine.reshape(48, 2, 48, 2, 4).mean(axis=(1, 3))
        self.assert_near(self.picture(*draw, "48x48", "--samples", "2", "--effects", "edl"),
                         expected, "")

    def test_a_wall_that_faces_the_eye_stays_bright(self):
        write_cloud("wall.ply", grid(40))
        for view in ("--fov", "60"), ("--ortho", "2"):
            draw = ("wall.ply", "--size", "65x65", "--eye", "0,0,1.5", "--look", "0,0,0", *view)
            plain, edl = self.picture(*draw), self.picture(*draw, "--effects", "edl")
            self.assertGreater(plain[:, :, 3].mean(), 0.5)
            self.assert_near(plain, edl, view)

    def test_a_step_darkens_its_far_side(self):
        """Three of eight neighbours of a pixel beside the step are on the near wall."""
        wall = grid(80)
        points = wall + numpy.where(wall[:, :1] < 0, [[0, 0, 0.5]], [[0, 0, 0]])
        write_cloud("step.ply", points)
        draw = ("step.ply", "--size", "65x65", "--eye", "0,0,5", "--look", "0,0,0", "--up", "0,1,0")
        plain, edl = (self.picture(*draw, *options) for options in
                      ((), ("--effects", "edl", "--edl-radius", "8", "--edl-strength", "0.05")))
        (row,) = edl[32:33, :, 0] / plain[32:33, :, 0]
        expected = math.exp(-300 * 0.05 / 8 * 3 * math.log2(5 / 4.5))
        self.assertLess(abs(row[35:38] - expected).max(), 0.01, row)
        self.assertLess(abs(row[45:60] - 1).max(), 1e-4, row)
        self.assertLess(abs(row[8:29] - 1).max(), 1e-4, row)

    def test_the_background_keeps_its_colour(self):
        draw = (LAMP, "--size", "64x64", "--effects", "edl")
        bare, white = self.picture(*draw), self.picture(*draw, "--background", "white")
        self.assert_near(white[:, :, :3], bare[:, :, :3] + 1 - bare[:, :, 3:], "")
        full = self.picture(*draw, "--normalise", "--background", "white")
        covered = bare[:, :, 3] > 0.01
        self.assert_near(full[covered][:, :3], bare[covered][:, :3] / bare[covered][:, 3:], "")

    def test_clouds_without_light_get_it_automatically(self):
        write_cloud("a.ply", grid(6))
        for options, runs in ((("--no-shading",), True), ((), False), (("--renderer", "integral"), False)):
            stats = self.stats("a.ply", "--size", "8", "--effects", "auto", *options)
            self.assertEqual(stats.get("effects"), ["edl"] if runs else None, options)

    def test_it_is_refused_where_it_does_not_apply(self):
        write_cloud("a.ply", grid(4))
        program.write_nrrd("v.nrrd", numpy.zeros((4, 4, 4), "u1"))
        for name, options, says in (
                ("v.nrrd", ("--effects", "edl"), "edl applies to Gaussian scenes"),
                ("v.nrrd", ("--effects", "auto", "--edl-radius", 2), "applies to Gaussian scenes"),
                ("a.ply", ("--effects", "edl", "--renderer", "integral"), "edl does not apply"),
                (LAMP, ("--effects", "edl,auto", "--renderer", "integral"), "edl does not apply"),
                ("a.ply", ("--effects", "edl,cueing"), "must be occlusion, edl, auto or none"),
                ("a.ply", ("--edl-strength", "1"), "requires --effects edl"),
                ("a.ply", ("--edl-radius", "1"), "requires --effects edl"),
                ("a.ply", ("--effects", "edl", "--edl-strength", "0"), "--edl-strength"),
                ("a.ply", ("--effects", "edl", "--edl-radius", "0.5"), "--edl-radius")):
            self.leaves_nothing(2, "render", name, "-o", "no.png", *options, says=says)


if __name__ == "__main__":
    program.main()
