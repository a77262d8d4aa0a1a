"""Draws a coarse level of noise. Deviations keep the mean extinction of the voxels, which the test
counts in the volume that it writes."""
import math

import numpy

import program

BLOCK, LONG, SIDE = 4, 1024, 64  # voxels of a block, and of the volume along x, and y and z
MEAN, DEVIATION = 30000, 4000
THRESHOLD = MEAN + 0.7 * DEVIATION
OPACITY = 0.0004  # of a voxel above the threshold


def noise_of_blocks():
    """Returns blocks with values from a normal distribution: z, y, x."""
    shape = (SIDE // BLOCK, SIDE // BLOCK, LONG // BLOCK)
    voxels = numpy.random.default_rng(48).normal(MEAN, DEVIATION, shape).clip(1, 65535)
    for axis in range(3):
        voxels = voxels.repeat(BLOCK, axis)
    return voxels.astype("u2")


class Noise(program.ProgramTest):
    def test_noise_keeps_its_mean_extinction(self):
        # A voxel of level 4 is the mean of 64 blocks. Only 1 in 10^7 of such means shows.
        volume = noise_of_blocks()
        program.write_nrrd("noise.nrrd", volume)
        step = f"{THRESHOLD - 1} 1 1 1 0\n{THRESHOLD} 1 1 1 {OPACITY}\n65535 1 1 1 {OPACITY}\n"
        program.write("step.tf", step.encode())
        self.brick("noise.nrrd", "noise.trip", "--keep-all")
        inside = volume[16:48, 16:48, 8:-8]  # from the first to the last coarse voxel along x
        depth = -math.log(1 - OPACITY) * (inside > THRESHOLD).mean() * inside.shape[2]
        for renderer in "cpu", "reference":
            picture = self.picture(
                "noise.trip", "--renderer", renderer, "--tf", "step.tf", "--view", "left",
                "--ortho", str(SIDE), "--size", "16x16", "--lod", "4.5", "--no-shading",
                "--background", "transparent", "--classify", "post")
            alpha = picture[4:12, 4:12, 3].mean()
            self.assertAlmostEqual(alpha, 1 - math.exp(-depth), delta=0.05 * depth)


if __name__ == "__main__":
    program.main()
