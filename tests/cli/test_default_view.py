"""Tests `brick` and `render` without options on every included data set. The picture is not blank,
is centred, is not cropped, and is upright."""
import os

import numpy

import program


def brightness(picture):
    return picture[..., :3].max(axis=2) * 1.0


class DefaultView(program.ProgramTest):
    def draw(self, name, *options):
        self.works("brick", os.path.join(program.DATASETS, name), "-o", "a.trip", "-q", "--force")
        return self.picture("a.trip", "--size", "256x256", "--background", "0,0,0", *options)

    def check(self, name, *options):
        picture = brightness(self.draw(name, *options))
        shows = picture > 0.03
        rows, columns = numpy.nonzero(shows)
        self.assertGreater(shows.mean(), 0.05, name)
        self.assertGreater(picture.max(), 0.4, name)
        rim = numpy.concatenate([picture[0], picture[-1], picture[:, 0], picture[:, -1]])
        self.assertLess(rim.max(), 2 / 255, name)  # so faint values are not visible
        # The visible part is centred and fills nine tenths of one side.
        spans = [c.max() - c.min() + 1 for c in (rows, columns)]
        self.assertGreater(max(spans), 256 * 0.87, name)
        self.assertLess(max(spans), 256 * 0.93, name)
        for at in rows, columns:
            self.assertLess(abs((at.max() + at.min()) / 2 - 127.5), 256 * 0.02, name)
        return picture

    def test_included_data_sets_are_framed(self):
        for name in "tooth.nhdr", "stent.nrrd", "wdas_cloud_sixteenth.vdb", "densityAndHeat.vdb":
            self.check(name)

    def test_a_single_slice_is_upright_and_seen_from_the_front(self):
        picture = numpy.full((30, 40), 90, "u1")
        picture[:10, :12], picture[15, 20] = 250, 0  # bright at the top left
        for name, shape in ("k", (1, 30, 40)), ("j", (30, 1, 40)), ("i", (30, 40, 1)):
            upright = picture if name == "k" else picture[::-1]  # k points up
            program.write_nrrd(f"{name}.nrrd", upright.reshape(shape))
            self.works("brick", f"{name}.nrrd", "-o", "a.trip", "-q", "--force", "--keep-all")
            drawn = self.picture("a.trip", "--size=120x120", "--tf=grey", "--no-shading",
                                 "--opacity-scale=50")[..., 0]
            rows, columns = numpy.nonzero(drawn > 0.05)
            height, width = numpy.ptp(rows) + 1, numpy.ptp(columns) + 1
            self.assertLess(abs(height / width - 30 / 40), 0.06, name)
            rows, columns = numpy.nonzero(drawn > 0.6 * drawn.max())
            self.assertLess(rows.max(), 62, name)
            self.assertLess(columns.max(), 55, name)

    def test_wide_and_tall_pictures_are_not_cropped(self):
        self.works(
            "brick", os.path.join(program.DATASETS, "tooth.nhdr"), "-o", "a.trip", "-q", "--force"
        )
        for size in "400x100", "100x400", "64x64":
            picture = brightness(self.picture("a.trip", "--size", size, "--background", "0,0,0"))
            rim = numpy.concatenate([picture[0], picture[-1], picture[:, 0], picture[:, -1]])
            self.assertEqual(rim.max(), 0, size)
            self.assertGreater((picture > 0.03).mean(), 0.03, size)

    def test_no_image_of_a_turntable_is_cropped(self):
        self.works(
            "brick", os.path.join(program.DATASETS, "stent.nrrd"), "-o", "a.trip", "-q", "--force"
        )
        self.works("render", "a.trip", "-o", "turn.exr", "--size", "120x120", "--orbit", "6")
        for i in range(6):
            alpha = program.read_exr(f"turn-{i:03d}.exr")[..., 3]
            rim = numpy.concatenate([alpha[0], alpha[-1], alpha[:, 0], alpha[:, -1]])
            self.assertEqual(rim.max(), 0)
            self.assertGreater((alpha > 0.1).mean(), 0.02)

    def test_the_tooth_is_upright(self):
        """The crown is the broad and bright end. It is at the top."""
        picture = brightness(self.draw("tooth.nhdr"))
        rows = numpy.nonzero((picture > 0.03).any(axis=1))[0]
        upper = picture[rows.min() : (rows.min() + rows.max()) // 2]
        lower = picture[(rows.min() + rows.max()) // 2 : rows.max() + 1]
        self.assertGreater(upper.sum(), 1.5 * lower.sum())
        self.assertGreater((upper > 0.03).sum(), (lower > 0.03).sum())

    def test_smoke_is_grey_and_translucent(self):
        for name in "wdas_cloud_sixteenth.vdb", "densityAndHeat.vdb":
            picture = self.draw(name, "--background", "none")
            covered = picture[picture[..., 3] > 0.1]
            colour = covered[:, :3] / covered[:, 3:]
            self.assertLess((colour.max(axis=1) - colour.min(axis=1)).max(), 0.2)
            partly = (picture[..., 3] > 0.05) & (picture[..., 3] < 0.8)
            self.assertGreater(partly.sum(), 0.1 * (picture[..., 3] > 0.05).sum())


if __name__ == "__main__":
    program.main()
