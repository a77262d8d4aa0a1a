"""Tests of Gaussian scenes: bricking, drawing, the cache, descriptions and refusals. The pictures are
compared with tests/gaussians/definition.py, which has no code of the program."""
import glob
import json
import math
import os
import shutil
import signal
import sys
import time
import unittest

import numpy

import program

sys.path.insert(0, os.path.join(os.environ["TRIP_SOURCE_DIR"], "tests", "gaussians"))
import definition  # noqa: E402

FLAT = 1 / (2 * math.sqrt(math.pi))  # the harmonic of degree 0
MEAN, MOST = 0.1, 2.0  # of 255


def names_of(degree):
    rest = 3 * ((degree + 1) ** 2 - 1)
    return (["x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2"] + [f"f_rest_{i}" for i in range(rest)]
            + ["opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"])


def write_scene(path, rows, degree=0):
    """Writes a PLY as trainers do. A row has the columns of names_of(degree)."""
    names = names_of(degree)
    rows = numpy.asarray(rows, "<f4").reshape(-1, len(names))
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {len(rows)}"]
    lines += [f"property float {name}" for name in names] + ["end_header", ""]
    program.write(path, "\n".join(lines).encode() + rows.tobytes())


def row(centre, colour=(1, 0, 0), opacity=0.5, deviations=(0.1, 0.1, 0.1), turn=(1, 0, 0, 0)):
    """Returns a row of degree 0. A colour is a display value."""
    return [*centre, *((c - 0.5) / FLAT for c in colour), math.log(opacity / (1 - opacity)),
            *numpy.log(deviations), *turn]


def many(count, spread=1.0, seed=1, degree=0):
    """Returns rows of Gaussians of all shapes and colours in a ball."""
    r = numpy.random.default_rng(seed)
    rest = 3 * ((degree + 1) ** 2 - 1)
    return numpy.column_stack([
        r.normal(0, spread / 2, (count, 3)), r.normal(0, 1, (count, 3)),
        r.normal(0, 0.2, (count, rest)), r.normal(0, 1.5, count),
        r.uniform(-4.5, -2.5, (count, 3)) + math.log(spread), r.normal(0, 1, (count, 4))])


def orders():
    """Returns the names that --order takes for scenes, by the line that refuses another one."""
    said = program.call("render", "x.trip", "-o", "x.png", "--order=nonsense").stderr
    names = said.strip().rpartition("use one of ")[2].split(", ")
    assert names[:2] == ["depth", "lists"], said
    return [name for name in names if name != "deferred"]  # of clouds alone


def options_of(view):
    """Returns the options of a view of definition.py."""
    out = ["--eye", ",".join(map(repr, map(float, view["eye"]))),
           "--look", ",".join(map(repr, map(float, view["look"]))),
           "--up", ",".join(map(repr, map(float, view["up"]))),
           "--size", "{}x{}".format(*view["size"])]
    if view.get("ortho_height"):
        return [*out, "--ortho", repr(float(view["ortho_height"]))]
    return [*out, "--fov", repr(float(view["fov"]))]


def view_of(eye, look=(0, 0, 0), up=(0, -1, 0), size=(96, 64), fov=45, **more):
    return {"eye": numpy.array(eye, float), "look": numpy.array(look, float),
            "up": numpy.array(up, float), "size": size, "fov": fov, **more}


