"""Tests of the transitions from one list to the next. `merge` shows no lines within a picture and
no jumps while the camera turns. `clip` shows lines with large kernels, and `axis` jumps."""
import math

import numpy

import program

SIZE, FOV = 300, 20
EYE, LOOK = (25, -11, 29), (7, 7, 7)


def dominant_axes():
    """Returns for each pixel the axis along which its ray is steepest. Only the list along this
    axis has weight 1."""
    forward = numpy.subtract(LOOK, EYE) / numpy.linalg.norm(numpy.subtract(LOOK, EYE))
    right = numpy.cross(forward, (0, 0, 1))
    right /= numpy.linalg.norm(right)
    up = numpy.cross(right, forward)
    at = (numpy.arange(SIZE) + 0.5 - SIZE / 2) * 2 * math.tan(math.radians(FOV / 2)) / SIZE
    rays = forward + at[None, :, None] * right - at[:, None, None] * up
    return abs(rays).argmax(axis=2)


class Transitions(program.ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        values = numpy.random.default_rng(4).integers(60, 250, (15, 15, 15)).astype("u1")
        program.write_nrrd("a.nrrd", values)
        program.write("a.tf", b"values data\n50 0 0.1 1 0\n120 1 0.2 0 0.5\n250 1 1 0.8 0.6\n")
        cls.brick(cls(), "a.nrrd", "a.trip", "--tf", "a.tf")

    def bends_at_borders(self, *method):
        """Returns the ratio of second differences along rows at borders between dominant axes to
        second differences beside the borders."""
        axes = dominant_axes()
        self.assertEqual(len(numpy.unique(axes)), 3)
        picture = self.picture(
            "a.trip",
            "--size",
            f"{SIZE}x{SIZE}",
            "--fov",
            FOV,
            "--no-shading",
            "--eye",
            ",".join(map(str, EYE)),
            "--look",
            ",".join(map(str, LOOK)),
            "--up",
            "0,0,1",
            *method,
        )
        bends = abs(numpy.diff(picture[..., :3].astype(float), 2, axis=1)).sum(axis=2)
        change = axes[:, 1:] != axes[:, :-1]
        border = change[:, 1:] | change[:, :-1]
        beside = numpy.roll(border, 5, 1) | numpy.roll(border, -5, 1)
        return bends[border].mean() / bends[beside & ~border].mean()

    def test_clip_shows_lines_and_merge_does_not(self):
        self.assertGreater(self.bends_at_borders("--classify", "pre", "--method", "clip"), 10)
        # The volume is noise at 20 pixels per voxel. With few samples per sheet, the sheets
        # themselves would be visible.
        for by in ("--classify", "pre"), ("--classify", "post", "--samples-per-sheet", "8"):
            self.assertLess(self.bends_at_borders(*by), 1.5)
            self.assertLess(self.bends_at_borders(*by, "--h", "0.5"), 1.5)

    def change_at_45_degrees(self, *method):
        """Returns the ratio of the picture's change in a small turn across 45 degrees to the change
        in an equal turn just before."""
        pictures = []
        for degrees in 44.85, 44.95, 45.05:
            a = math.radians(degrees)
            eye = 7 + 50 * math.cos(a), 7 + 50 * math.sin(a), 20
            pictures.append(
                self.picture(
                    "a.trip",
                    "--size",
                    "100x100",
                    "--ortho",
                    25,
                    "--eye",
                    ",".join(map(repr, eye)),
                    "--look",
                    "7,7,7",
                    *method,
                )
            )
        before, past = (abs(pictures[i + 1] - pictures[i]).mean() for i in (0, 1))
        return past / before

    def test_axis_jumps_and_merge_does_not(self):
        pre = "--classify", "pre"
        self.assertGreater(self.change_at_45_degrees(*pre, "--method", "axis"), 3)
        for h in "0", "0.5", "0.85":
            for by in pre, ("--classify", "post"):
                self.assertLess(self.change_at_45_degrees(*by, "--h", h), 1.5, (by, h))


if __name__ == "__main__":
    program.main()
