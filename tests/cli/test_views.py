"""Tests of the view options: which side is visible, how it is framed, and that the printed view
equals the drawn view. The tests make the volumes, so that the expected positions are known."""
import json
import math
import os
import shlex

import numpy

import program

# Values from 100 on are opaque, all others are transparent.
FUNCTION = "unit voxel\n99 1 1 1 0\n100 1 1 1 0.9\n255 1 1 1 0.9\n"


def ball(size, radius, middle=None):
    """Returns a solid ball of value 200 in a cube of zeros. `middle` is its centre in voxels; None
    selects the centre of the cube."""
    middle = middle or ((size - 1) / 2,) * 3
    k, j, i = numpy.indices((size, size, size))
    r2 = (i - middle[0]) ** 2 + (j - middle[1]) ** 2 + (k - middle[2]) ** 2
    return numpy.where(r2 <= radius**2, 200, 0).astype(numpy.uint8)


def shown(picture):
    return picture[..., 3] > 0.3


def spans(picture):
    """Returns the first and last visible row and column, as fractions of the picture's height and
    width."""
    rows, columns = numpy.nonzero(shown(picture))
    height, width = picture.shape[:2]
    return (
        (rows.min() / height, (rows.max() + 1) / height),
        (columns.min() / width, (columns.max() + 1) / width),
    )


