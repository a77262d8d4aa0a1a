"""Tests that --light is a direction of the view, and that shadows without a light get one."""
import numpy

import program

SIZE, HEIGHT, RADIUS, MIDDLE = 96, 60.0, 20.0, 23.5
# From the world to left, up and front of a view, by its azimuth. The front of azimuth 0 is -y.
VIEWS = {0: ((0, -1, 0), (0, 0, 1)), 1: ((1, 0, 0), (0, 0, 1)), 2: ((0.6, 0.48, 0.64), (-0.8, 0.36, 0.48)),
         3: ((0, 0, -1), (0, 1, 0))}


class ViewLight(program.ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        k, j, i = numpy.indices((48, 48, 48)) - MIDDLE
        distance = numpy.sqrt(i * i + j * j + k * k)
        ball = numpy.clip(0.5 + (RADIUS - distance) / 6, 0, 1) * 200
        program.write_nrrd("ball.nrrd", ball.astype("f4"))
        # Black matter reflects highlights alone.
        program.write("black.tf", b"values data\n100 0 0 0 0\n100 0 0 0 1\n200 0 0 0 1\n")
        program.write("white.tf", b"values data\n10 1 1 1 0\n200 1 1 1 0.2\n")

    def view(self, number):
        front, up = VIEWS[number]
        text = lambda v: ",".join(repr(float(c)) for c in v)
        return ["--size", f"{SIZE}x{SIZE}", "--ortho", HEIGHT, "--eye",
                text(MIDDLE + 100 * numpy.array(front)), "--look", text([MIDDLE] * 3), "--up", text(up)]

    def test_highlights_lie_where_the_mirror_image_of_the_light_is(self):
        """The normal of a highlight is half way between light and eye."""
        rows, columns = numpy.indices((SIZE, SIZE)) + 0.5
        for renderer in ("cpu", "reference", *program.GL):
            for number, light in (0, (1, 1, 1)), (1, (1, 1, 1)), (2, (-1, 1, 1)), (3, (0, -1, 1)), (2, (1, 0, 0)):
                half = numpy.array(light) / numpy.linalg.norm(light) + (0, 0, 1)
                left, up, _ = half / numpy.linalg.norm(half) * RADIUS * SIZE / HEIGHT
                for form in "ball.nrrd", "again":
                    given = light
                    if form == "again":  # the same light, given in the world
                        front, top = (numpy.array(v) for v in VIEWS[number])
                        world = light[0] * numpy.cross(front, top) + light[1] * top + light[2] * front
                        given = ["world:%r" % float(world[0]), float(world[1]), float(world[2])]
                    option = "--light=" + ",".join(map(str, given))
                    picture = self.picture("ball.nrrd", "--tf", "black.tf", "--renderer", renderer,
                                           "--quality", "high", *self.view(number), option)
                    bright = numpy.clip(picture[..., 0] - 0.5 * picture[..., 0].max(), 0, None)
                    about = (renderer, number, light, form)
                    self.assertGreater(picture[..., 0].max(), 0.1, about)
                    x, y = ((a * bright).sum() / bright.sum() for a in (columns, rows))
                    self.assertLess(abs(x - (SIZE / 2 - left)), 1.0, about)
                    self.assertLess(abs(y - (SIZE / 2 - up)), 1.0, about)

    def test_a_turntable_is_lit_from_the_same_side(self):
        """The ball looks the same from everywhere, so all pictures of a turntable are the same."""
        for light, same in ("1,1,1", True), ("world:1,1,1", False):
            self.works("render", "ball.nrrd", "-o", "turn.exr", "--tf", "white.tf", "--size=64x64",
                       "--orbit", 3, "--effects", "shadows", "--light", light, "--view=front")
            first, *others = (program.read_exr(f"turn-{n:03}.exr") for n in range(3))
            for other in others:
                self.assertEqual(abs(first - other)[..., :3].max() < 0.02, same, light)
            if same:
                left, right = first[:, :32, 0].sum(), first[:, 32:, 0].sum()
                top, bottom = first[:32, :, 0].sum(), first[32:, :, 0].sum()
                self.assertGreater(left, 1.05 * right)
                self.assertGreater(top, 1.05 * bottom)

    def test_shadows_without_a_light_get_one_with_a_note(self):
        draw = "render", "ball.nrrd", "-o", "a.exr", "--tf", "white.tf", "--size=64x64"
        note = "the light for the shadows comes from the upper left front of the view"
        for more in [], ["--orbit", 3], ["--orbit", 3, "--in-flight", 1]:
            run = self.works(*draw, "--effects", "shadows", *more)
            self.assertEqual(run.stderr.count(note), 1, more)
        chosen = self.picture("ball.nrrd", "--tf", "white.tf", "--size=64x64", "--effects=shadows")
        given = self.picture("ball.nrrd", "--tf", "white.tf", "--size=64x64", "--effects=shadows",
                             "--light=1,1,1")
        plain = self.picture("ball.nrrd", "--tf", "white.tf", "--size=64x64")
        self.assertTrue(numpy.array_equal(chosen, given))
        self.assertGreater(abs(chosen - plain).max(), 0.1)
        run = self.works(*draw, "--effects", "shadows", "--light", "world:1,1,1")
        self.assertNotIn(note, run.stderr)
        self.fails(2, *draw, "--effects", "shadows", "--light", "head", says="--light head")

    def test_labels_get_the_same_effects_in_the_first_picture_as_later(self):
        values = numpy.zeros((24, 24, 24), "u1")
        values[4:10, 4:10, 4:10], values[14:20, 12:20, 12:20] = 1, 2
        program.write_nrrd("labels.nrrd", values)
        program.write("solid.tf", b"values data\n0.4 0 0 0 0\n0.5 1 0 0 1\n1.5 1 0 0 1\n1.5 0 1 0 1\n")
        text = self.works("render", "labels.nrrd", "-o", "l.exr", "--tf", "solid.tf", "--size=32x32",
                          "--effects=auto", "--orbit", 2, "--in-flight", 1, "--explain").stdout.decode()
        self.assertEqual(text.count("occlusion   runs: labels are drawn as surfaces"), 2)


if __name__ == "__main__":
    program.main()
