"""Tests that values of OpenVDB grids fall to the background around the outermost active voxels, as
in OpenVDB's own sampler. Pictures of fog and of filled level sets are compared with closed
forms."""
import math
import unittest

import numpy
import program

try:
    import pyopenvdb
except ImportError:
    pyopenvdb = None

OPACITY, VALUE = 0.6, 0.5  # opacity at value 1; value of the fog
EDGE, ZOOM = 8, 4  # voxels of the fog along each axis; pixels per voxel


def depth_of_ramp(a):
    """Returns the optical depth of one voxel length over which the opacity rises from 0 to a."""
    return 1 + (1 - a) / a * math.log1p(-a)


def trapezoid(x):
    """Returns 1 over the voxels of the fog, and 0 from one voxel beyond them on."""
    return min(1.0, max(0.0, min(x + 1, EDGE - x)))


def expected_alpha(x, y):
    a = OPACITY * VALUE * trapezoid(x) * trapezoid(y)
    return 1 - math.exp((EDGE - 1) * math.log1p(-a) - 2 * depth_of_ramp(a)) if a > 1e-9 else 0


@unittest.skipUnless(pyopenvdb, "python3-openvdb is not installed")
class Background(program.ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        with open("linear.tf", "w", encoding="utf-8") as function:
            function.write(f"0 1 1 1 0\n1 1 1 1 {OPACITY}\n")
        fog = pyopenvdb.FloatGrid(0.0)
        fog.name, fog.gridClass = "density", pyopenvdb.GridClass.FOG_VOLUME
        fog.copyFromArray(numpy.full((EDGE, EDGE, EDGE), VALUE, numpy.float32))
        pyopenvdb.write("fog.vdb", [fog])
        ball = pyopenvdb.createLevelSetSphere(radius=10.0, halfWidth=1.2)
        pyopenvdb.write("ball.vdb", [ball])

    def draw(self, data, middle, height, pixels, *options):
        eye = (middle, middle, middle + 100)
        return self.picture(
            data, "--tf", "linear.tf", "--no-shading", "--background", "none", "--ortho", height,
            "--size", f"{pixels}x{pixels}", "--eye", ",".join(map(str, eye)), "--look",
            ",".join(map(str, (middle, middle, middle))), "--up", "0,1,0", *options)[..., 3]

    def ways(self, volume, data):
        """Yields the ways to draw a volume and its data set."""
        one_ray = "--samples-per-sheet", "4", "--samples", "1", "--lod", "0"
        for renderer in "reference", "cpu", *program.GL:
            yield data, "--renderer", renderer, *one_ray
        yield data, "--renderer", "integral", "--samples", "1"
        yield volume, "--renderer", "integral", "--samples", "1", "--field", "source"

    def test_fog_fades_out_beyond_its_last_voxels(self):
        made = self.brick("fog.vdb", "fog.trip", "--tf", "linear.tf")
        self.assertEqual(made["dims"], [EDGE + 2] * 3)
        middle, pixels = (EDGE - 1) / 2, (EDGE + 2) * ZOOM
        at = [middle + (i + 0.5 - pixels / 2) / ZOOM for i in range(pixels)]
        expected = numpy.array([[expected_alpha(x, y) for x in at] for y in at])
        self.assertGreater(expected[pixels // 2, 2], 0.1)  # this pixel is beyond the last voxel
        for data, *how in self.ways("fog.vdb", "fog.trip"):
            alpha = self.draw(data, middle, EDGE + 2, pixels, *how)
            self.assertLess(numpy.abs(alpha - expected).max(), 1 / 255, how)

    def test_a_filled_level_set_with_a_narrow_band_ends_softly(self):
        """The ramp is as wide as the band. The outermost voxels of the band are not yet at 0."""
        made = self.brick("ball.vdb", "ball.trip", "--tf", "linear.tf")
        self.assertEqual(made["dims"][0], made["dims"][2])
        # On the ray through the centre, half of the ramp of 2.4 voxels is inside the sphere.
        inner = 2 * (10 - 1.2) * math.log1p(-OPACITY)
        expected = 1 - math.exp(inner - 2 * 2.4 * depth_of_ramp(OPACITY))
        pictures = [self.draw(data, 0, 26, 52, *how)
                    for data, *how in self.ways("ball.vdb", "ball.trip")]
        for alpha in pictures:
            self.assertAlmostEqual(alpha[26, 26], expected, delta=1 / 255)
            self.assertLess(numpy.abs(alpha - pictures[3]).mean(), 0.2 / 255)
            self.assertLess(numpy.abs(alpha - pictures[3]).max(), 4 / 255)
            self.assertLess(numpy.abs(alpha - alpha[::-1]).max(), 1e-3)
            self.assertLess(numpy.abs(alpha - alpha[:, ::-1]).max(), 1e-3)


if __name__ == "__main__":
    program.main()