class Views(program.ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        program.write("f.tf", FUNCTION.encode())

    def volume(self, volume, *options, name="v.trip", spacing="1,1,1"):
        z, y, x = volume.shape
        program.write_raw("v.raw", volume)
        self.works(
            *("brick", "v.raw", "--size", f"{x},{y},{z}", "--type", "uint8", "-o", name),
            *("--spacing", spacing, "--force", "-q", "--tf", "f.tf", *options),
        )

    def draw(self, *options, name="v.trip"):
        return self.picture(name, "--size", "160x160", "--background", "none", *options)

    def camera(self, *options, name="v.trip", size="160x160"):
        """Returns the camera options that --stats prints for each image."""
        run = self.works(
            *("render", name, "-o", "c.exr", "--size", size, "--stats", "-", *options)
        )
        return [shlex.split(f["camera"]) for f in json.loads(run.stdout)["frames"]]

    def assert_centred(self, picture, fill=None):
        for low, high in spans(picture):
            self.assertAlmostEqual(low, 1 - high, delta=0.02)
        if fill:
            self.assertAlmostEqual(
                max(high - low for low, high in spans(picture)), fill, delta=0.05
            )

    def test_the_visible_part_is_centred_and_fills_nine_tenths(self):
        # The ball is far from the centre of the volume, among values that are transparent.
        volume = ball(64, 14, (44, 18, 40))
        volume[volume == 0] = 50
        self.volume(volume, "--keep-all")
        for options in [], ["--ortho=fit"], ["--view=left"], ["--fov=60"], ["--up=1,2,3"]:
            self.assert_centred(self.draw("--tf=f.tf", *options), 0.9)

    def test_the_smaller_side_of_a_picture_is_filled(self):
        self.volume(ball(48, 20))
        for size in "320x100", "100x320":
            picture = self.picture("v.trip", "--size", size, "--background", "none")
            self.assert_centred(picture, 0.9)

    def test_parallel_views_of_given_height_look_at_the_centre(self):
        self.volume(ball(41, 18))
        picture = self.draw("--ortho=41")
        self.assert_centred(picture, 38 / 41)
        alpha = picture[..., 3]
        for side in alpha[0], alpha[-1], alpha[:, 0], alpha[:, -1]:
            self.assertEqual(side.max(), 0)
        # A ball of radius 1.5 world units, with small voxels as in level sets.
        self.volume(ball(64, 30), spacing="0.05,0.05,0.05")
        self.assert_centred(self.draw("--ortho=6"), 0.5)

    def test_a_given_eye_looks_at_the_centre_of_the_visible_part(self):
        self.volume(ball(64, 8, (44, 18, 40)))
        camera = self.camera("--eye=200,150,-90")[0]
        look = [float(x) for x in camera[camera.index("--look") + 1].split(",")]
        for got, expected in zip(look, (44, 18, 40)):
            self.assertAlmostEqual(got, expected, delta=1e-6)
        self.assert_centred(self.draw("--eye=200,150,-90"))

    def test_up_also_moves_the_eye(self):
        """A stick along any axis stands upright if --up points along it."""
        for axis, up in enumerate(("1,0,0", "0,1,0", "0,0,1")):
            volume = numpy.zeros((48, 48, 48), numpy.uint8)
            place = [slice(20, 28)] * 3
            place[2 - axis] = slice(4, 44)
            volume[tuple(place)] = 200
            thick = [slice(16, 32)] * 3
            thick[2 - axis] = slice(34, 44)
            volume[tuple(thick)] = 200  # the stick is thick at the end to which the axis points
            self.volume(volume)
            for sign in "", "-":
                picture = self.draw(f"--up={','.join(sign + x for x in up.split(','))}")
                (top, bottom), (left, right) = spans(picture)
                self.assertAlmostEqual(bottom - top, 0.9, delta=0.05)
                self.assertGreater(bottom - top, 1.5 * (right - left))
                upper, lower = numpy.array_split(shown(picture), 2)
                if sign:
                    upper, lower = lower, upper
                self.assertGreater(upper.sum(), 1.2 * lower.sum(), up)

    def test_views_show_the_named_side(self):
        """Draws a ball with three arms of different lengths. The front is at low y."""
        volume = ball(64, 9)
        volume[30:34, 30:34, 32:62] = 200  # left is +x
        volume[30:34, 12:32, 30:34] = 200  # front
        volume[32:50, 30:34, 30:34] = 200  # top
        self.volume(volume)
        left, front, top = 30, 20, 18
        expected = {  # lengths of the arms to the right, left, top and bottom of the ball's centre
            "front": (left, 9, top, 9),
            "back": (9, left, top, 9),
            "left": (9, front, top, 9),
            "right": (front, 9, top, 9),
            "top": (left, 9, 9, front),
            "bottom": (left, 9, front, 9),
        }
        for view, arms in expected.items():
            camera = self.camera(f"--view={view}", "--ortho=80")[0]
            eye, look = (
                [float(x) for x in camera[camera.index(o) + 1].split(",")]
                for o in ("--eye", "--look")
            )
            picture = self.draw(
                *("--ortho=80", "--up", camera[camera.index("--up") + 1]),
                *("--eye", ",".join(str(e - l + 31.5) for e, l in zip(eye, look))),
                *("--look", "31.5,31.5,31.5"),
            )
            rows, columns = numpy.nonzero(shown(picture))
            voxel = 160 / 80
            got = (columns.max() - 79.5, 79.5 - columns.min(), 79.5 - rows.min(), rows.max() - 79.5)
            for have, want in zip(got, arms):
                self.assertAlmostEqual(have / voxel, want, delta=2.5, msg=f"{view}: {got}")

    def test_the_printed_view_gives_the_same_picture(self):
        volume = ball(40, 9, (25, 12, 20))
        volume[18:22, 10:14, 2:25] = 150
        self.volume(volume, spacing="0.7,1.1,0.3")
        for options in (
            [],
            ["--view=iso", "--zoom=1.7", "--roll=-33.3"],
            ["--azimuth=17", "--elevation=-41", "--ortho=fit"],
            ["--ortho=13.7", "--zoom=0.3", "--up=1,1,0.2"],
            ["--eye=30,-20,9", "--roll=12", "--zoom=2"],
            ["--look=3,2,1", "--fov=77"],
            ["--orbit=3", "--view=top", "--azimuth=5"],
            ["--orbit=3", "--ortho=fit", "--roll=90"],
        ):
            cameras = self.camera("--background=none", *options)
            orbit = "--orbit=3" in options
            for index, camera in enumerate(cameras):
                self.works("render", "v.trip", "-o", "p.exr", "--background=none", *camera)
                with open(f"c-{index:03d}.exr" if orbit else "c.exr", "rb") as f:
                    expected = f.read()
                with open("p.exr", "rb") as f:
                    self.assertEqual(f.read(), expected, options)
            self.assertEqual(len(cameras), 3 if orbit else 1)

    def test_explain_prints_the_same_view_as_stats(self):
        self.volume(ball(24, 9))
        run = self.works("render", "v.trip", "-o", "p.exr", "--size=33x44", "--explain")
        line = [l for l in run.stdout.decode().splitlines() if l.startswith("camera ")]
        self.assertEqual(line[0].split()[1:], self.camera(size="33x44")[0])

    def test_the_view_depends_only_on_data_and_transfer_function(self):
        volume = ball(70, 17, (31, 40, 22))
        volume[volume == 0] = (numpy.arange(volume.size) * 2654435761 % 99)[
            (volume == 0).ravel()
        ]
        cameras = set()
        for brick, render in (
            ([], []),
            (["--tile=16", "--slab-sheets=1"], []),
            (["--tile=128", "--slab-sheets=64"], ["--threads=1"]),
            (["--tile=32"], ["--memory=48M", "--engine=pread"]),
            ([], ["--engine=null"]),
            ([], ["--renderer=reference", "--samples=1", "--lod=0"]),
        ):
            self.volume(volume, "--keep-all", *brick)
            cameras.add(str(self.camera("--tf=f.tf", "--view=iso", *render)))
            cameras.add(str(self.camera("--tf=f.tf", "--view=iso", *render)))
        self.assertEqual(len(cameras), 1)

    def test_a_coarse_level_frames_fog_alike_for_every_layout(self):
        k, j, i = numpy.indices((90, 90, 140))
        r2 = ((i - 69.5) / 69) ** 2 + ((j - 44.5) / 44) ** 2 + ((k - 44.5) / 44) ** 2
        volume = (200 * numpy.clip(1 - r2, 0, 1)).astype(numpy.uint8)
        program.write("fog.tf", b"unit voxel\n0 1 1 1 0\n255 1 1 1 0.003\n")
        cameras = set()
        for brick, render in (
            ([], []),
            (["--tile=16", "--slab-sheets=1"], ["--memory=48M", "--engine=pread"]),
            (["--tile=128", "--slab-sheets=64"], ["--threads=1"]),
        ):
            self.volume(volume, "--tf=fog.tf", *brick)
            cameras.add(str(self.camera("--view=front", *render)))
        self.assertEqual(len(cameras), 1)
        # The visible part of the fog fills nine tenths of the width.
        alpha = self.draw("--view=front")[..., 3]
        columns = numpy.nonzero((alpha >= 8 / 255).any(axis=0))[0]
        self.assertAlmostEqual((columns.max() + 1 - columns.min()) / 160, 0.9, delta=0.03)
        # A data set without coarse levels also has a default view.
        self.volume(volume, "--tf=fog.tf", "--levels=0")
        self.assertGreater(self.draw("--view=front")[..., 3].max(), 0.1)

    def test_zoom_magnifies_about_the_centre(self):
        self.volume(ball(40, 19))
        for options in [], ["--ortho=fit"]:
            for zoom in 0.5, 0.25:
                self.assert_centred(self.draw(f"--zoom={zoom}", *options), 0.9 * zoom)

    def test_azimuth_and_elevation_move_the_eye_from_the_named_side(self):
        self.volume(ball(24, 10))
        camera = self.camera("--view=front", "--azimuth=90", "--ortho=50")[0]
        self.assertEqual(camera, self.camera("--view=left", "--ortho=50")[0])
        camera = self.camera("--view=front", "--elevation=90", "--ortho=50")[0]
        self.assertEqual(camera, self.camera("--view=top", "--ortho=50")[0])
        # The default azimuth is 30 degrees, and the default elevation is 20 degrees.
        camera = self.camera("--view=front", "--azimuth=30", "--elevation=20")[0]
        self.assertEqual(camera, self.camera()[0])

    def test_no_image_of_an_orbit_is_cut_off_and_the_centre_stays(self):
        volume = numpy.zeros((30, 60, 20), numpy.uint8)
        volume[3:27, 2:58, 2:18] = 200
        self.volume(volume)
        most = 0
        for options in [], ["--ortho=fit", "--elevation=20"]:
            cameras = self.camera("--orbit=12", "--background=none", *options)
            looks = {c[c.index("--look") + 1] for c in cameras}
            self.assertEqual(len(looks), 1)
            for i in range(12):
                picture = program.read_exr(f"c-{i:03d}.exr")
                for low, high in spans(picture):
                    self.assertGreater(low, 0.03)
                    self.assertLess(high, 0.97)
                most = max(most, *(high - low for low, high in spans(picture)))
        self.assertGreater(most, 0.85)

    def test_contradictory_options_are_refused(self):
        self.volume(ball(16, 5))
        render = ["render", "v.trip", "-o", "no.png"]
        for options, says in (
            (["--eye=1,2,3", "--view=left"], "--eye"),
            (["--eye=1,2,3", "--azimuth=5"], "--eye"),
            (["--eye=1,2,3", "--elevation=5"], "--eye"),
            (["--eye=90,2,3", "--ortho=fit"], "--ortho"),
            (["--ortho=fit", "--fov=20"], "--fov"),
            (["--zoom=1e-6"], "--zoom"),
            (["--light=head", "--no-shading"], "--light"),
            (["--no-shading", "--light=1,2,3"], "--light"),
        ):
            self.leaves_nothing(2, *render, *options, says=says)

    def test_fitting_the_view_finds_a_damaged_list(self):
        self.volume(ball(16, 5), name="d.trip")
        with open("d.trip/z0.voxels", "r+b") as f:
            f.write(b"\xff\xff\xff\xff")
        self.leaves_nothing(1, "render", "d.trip", "-o", "no.png", says="z0.voxels")

    def error(self, name, *view):
        """Returns the mean and the 99th percentile of the differences from the integral over the
        visible pixels, of 255."""
        options = name, "--size", "200x200", "--background", "none", *view
        drawn = self.picture(*options, "--renderer=cpu", "--samples=1")
        exact = self.picture(*options, "--renderer=integral", "--samples=1")
        apart = 255 * abs(drawn - exact).max(axis=-1)[exact[..., 3] > 1 / 255]
        return apart.mean(), numpy.percentile(apart, 99)

    def test_views_along_an_axis_are_near_the_integral(self):
        """One sample per sheet would be 1.16 from it, and 8.0 at the 99th percentile."""
        self.works("brick", os.path.join(program.DATASETS, "tooth.nhdr"), "-o", "axis.trip", "-q")
        for view in ["--view=front"], ["--view=top"], ["--view=right", "--zoom=2"]:
            mean, most = self.error("axis.trip", "--ortho=fit", *view)
            self.assertLess(mean, 0.65, view)
            self.assertLess(most, 4, view)

    def test_the_sides_of_a_cropped_volume_are_near_the_integral(self):
        """Without the parts of segments at the sides, one pixel in a hundred would be off by 35."""
        raw = os.path.join(program.DATASETS, "tooth.raw")
        tooth = numpy.fromfile(raw, ">u2").reshape(161, 94, 103)[40:100, 25:70, 30:80]
        program.write_nrrd("crop.nrrd", tooth.astype("<u2"))
        self.works("brick", "crop.nrrd", "-o", "crop.trip", "-q")
        for view in ["--azimuth=-10", "--elevation=5"], ["--azimuth=20", "--elevation=-30", "--ortho=fit"]:
            _, most = self.error("crop.trip", *view)
            self.assertLess(most, 9, view)


if __name__ == "__main__":
    program.main()
