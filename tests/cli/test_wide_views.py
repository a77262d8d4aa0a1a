"""Tests splats in views with very wide angles. A pixel in the middle of the picture spans so much there
that an unlimited low-pass filter would spread every voxel over the whole picture."""
import math

import numpy

import program

SIZE = 60
DISTANCE = 20  # of the eye from the middle of the ball, in voxels
RADIUS = 3


class WideViews(program.ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        z, y, x = numpy.mgrid[:11, :11, :11] - 5.0
        ball = numpy.where(x * x + y * y + z * z <= RADIUS * RADIUS, 200, 0).astype("u1")
        program.write_nrrd("ball.nrrd", ball)
        program.call("brick", "ball.nrrd", "-o", "ball.trip", "-q", "--range=100:255")

    def alpha(self, fov, *options):
        return self.picture("ball.trip", "--classify", "pre", "--size", f"{SIZE}x{SIZE}",
                            "--eye", f"5,{5 - DISTANCE},5", "--look", "5,5,5", "--up", "0,0,1",
                            "--fov", fov, "--no-shading", *options)[..., 3]

    def test_a_ball_covers_no_pixel_far_from_it(self):
        """The kernels of the ball reach less than 2 voxels beyond it, and the filter's rays at most
        half of the way off the axis. All of it lies within the angle asin(5 / 20) and an offset of
        0.5 on the plane at distance 1."""
        reach = math.tan(math.asin((RADIUS + 2) / DISTANCE)) + 1.0
        for fov in 120, 170, 174, 176, 178, 179, 179.9:
            pixel = math.tan(math.radians(fov / 2)) / (SIZE / 2)
            at = numpy.abs(numpy.arange(SIZE) + 0.5 - SIZE / 2)
            far = numpy.maximum(at[:, None], at) * pixel > reach + pixel
            for renderer in "reference", "cpu", *program.GL:
                alpha = self.alpha(fov, "--renderer", renderer)
                self.assertEqual(alpha[far].max(), 0, (fov, renderer))
                middle = alpha[SIZE // 2 - 1 : SIZE // 2 + 1, SIZE // 2 - 1 : SIZE // 2 + 1]
                if pixel < 0.2:
                    self.assertGreater(middle.min(), 0.5, (fov, renderer))


if __name__ == "__main__":
    program.main()