class Gaussians(program.ProgramTest):
    def scene(self, name, rows, degree=0):
        """Writes and bricks a scene."""
        write_scene(name + ".ply", rows, degree)
        shutil.rmtree(name + ".trip", ignore_errors=True)
        self.works("brick", name + ".ply", "-o", name + ".trip", "-q")
        return name + ".trip"

    def distances(self, data_set, *options):
        self.works("render", data_set, "-o", "picture.exr", "--depth", "z.exr", *options)
        return program.read_exr_channels("z.exr")[1][..., 0]

    def apart(self, data_set, ply, view, *options):
        """Returns the mean and the largest difference from the definition, in 1/255."""
        expected = definition.draw(definition.read_ply(ply), view)
        self.assertGreater(expected[:, :, 3].mean(), 0.005)
        picture = self.picture(data_set, *options_of(view), *options)
        apart = 255 * numpy.abs(picture - expected)
        return apart.mean(), apart.max()

    def expect_definition(self, data_set, ply, view, mean=MEAN, most=MOST):
        for renderer in "cpu", "reference", *program.GL:
            found = self.apart(data_set, ply, view, "--renderer", renderer)
            self.assertLess(found[0], mean, (renderer, view))
            self.assertLess(found[1], most, (renderer, view))

    # ---- pictures ----

    def test_the_given_scenes_are_drawn_by_their_definition(self):
        """The data set rounds its numbers, and the bounds are the same as without rounding."""
        for name in "donut_slice", "train-1000":
            ply = os.path.join(program.DATASETS, name + ".ply")
            self.works("brick", ply, "-o", name + ".trip", "-q", "--force")
            scene = definition.read_ply(ply)
            lo, hi = numpy.percentile(scene["centre"], [2, 98], axis=0)
            middle, radius = (lo + hi) / 2, max(numpy.linalg.norm(hi - lo) / 2, 0.2)
            for turn in 0.4, 2.5, 4.6:
                away = numpy.array([math.cos(turn), -0.3, math.sin(turn)])
                view = view_of(middle + 2.2 * radius * away, middle, size=(120, 80))
                self.expect_definition(name + ".trip", ply, view)

    def test_a_generated_scene_with_harmonics_is_drawn_by_its_definition(self):
        data = self.scene("many", many(3000, degree=3), 3)
        self.expect_definition(data, "many.ply", view_of((1.5, -1, 3)))

    def test_a_parallel_view_is_drawn_by_its_definition(self):
        data = self.scene("parallel", many(2000))
        view = view_of((1.5, -1, 3), ortho_height=2.5)
        self.expect_definition(data, "parallel.ply", view)

    def test_a_view_from_inside_is_drawn_by_its_definition(self):
        data = self.scene("inside", many(4000, spread=4))
        self.expect_definition(data, "inside.ply", view_of((0.1, 0.2, 0.1), (1, 0.1, 0.4), fov=80))

    def test_each_degree_is_the_scene_without_the_higher_coefficients(self):
        rows = many(1500, degree=3)
        data = self.scene("degrees", rows, 3)
        view = view_of((1.5, -1, 3))
        for degree in range(4):
            cut = numpy.array(rows)
            names = names_of(3)
            for channel in range(3):
                for i in range((degree + 1) ** 2 - 1, 15):
                    cut[:, names.index(f"f_rest_{15 * channel + i}")] = 0
            write_scene("cut.ply", cut, 3)
            mean, most = self.apart(data, "cut.ply", view, "--sh", degree)
            self.assertLess(mean, MEAN, degree)
            self.assertLess(most, MOST, degree)

    def test_lists_draw_one_gaussian_as_depth_does(self):
        data = self.scene("one", [row((0, 0, 0), (0.9, 0.4, 0.1), 0.8, (0.3, 0.1, 0.2))])
        for view in view_of((1, -0.8, 3)), view_of((1, -0.8, 3), ortho_height=2):
            depth = self.picture(data, *options_of(view))
            lists = self.picture(data, *options_of(view), "--order", "lists")
            self.assertGreater(depth[:, :, 3].max(), 0.7)
            self.assertLess(255 * numpy.abs(depth - lists).max(), 0.01)

    def test_lists_draw_gaussians_of_one_direction_in_their_order(self):
        """Along z, the list of z has all of the weight at the middle pixel."""
        data = self.scene("row", [row((0, 0, 0), (1, 0, 0), 0.6), row((0, 0, 1), (0, 1, 0), 0.6),
                                  row((0, 0, -1), (0, 0, 1), 0.6)])
        view = view_of((0, 0, 4), size=(33, 33), up=(0, 1, 0))
        picture = self.picture(data, *options_of(view), "--order", "lists")
        numpy.testing.assert_allclose(picture[16, 16, :3], [0.24, 0.6, 0.096], atol=0.01)

    def test_early_termination_ends_where_it_is_given(self):
        """A Gaussian that would leave less transmittance than T is not added. Each has 0.99 at its
        centre, so 1, 2 and 3 of them leave 1e-2, 1e-4 and 1e-6."""
        data = self.scene("deep", [row((0, 0, z), (1, 1, 1), 0.99, (0.5, 0.5, 0.5)) for z in (-1, 0, 1)])
        view = view_of((0, 0, 9), size=(33, 33), up=(0, 1, 0))
        for renderer in "cpu", "reference", *program.GL:
            for given, left in (0.05, 1), (1e-3, 1e-2), (0, 1e-6):
                alpha = self.picture(data, *options_of(view), "--renderer", renderer,
                                     "--early-termination", given)[16, 16, 3]
                self.assertAlmostEqual(1 - alpha, left, delta=0.06 * left + 2e-7, msg=(renderer, given))

    def test_what_is_hidden_is_not_read(self):
        """A wall closes all pixels. The picture is that of the wall, and bricks behind it stay unread."""
        wall = [row((x, y, 3 + z / 100), (1, 0.5, 0), 0.99, (1, 1, 0.01)) for x in range(-4, 5)
                for y in range(-4, 5) for z in range(4)]
        behind = many(100000)
        alone, both = self.scene("wall", wall), self.scene("walled", [*wall, *behind])
        views = view_of((0, 0, 8), size=(60, 40), up=(0, 1, 0), fov=30), \
            view_of((0, 0, 8), size=(60, 40), up=(0, 1, 0), ortho_height=3)
        for view in views:
            for options in ((), ("--order", "lists"), *(("--renderer", gl) for gl in program.GL)):
                one, two = (self.picture(d, *options_of(view), "--lod", "0", *options) for d in (alone, both))
                self.assertLess(255 * numpy.abs(one - two).max(), 0.5, options)
            read, whole = (self.stats(both, *options_of(view), "--lod", "0", "--renderer", r)["frames"][0]
                           for r in ("cpu", "reference"))
            self.assertLess(4 * read["bytes_read"], whole["bytes_read"])
            self.assertLess(4 * read["gaussians"], whole["gaussians"])

    def test_the_renderers_agree_in_both_orders(self):
        data = self.scene("both", many(3000, degree=1), 1)
        for order in "depth", "lists":
            one, *others = (self.picture(data, *options_of(view_of((1.5, -1, 3))), "--order", order,
                                         "--renderer", renderer)
                            for renderer in ("cpu", "reference", *program.GL))
            for other in others:
                self.assertLess(255 * numpy.abs(one - other).max(), 1, order)

    def test_far_coordinates_give_the_same_picture(self):
        """The shift is a sum of powers of two, so that the floats of the file hold it exactly."""
        rows = numpy.array(many(2000))
        rows[:, :3] = numpy.round(rows[:, :3] * 2) / 2  # steps that floats have near 4 million
        shift = numpy.array([500000, 4000000, 64])
        near = self.scene("near", rows)
        moved = rows.copy()
        moved[:, :3] += shift
        far = self.scene("far", moved)
        view = view_of((2.3, -1.7, 5.1))
        there = view_of(view["eye"] + shift, shift)
        for options in (), ("--order", "lists"), *(("--renderer", r) for r in ("reference", *program.GL)):
            a = self.picture(near, *options_of(view), *options)
            b = self.picture(far, *options_of(there), *options)
            self.assertGreater(a[:, :, 3].mean(), 0.05)
            self.assertLess(255 * numpy.abs(a - b).max(), 1, options)

    def test_stray_gaussians_spoil_neither_the_view_nor_the_picture(self):
        strays = [row((2e7, 0, 0)), row((0, -2e7, 1)), row((-2e7, 2e7, -2e7))]
        stray = self.scene("stray", numpy.vstack([many(2000), strays]))
        self.expect_definition(stray, "stray.ply", view_of((1.5, -1, 3)))
        default = self.picture(stray, "--size", "64")
        self.assertGreater(default[:, :, 3].mean(), 0.1)

    def test_the_default_view_of_one_gaussian_shows_all_of_it(self):
        data = self.scene("alone", [row((5, 5, 5), opacity=0.9)])
        seen = self.picture(data, "--size", "64")[:, :, 3]
        self.assertGreater(seen.max(), 0.88)
        self.assertLess(max(seen[0].max(), seen[-1].max(), seen[:, 0].max(), seen[:, -1].max()), 0.01)

    def test_a_camera_path_moves_through_a_scene(self):
        data = self.scene("path", many(500))
        keys = [{"seconds": t, "eye": [x, 0, 4], "look": [0, 0, 0], "up": [0, -1, 0], "fov": 40}
                for t, x in ((0, -1), (1, 1))]
        program.write("path.json", json.dumps({"triptych_path": 1, "frames_per_second": 2, "keys": keys}).encode())
        self.works("render", data, "--size", "40", "--path", "path.json", "-o", "f.exr")
        for frame, x in ("f-000.exr", -1), ("f-002.exr", 1):
            alone = self.picture(data, *options_of(view_of((x, 0, 4), size=(40, 40), fov=40)))
            numpy.testing.assert_allclose(program.read_exr(frame), alone, atol=1e-3)

    def test_gl_draws_all_that_cpu_draws(self):
        program.need_gl()
        data = self.scene("options", many(3000, degree=2), 2)
        view = options_of(view_of((1.5, -1, 3)))
        for options in ((), ("--kernel", "exact"), ("--kernel", "ewa"), ("--sh", "0"),
                        ("--opacity-scale", "0.3"), ("--samples", "3"), ("--normalise",),
                        ("--background", "0.2,0.4,0.6"), ("--clip-plane", "1,0.2,0,0.1"),
                        ("--order", "lists", "--kernel", "exact"), ("--ortho", "3"),
                        ("--ortho", "3", "--order", "lists", "--kernel", "exact")):
            given = [*view[:-2], *options] if "--ortho" in options else [*view, *options]
            one, other = (self.picture(data, *given, "--renderer", r) for r in ("gl", "cpu"))
            self.assertGreater(other[:, :, 3].mean(), 0.05)
            self.assertLess(255 * numpy.abs(one - other).max(), 1, options)

    def test_gl_draws_the_distances_of_cpu(self):
        program.need_gl()
        data = self.scene("distances", many(3000))
        for order in "depth", "lists":
            for options in (), ("--ortho", "3"):
                one, other = (self.distances(data, "--size", "64", "--order", order, *options,
                                             "--renderer", r) for r in ("gl", "cpu"))
                self.assertEqual(numpy.isinf(one).tolist(), numpy.isinf(other).tolist())
                seen = numpy.isfinite(other)
                self.assertGreater(seen.sum(), 500)
                numpy.testing.assert_allclose(one[seen], other[seen], rtol=0.005)

    def test_the_background_lies_behind_and_normalise_removes_the_transmittance(self):
        data = self.scene("red", [row((0, 0, 0), (1, 0, 0), 0.5, (3, 3, 3))])
        view = options_of(view_of((0, 0, 4), size=(9, 9), fov=10))
        plain = self.picture(data, *view)
        numpy.testing.assert_allclose(plain[4, 4], [0.5, 0, 0, 0.5], atol=0.005)
        blue = self.picture(data, *view, "--background", "0,0,1")
        numpy.testing.assert_allclose(blue[4, 4], [0.5, 0, 0.5, 1], atol=0.005)
        whole = self.picture(data, *view, "--normalise")
        numpy.testing.assert_allclose(whole[4, 4], [1, 0, 0, 1], atol=0.005)

    def test_a_clip_box_removes_the_centres_outside(self):
        data = self.scene("two", [row((-0.5, 0, 0), (1, 0, 0)), row((0.5, 0, 0), (0, 1, 0))])
        left = self.scene("left", [row((-0.5, 0, 0), (1, 0, 0))])
        view = options_of(view_of((0, 0, 4), up=(0, 1, 0)))
        for order in "depth", "lists":
            cut = self.picture(data, *view, "--order", order, "--clip-box", "-1,-1,-1,0,1,1")
            one = self.picture(left, *view, "--order", order)
            self.assertGreater(one[:, :, 3].max(), 0.4)
            self.assertLess(255 * numpy.abs(cut - one).max(), 1, order)

    # ---- palette ----

    def test_a_palette_keeps_the_picture_of_a_scene_that_fits_into_it(self):
        ply = os.path.join(program.DATASETS, "train-1000.ply")
        rows = many(3000, degree=3)
        write_scene("fits.ply", rows, 3)
        for path in ply, "fits.ply":
            sizes, pictures = [], []
            for how in "auto", "palette", "whole":
                run = self.works("brick", path, "-o", "p.trip", "--force", "--json", "--harmonics", how)
                made = json.loads(run.stdout)
                sizes.append(made["bytes"])
                self.assertEqual(made["palette_entries"] > 0, how != "whole")
                self.assertLess(255 * made["palette_error"], 0.4)
                self.works("info", "--verify", "p.trip")
                pictures.append([self.picture("p.trip", "--size", "90", "--azimuth", a, "--sh", sh)
                                 for a in (0, 130) for sh in (1, 3)])
            self.assertLess(sizes[1], 0.7 * sizes[2])
            self.assertEqual(sizes[0], sizes[1])
            apart = 255 * numpy.abs(numpy.array(pictures[1]) - pictures[2])
            self.assertLess(apart.mean(), 0.05)
            self.assertLess(apart.max(), 2)

    def test_the_palette_states_the_error_of_colours(self):
        """100000 sets without any likeness do not fit, so auto keeps them whole. Noise of 0.2 has the
        mean square 0.2^2 * 15 / (4 pi) over all directions, of which a palette keeps the most."""
        write_scene("unlike.ply", many(100000, degree=3), 3)
        stated = {}
        for how in "auto", "palette":
            run = self.works("brick", "unlike.ply", "-o", how + ".trip", "--force", "--json",
                             "--harmonics", how)
            stated[how] = json.loads(run.stdout)
        self.assertEqual(stated["auto"]["palette_entries"], 0)
        self.assertEqual(stated["palette"]["palette_entries"], 65536)
        error = 255 * stated["palette"]["palette_error"]
        noise = 255 * 0.2 * math.sqrt(15 / (4 * math.pi))
        self.assertGreater(error, noise / 4)
        self.assertLess(error, 1.5 * noise)
        whole, palette = (self.picture(how + ".trip", "--size", "90") for how in ("auto", "palette"))
        # A pixel mixes Gaussians, so it changes less than their colours.
        self.assertLess(255 * numpy.abs(whole - palette)[:, :, :3].mean(), error)

    # ---- levels ----

    def test_a_far_scene_has_the_mean_of_its_picture(self):
        """Many rays per pixel show the mean. Each pixel of the far picture sees many Gaussians."""
        rows = numpy.array(many(60000))
        rows[:, 7:10] = math.log(0.012)
        rows[:, 6] = math.log(0.06 / 0.94)  # opacity 0.06
        data = self.scene("distant", rows)
        for view in view_of((20, -9, 30), size=(20, 20), fov=6), \
                view_of((20, -9, 30), size=(20, 20), ortho_height=4):
            mean = self.picture(data, *options_of(view), "--lod", "0", "--samples", "32")
            for options in (), ("--order", "lists"), ("--renderer", "reference"):
                fine = self.picture(data, *options_of(view), "--lod", "0", *options)
                coarse = self.picture(data, *options_of(view), "--lod", "1", *options)
                apart = [255 * numpy.abs(p - mean).mean() for p in (fine, coarse)]
                self.assertLess(apart[1], 0.25 * apart[0], options)
                self.assertLess(apart[1], 3, options)
                self.assertAlmostEqual(coarse[:, :, 3].mean(), mean[:, :, 3].mean(), delta=0.01)
            drawn = [self.stats(data, *options_of(view), "--lod", lod)["frames"][0] for lod in (0, 1)]
            self.assertLess(3 * drawn[1]["gaussians"], drawn[0]["gaussians"])
            self.assertLess(3 * drawn[1]["bytes_read"], drawn[0]["bytes_read"])

    def test_a_near_view_has_the_same_bits_with_levels(self):
        data = self.scene("close", many(60000))
        view = options_of(view_of((2.4, -0.9, 3), size=(200, 150)))
        fine = self.picture(data, *view, "--lod", "0")
        for options in (), ("--lod", "auto"), ("--lod", "1"):
            self.assertTrue((fine == self.picture(data, *view, *options)).all())
        self.assertFalse((fine == self.picture(data, *view, "--lod", "100")).all())

    def test_samples_make_the_pixels_of_levels_smaller(self):
        data = self.scene("sampled", many(60000))
        view = options_of(view_of((8, -3, 14), size=(20, 20), fov=20))
        drawn = [self.stats(data, *view, *options)["frames"][0]["gaussians"] for options in
                 (("--lod", "1"), ("--lod", "1", "--samples", "8"), ("--lod", "0"))]
        self.assertLess(drawn[0], drawn[2])
        self.assertEqual(drawn[0], drawn[1])

    def test_no_frame_jumps_while_the_eye_moves_away(self):
        """Two frames 1 % apart differ by at most twice as much as without levels."""
        data = self.scene("zoom", many(60000))
        jumps = []
        for lod in "0", "1":
            frames, distance = [], 17.0
            while distance < 26:
                view = view_of((0.6 * distance, -0.3 * distance, 0.74 * distance), size=(80, 80), fov=30)
                frames.append(self.picture(data, *options_of(view), "--lod", lod))
                distance *= 1.01
            jumps.append(max(255 * numpy.abs(a - b).mean() for a, b in zip(frames, frames[1:])))
        self.assertLess(jumps[1], 2 * jumps[0])

    # ---- overlapping Gaussians ----

    OVERLAPPING = ("--renderer", "integral"), ("--order", "sheets"), \
        ("--order", "sheets", "--renderer", "reference")

    def test_overlapping_orders_draw_one_gaussian_as_depth_does(self):
        data = self.scene("one", [row((0, 0, 0), (0.9, 0.4, 0.1), 0.8, (0.3, 0.1, 0.2))])
        for view in view_of((1, -0.8, 3)), view_of((1, -0.8, 3), ortho_height=2), view_of((0.2, 0, 0.4)):
            depth = self.picture(data, *options_of(view))
            self.assertGreater(depth[:, :, 3].max(), 0.7)
            for options in self.OVERLAPPING:
                other = self.picture(data, *options_of(view), *options)
                self.assertLess(255 * numpy.abs(depth - other).max(), 0.02, options)

    def test_gaussians_apart_lie_over_one_another(self):
        data = self.scene("apart", [row((0, 0, 0), (1, 0, 0), 0.6, (0.1, 0.1, 0.1)),
                                    row((0, 0, 1), (0, 1, 0), 0.6, (0.1, 0.1, 1e-12))])
        view = view_of((0, 0, 4), size=(33, 33), up=(0, 1, 0))
        for options in self.OVERLAPPING:
            picture = self.picture(data, *options_of(view), *options)
            numpy.testing.assert_allclose(picture[16, 16], [0.24, 0.6, 0, 0.84], atol=2e-3, err_msg=str(options))

    def test_equal_gaussians_mix_by_their_optical_depths(self):
        a = -math.log(1 - 0.7), -math.log(1 - 0.4)
        total, share = 1 - 0.3 * 0.6, a[0] / sum(a)
        for thickness in 0.1, 1e-12:
            deviations = 0.1, 0.1, thickness
            data = self.scene("equal", [row((0, 0, 0), (1, 0, 0), 0.7, deviations),
                                        row((0, 0, 0), (0, 1, 0), 0.4, deviations)])
            view = view_of((0, 0, 2), size=(33, 33), up=(0, 1, 0))
            for options in self.OVERLAPPING:
                picture = self.picture(data, *options_of(view), *options)
                numpy.testing.assert_allclose(picture[16, 16], [share * total, (1 - share) * total, 0, total],
                                              atol=2e-3, err_msg=str(options))

    def test_the_integral_is_a_fine_quadrature(self):
        """The data set rounds its numbers, and the bounds are those of the other orders."""
        rows = numpy.array(many(60))
        rows[:, 7:10] += 1.5
        data = self.scene("quadrature", rows)
        scene = definition.read_ply("quadrature.ply")
        for view in view_of((1.5, -1, 3), size=(18, 12)), view_of((0.2, 0.1, 0.3), size=(12, 8)), \
                view_of((1.5, -1, 3), size=(18, 12), ortho_height=2.5):
            expected = definition.overlap(scene, view)
            self.assertGreater(expected[:, :, 3].mean(), 0.1)
            ordered = definition.draw(scene, view)
            apart = 255 * numpy.abs(self.picture(data, *options_of(view), "--renderer", "integral") - expected)
            self.assertLess(apart.mean(), MEAN, view)
            self.assertLess(apart.max(), MOST, view)
            self.assertGreater(255 * numpy.abs(ordered - expected).mean(), 5 * apart.mean(), view)

    def test_thin_sheets_come_close_to_the_integral(self):
        """Halving the thickness divides the error by 2 at least. From inside, footprints that are
        limited at the border of the picture keep a difference."""
        rows = numpy.array(many(2000))
        rows[:, 7:10] += 0.7
        data = self.scene("thin", rows)
        inside = view_of((0.1, 0.2, 0.1), (1, 0.1, 0.4), fov=110)
        for view in view_of((1.5, -1, 3)), view_of((1.5, -1, 3), ortho_height=2.5), inside:
            truth = self.picture(data, *options_of(view), "--renderer", "integral")
            errors = [255 * numpy.abs(truth - self.picture(
                data, *options_of(view), "--order", "sheets", *thickness)).mean()
                for thickness in (("--sheet", 0.2), ("--sheet", 0.1), ("--sheet", 0.05), ())]
            self.assertGreater(errors[0], 0.4)
            for coarse, fine in zip(errors, errors[1:]):
                self.assertLess(fine, coarse / (1 if view is inside else 2), errors)
            self.assertLess(errors[-1], 0.25 if view is inside else 0.05)

    def test_cpu_and_reference_draw_the_same_sheets(self):
        data = self.scene("sheets", many(1500, degree=1), 1)
        for more in (), ("--kernel", "exact"), ("--kernel", "ewa"), ("--h", "0"), ("--method", "axis"):
            one, two = (self.picture(data, *options_of(view_of((1.5, -1, 3))), "--order", "sheets", "--sheet",
                                     "0.01", *more, "--renderer", renderer) for renderer in ("cpu", "reference"))
            self.assertGreater(one[:, :, 3].mean(), 0.05)
            self.assertLess(255 * numpy.abs(one - two).max(), 0.1, more)

    def test_sheets_have_the_same_bits_in_every_run(self):
        data = self.scene("sheet-bits", many(20000, spread=3))
        options = [data, "--size", "150x130", "--order", "sheets", "--sheet", "0.02"]
        first = self.picture(*options)
        for more in ("--threads", "1"), ("--threads", "5"), ("--memory", "40M"):
            self.assertTrue((first == self.picture(*options, *more)).all(), more)
        integral = [self.picture(data, "--size", "60", "--renderer", "integral", "--threads", n) for n in (1, 5)]
        self.assertTrue((integral[0] == integral[1]).all())
        widest = os.environ.get("TRIPTYCH_ISA")
        try:
            for isa in "plain", "avx2", "avx512":
                os.environ["TRIPTYCH_ISA"] = isa
                run = program.call("render", *options, "-o", "isa.exr", program=program.QUICK_PROGRAM)
                if run.returncode == 0:
                    self.assertTrue((first == program.read_exr("isa.exr")).all(), isa)
                else:
                    self.assertNotEqual(isa, "plain")
        finally:
            os.environ.pop("TRIPTYCH_ISA")
            if widest:
                os.environ["TRIPTYCH_ISA"] = widest

    def test_sheets_and_the_integral_refuse_a_scene_that_does_not_fit(self):
        data = self.scene("wide", many(100000))
        for options in self.OVERLAPPING[:2]:
            self.leaves_nothing(1, "render", data, "--size", "64", "-o", "a.png", "--memory", "12M",
                                *options, says="raise --memory")

    def test_the_distance_by_sheets_is_the_one_of_the_gaussians(self):
        data = self.scene("distance", [row((0, 0, 0), opacity=0.9, deviations=(0.3, 0.3, 0.01))])
        for renderer in "cpu", "reference":
            self.works("render", data, *options_of(view_of((0, 0, 4), size=(9, 9), fov=2)), "--order", "sheets",
                       "--renderer", renderer, "-o", "a.exr", "--depth", "d.exr", program=program.QUICK_PROGRAM)
            names, z = program.read_exr_channels("d.exr")
            self.assertEqual(names, [b"Z"])
            self.assertAlmostEqual(float(z[4, 4, 0]), 4, delta=1e-3)

    # ---- measuring ----

    def test_bench_times_the_orders_and_a_sort(self):
        data = self.scene("bench", many(20000))
        report = json.loads(self.works("bench", "orders", data, "--size", "64", "--repeat", "1", "--json").stdout)
        orders = {row["order"]: row for row in report["tables"]["orders"]["rows"]}
        self.assertEqual(list(orders), ["depth", "lists", "sheets", "integral"])
        for name, row in orders.items():
            self.assertGreater(row["ms"], 0)
            self.assertGreaterEqual(row["bytes_read"], 24 * row["gaussians"], name)
        self.assertEqual(orders["depth"]["gaussians"], 20000)
        rows = report["tables"]["sort"]["rows"]
        self.assertEqual(rows[-1]["gaussians"], 20000)
        self.assertEqual({row["same"] for row in rows}, {"yes"})

    def test_accuracy_compares_the_orders(self):
        """Two Gaussians at one place have a closed form in each order; the first one of equals is in front."""
        rows = [row((0, 0, 0), (1, 0, 0), 0.5), row((0, 0, 0), (0, 1, 0), 0.5)]
        data = self.scene("pair", rows)
        shutil.rmtree("pair.accuracy", ignore_errors=True)
        run = self.works("accuracy", data, "--size", "32", "--views", "2", "--repeat", "1")
        self.assertIn("sheets, integral", run.stdout.decode())
        with open("pair.accuracy/accuracy.json") as file:
            report = json.load(file)
        pairs = {r["pair"]: r for r in report["differences"]}
        self.assertEqual(len(pairs), 6)
        # At the centre: red 0.5 and green 0.25 over one another, 0.375 each as a mixture.
        for pair in "depth, sheets", "depth, integral", "lists, sheets", "lists, integral":
            self.assertAlmostEqual(pairs[pair]["max"], 255 * 0.125, delta=2, msg=pair)
        for pair in "depth, lists", "sheets, integral":
            self.assertLess(pairs[pair]["max"], 0.05, pair)
        self.assertTrue(all(r["ms"] > 0 for r in report["orders"]))
        with open("pair.accuracy/index.html") as file:
            self.assertEqual(file.read().count("<img"), 4 + 6)
        with open("pair.accuracy/accuracy.csv") as file:
            self.assertEqual(len(file.read().split()), 5 + 6 + 7)
        for options in ("--source", "a.nrrd"), ("--steps",), ("--settings", "all"), ("--tolerance", "1e-3"), \
                       ("--budget", "3"), ("--compare", "none"), ("--no-shading",), ("--tf", "bone"):
            self.leaves_nothing(2, "accuracy", data, "-o", "r", *options, says="does not apply to Gaussian scenes")

    # ---- runs ----

    def test_threads_and_memory_change_no_bit(self):
        data = self.scene("bits", many(60000))
        for order in "depth", "lists":
            for lod in "0", "60":
                pictures = [self.picture(data, "--size", "150x130", "--order", order, "--lod", lod, *o)
                            for o in ((), ("--threads", "1"), ("--threads", "5"), ("--memory", "60M"))]
                for other in pictures[1:]:
                    self.assertTrue((pictures[0] == other).all(), order)

    def test_brick_gives_the_same_bytes_with_any_threads_and_memory(self):
        write_scene("twice.ply", many(60000))
        files = []
        for name, options in ("a.trip", ()), ("b.trip", ("--threads", 1, "--memory", "8M")), \
                             ("c.trip", ("--threads", 3)), ("d.trip", ()):
            shutil.rmtree(name, ignore_errors=True)
            self.works("brick", "twice.ply", "-o", name, "-q", *options)
            files.append({})
            for path in sorted(glob.glob(name + "/*")):
                with open(path, "rb") as file:
                    files[-1][os.path.basename(path)] = file.read()
        self.assertGreater(len(files[0]), 1)
        for other in files[1:]:
            self.assertTrue(other == files[0])

    def test_a_turntable_has_the_pictures_of_single_views(self):
        data = self.scene("turn", many(1000))
        self.works("render", data, "--size", "40", "--orbit", "3", "-o", "o.exr",
                   program=program.QUICK_PROGRAM)
        pictures = [program.read_exr(f"o-{i:03}.exr") for i in range(3)]
        run = self.works("render", data, "--size", "40", "--orbit", "3", "-o", "p.exr",
                         "--stats", "-")
        for i, frame in enumerate(json.loads(run.stdout)["frames"]):
            alone = self.picture(data, *frame["camera"].split())
            numpy.testing.assert_allclose(pictures[i], alone, atol=1e-4)
            self.assertTrue((pictures[i] == program.read_exr(f"p-{i:03}.exr")).all())
        for a, b in (0, 1), (1, 2), (0, 2):
            self.assertGreater(numpy.abs(pictures[a] - pictures[b]).max(), 0.1)

    def test_the_statistics_count_the_gaussians(self):
        data = self.scene("stats", many(1000))
        stats = self.stats(data, "--size", "40", "--order", "lists")
        self.assertEqual((stats["order"], stats["kernel"]), ("lists", "projected"))
        self.assertEqual(stats["frames"][0]["gaussians"] % 1000, 0)
        self.assertEqual(self.stats(data, "--size", "40", "--kernel", "ewa")["kernel"], "ewa")

    def test_memory_stays_within_its_bound(self):
        write_scene("million.ply", many(1000000, spread=10))
        run = self.works("brick", "million.ply", "-o", "million.trip", "--memory", "64M", "--json",
                         timeout=300)
        os.remove("million.ply")
        program_itself = 32 << 20
        if not program.SANITIZED:
            self.assertLess(json.loads(run.stdout)["peak_rss_bytes"], (64 << 20) + program_itself)
        for order in "depth", "lists":
            stats = self.stats("million.trip", "--size", "128", "--order", order, "--memory", "64M")
            self.assertLessEqual(stats["memory_peak_bytes"], 64 << 20, order)
            if not program.SANITIZED:
                self.assertLess(stats["peak_rss_bytes"], (64 << 20) + program_itself, order)
        for renderer in "cpu", *program.GL:
            self.fails(1, "render", "million.trip", "--size", "128", "-o", "a.png", "--memory", "4M",
                       "--renderer", renderer, says="raise --memory")
        for order in ("depth", "lists") if program.GL else ():
            stats = self.stats("million.trip", "--size", "128", "--order", order, "--memory", "64M",
                               "--renderer", "gl")
            self.assertLessEqual(stats["memory_peak_bytes"], 64 << 20, order)
        shutil.rmtree("million.trip")

    def test_ctrl_c_ends_a_run_soon_and_leaves_nothing(self):
        write_scene("long.ply", many(400000, spread=10))
        for command in ("brick", "long.ply", "-o", "long.trip"), \
                       *(("render", "long.ply", "--samples", "8", "-o", "long.png", "--renderer", r)
                         for r in ("cpu", *program.GL)):
            run = program.start(*command)
            program.await_handler(run)
            time.sleep(0.1)
            sent = time.monotonic()
            run.send_signal(signal.SIGINT)
            _, err = run.communicate(timeout=30)
            if not program.SANITIZED:
                self.assertLess(time.monotonic() - sent, 1, command)
            self.assertEqual(run.returncode, 1, (command, err))
            self.assertIn(b"interrupted", err)
            self.assertEqual([n for n in os.listdir(".") if n.startswith("long")], ["long.ply"])
        os.remove("long.ply")

    # ---- files ----

    def test_a_scene_file_is_bricked_once_into_the_cache(self):
        write_scene("cached.ply", many(500))
        first = self.works("render", "cached.ply", "-o", "a.exr", "--size", "40")
        self.assertIn(b"bricked into the cache", first.stdout)
        one = program.read_exr("a.exr")
        shutil.copy("cached.ply", "copy.ply")
        for name in "cached.ply", "copy.ply":
            again = self.works("render", name, "-o", "a.exr", "--size", "40")
            self.assertNotIn(b"bricked into the cache", again.stdout)
            self.assertTrue((one == program.read_exr("a.exr")).all())
        listed = self.works("cache", "list").stdout
        self.assertIn(b"1 data set", listed)
        write_scene("cached.ply", many(500, seed=2))
        changed = self.works("render", "cached.ply", "-o", "a.exr", "--size", "40")
        self.assertIn(b"bricked into the cache", changed.stdout)
        self.assertFalse((one == program.read_exr("a.exr")).all())

    def test_info_describes_the_data_set(self):
        rows = many(700, degree=2)
        data = self.scene("info", rows, 2)
        info = self.info(data)
        self.assertEqual((info["gaussians"], info["degree"]), (700, 2))
        lo, hi = numpy.float32(rows[:, :3]).min(0), numpy.float32(rows[:, :3]).max(0)
        numpy.testing.assert_allclose(info["bounds"], [lo, hi], atol=1e-5)
        self.assertEqual(info["source"]["input"], "info.ply")
        self.assertEqual(info["bytes"], sum(os.path.getsize(f) for f in glob.glob(data + "/*")))
        text = self.works("info", "--verify", data).stdout.decode()
        self.assertIn("triptych render info.trip -o NAME.png", text)
        self.assertIn("every page and record is intact", text)

    def test_verify_finds_a_changed_byte(self):
        data = self.scene("damaged", many(2000))
        path = max(glob.glob(data + "/*"), key=os.path.getsize)
        with open(path, "r+b") as file:
            file.seek(os.path.getsize(path) // 3)
            byte = file.read(1)
            file.seek(-1, os.SEEK_CUR)
            file.write(bytes([byte[0] ^ 1]))
        self.fails(1, "info", "--verify", data)

    def test_bench_flies_through_a_scene(self):
        data = self.scene("flown", many(300))
        report = json.loads(self.works("bench", "flight", data, "--seconds", "0.4", "--size", "90x60", "--json").stdout)
        self.assertEqual(report["settings"]["gaussians"], 300)
        rest, = report["tables"]["rest"]["rows"]
        self.assertEqual(rest["differ"], 0)
        self.assertGreater(rest["first_ms"], 0)
        self.fails(2, "bench", "flight", data, "--tf", "bone", "--seconds", "0.1")

    # ---- refusals ----

    def test_commands_for_volumes_refuse_scenes(self):
        data = self.scene("refused", [row((0, 0, 0))])
        self.leaves_nothing(2, "bench", "stream", data, says="only the tables orders and flight measure it, and")
        self.leaves_nothing(2, "bench", "orders", data, "--tf", "bone", says="is a Gaussian scene")
        self.leaves_nothing(2, "bench", "orders", data, "--no-shading", says="is a Gaussian scene")
        self.leaves_nothing(2, "bench", "orders", data, "--renderer", "reference", says="must be cpu")
        for command in "bench orders", "accuracy":
            self.leaves_nothing(2, *command.split(), "refused.ply", says="`triptych brick` makes a data set of it")
        self.works("render", data, data, "-o", "a.png")
        self.fails(2, "tf", "show", data, says="is a Gaussian scene")
        self.leaves_nothing(2, "brick", data, "-o", "b.trip", says="is a data set already")

    def test_settings_of_volumes_are_refused_for_scenes(self):
        data = self.scene("settings", [row((0, 0, 0))])
        for options in ("--max-bytes", "1M"), ("--interpolation", "cubic"), ("--compositing", "sheet"), \
                       ("--error", "1"), ("--kernel", "fixed"), ("--tf", "bone"), \
                       ("--effects", "shadows"), ("--sheet", "0.1"), ("--order", "sheets", "--lod", "1"), \
                       ("--order", "lists", "--sheet", "0.1"), ("--sheet", "0", "--order", "sheets"), \
                       ("--sheet", "1e-8", "--order", "sheets"), \
                       ("--renderer", "gl", "--order", "sheets"), \
                       ("--renderer", "integral", "--order", "sheets"), \
                       ("--renderer", "integral", "--depth", "d.exr"), \
                       ("--renderer", "integral", "--kernel", "exact"), ("--tolerance", "1e-3"), \
                       ("--renderer", "integral", "--field", "splats"):
            self.leaves_nothing(2, "render", data, "-o", "a.png", *options)
        tooth = os.path.join(program.DATASETS, "tooth.nhdr")
        self.leaves_nothing(2, "brick", tooth, "-o", "b.trip", "--harmonics", "whole",
                            says="apply to Gaussian scenes only")
        self.leaves_nothing(2, "render", "settings.ply", "-o", "a.png", "--spacing", "1,1,1",
                            says="does not apply to Gaussian scenes")
        for options, says in ((["--clip-box", "voxels:0,0,0,1,1,1"], "--clip-box: voxels: does not apply"),
                              (["--h", "0.5"], "--h: does not apply to scenes with --order depth"),
                              (["--method", "clip", "--order", "depth"], "--method: does not apply to scenes"),
                              (["--engine", "null"], "--engine: must be pread"),
                              (["--engine", "io_uring"], "--engine: must be pread"),
                              (["--occluded", "draw"], "--occluded: does not apply")):
            for name in data, "settings.ply":
                self.leaves_nothing(2, "render", name, "-o", "a.png", *options, says=says)

    def test_settings_of_scenes_are_refused_for_volumes(self):
        tooth = os.path.join(program.DATASETS, "tooth.nhdr")
        for options in ("--order", "lists"), ("--order", "depth"), ("--sh", "0"):
            run = self.leaves_nothing(2, "render", tooth, "-o", "a.png", *options,
                                      says="applies to Gaussian scenes only")
            self.assertNotIn(b"bricked", run.stdout)


if __name__ == "__main__":
    program.main()
