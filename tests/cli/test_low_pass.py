"""Tests the width of the low-pass filter. A parallel view of one voxel has a footprint in closed form
(render/splat.h): a Gaussian with the variances of kernel and filter, cut off at 10/3 deviations."""
import numpy
import program

SIZE, PIXELS_PER_VOXEL, OPACITY = 48, 4.0, 0.6
CUT_OFF = 10 / 3
OPTIONS = [f"--size={SIZE}x{SIZE}", f"--ortho={SIZE / PIXELS_PER_VOXEL}", "--eye=2,2,30",
           "--look=2,2,2", "--up=0,1,0", "--no-shading", "--background=none", "--tf=tf.txt",
           "--classify=pre"]


def footprint(width):
    """Returns the opacity of each pixel. The voxel lies at the centre of the picture."""
    kernel, edge = (2 / CUT_OFF * PIXELS_PER_VOXEL) ** 2, numpy.exp(-CUT_OFF**2 / 2)
    both = kernel + width**2
    at = numpy.arange(SIZE) + 0.5 - SIZE / 2
    m = (at[:, None] ** 2 + at[None, :] ** 2) / both
    depth = (-numpy.log(1 - OPACITY) * PIXELS_PER_VOXEL**2 / (2 * numpy.pi * both)
             * (numpy.exp(-m / 2) - edge) / (1 - edge * (1 + CUT_OFF**2 / 2)))
    return numpy.where(m <= CUT_OFF**2, -numpy.expm1(-depth), 0)


class LowPass(program.ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        volume = numpy.zeros((5, 5, 5), "u1")
        volume[2, 2, 2] = 255
        program.write_nrrd("a.nrrd", volume)
        program.write("tf.txt", b"values data\nunit voxel\n254 1 1 1 0\n255 1 1 1 0.6\n")

    def test_every_renderer_draws_the_width_that_is_given(self):
        given = [([], 0.4), (["--low-pass=none"], 0), (["--low-pass=ewa"], 0.4)]
        given += [([f"--low-pass-width={w}"], w) for w in (0, 0.4, 1, 2.5)]
        for renderer in ("reference", "cpu", *program.GL):
            for kernel in "exact", "ewa":
                for options, width in given:
                    picture = self.picture("a.nrrd", f"--renderer={renderer}", f"--kernel={kernel}",
                                           *OPTIONS, *options)
                    error = abs(picture[..., 3] - footprint(width)).max()
                    self.assertLess(error, 1e-5 if renderer == "reference" else 1 / 255,
                                    (renderer, kernel, options))

    def test_widths_change_the_picture_by_far_more_than_the_bound(self):
        peaks = [footprint(width).max() for width in (0, 0.4, 1, 2.5)]
        self.assertGreater(min(-numpy.diff(peaks)), 1e-3)
        self.assertGreater(peaks[0] - peaks[2], 4 / 255)

    def test_scaling_to_the_width_enlarges_the_whole_kernel(self):
        # The kernel's deviation is 2.4 pixels. Scaled to 5 pixels, it is like a filter of
        # sqrt(5^2 - 2.4^2) pixels.
        picture = self.picture("a.nrrd", "--renderer=reference", "--kernel=ewa", *OPTIONS,
                               "--low-pass=uniform", "--low-pass-width=5")
        expected = footprint((25 - 2.4**2) ** 0.5)
        self.assertLess(abs(picture[..., 3] - expected).max(), 1e-5)

    def test_a_width_without_a_filter_is_refused(self):
        self.leaves_nothing(2, "render", "a.nrrd", "-o", "b.png", "--low-pass=none",
                            "--low-pass-width=1", says="does not apply to --low-pass none")

    def test_the_plan_names_another_width(self):
        said = self.works("render", "a.nrrd", "-o", "b.png", "--size=9x9", "--explain",
                          "--low-pass-width=1").stdout.decode()
        self.assertRegex(said, "(?m)^low-pass    the filter's standard deviation is 1 pixel")


if __name__ == "__main__":
    program.main()
