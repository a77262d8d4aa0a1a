"""Tests volumes in which every voxel has the same value, so that the range of codes has no length.
The opacity along a ray follows from the opacity of this value."""
import numpy
import program

VOXELS, OPACITY, COLOUR = 12, 0.1, (0.2, 0.4, 0.8)
ACROSS = ("--size=9x9", "--ortho=4", "--eye=5.5,5.5,100", "--look=5.5,5.5,5.5", "--up=0,1,0",
          "--no-shading", "--background=0,0,0,0")


class Constant(program.ProgramTest):
    def assert_through(self, value, voxels, bound, *options):
        """Checks every pixel against the opacity along `voxels` voxel lengths. No pixel is near the
        border."""
        alpha = 1 - (1 - OPACITY)**voxels
        picture = self.picture("a.trip", *ACROSS, *options)
        expected = numpy.append(numpy.array(COLOUR) * alpha, alpha)
        self.assertLess(abs(picture - expected).max(), bound, (value, options))

    def test_a_constant_volume_is_drawn_as_one_body(self):
        for dtype, value in ("u1", 7), ("<u2", 40000), ("f4", -3.5):
            program.write_nrrd("a.nrrd", numpy.full((VOXELS,) * 3, value, dtype))
            entry = " ".join(map(str, COLOUR + (OPACITY,)))
            program.write("a.tf", f"{value} {entry}\n{value + 1} {entry}\n".encode())
            run = self.works("brick", "a.nrrd", "--tf", "a.tf", "-q", "--force")
            self.assertIn("every voxel has the value", run.stderr)
            for renderer in "cpu", "reference", *program.GL:
                by = "--renderer=" + renderer
                self.assert_through(value, VOXELS - 1, 1e-5, by, "--classify=post")
                self.assert_through(value, VOXELS, 0.005, by, "--classify=pre")
            self.assert_through(value, VOXELS - 1, 1e-6, "--renderer=integral", "--samples=1")


if __name__ == "__main__":
    program.main()
