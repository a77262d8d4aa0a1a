"""Tests of range images as ellipsoids with the uncertainty of their distances, and as hyperlines.
Expected values come from the formulas of the documentation, by NumPy."""
import glob
import json
import math
import os
import pathlib
import shutil
import struct
import sys
import unittest
import zlib

import numpy

import program
from test_points import grid, write_cloud, write_las

sys.path.insert(0, program.DATASETS)
import corner  # noqa: E402, the surfaces of the range images in datasets/corner

CORNER = os.path.join(program.DATASETS, "corner")


def write_frames(path, depths, focal, noise, colours=(), poses=()):
    """Writes depth images in millimetres and transforms.json. Cameras stand in the origin unless
    told otherwise, and look along -z."""
    frames = []
    for i, depth in enumerate(depths):
        program.write_png(f"depth{i}.png", numpy.asarray(depth, numpy.uint16))
        pose = poses[i] if i < len(poses) else numpy.eye(4)
        frames.append({"depth_file_path": f"depth{i}.png", "transform_matrix": pose.tolist()})
        if i < len(colours):
            frames[-1]["file_path"] = colours[i]
    height, width = numpy.shape(depths[0])
    program.write(path, json.dumps({"frames": frames, "fl_x": focal, "fl_y": focal, "cx": width / 2,
                                    "cy": height / 2, "depth_noise": noise}).encode())


def write_rgb(path, image):
    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
    height, width, _ = image.shape
    program.write(path, b"\x89PNG\r\n\x1a\n" + chunk(
        b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)) + chunk(
            b"IDAT", zlib.compress(b"".join(b"\0" + row.tobytes() for row in image))) +
                  chunk(b"IEND", b""))


def facing(degrees):
    return max(0, math.cos(math.radians(degrees))) ** 4


class RangeImages(program.ProgramTest):
    def lone(self, focal=5, noise=0.24):
        """Writes one sample at (0, 0, -2). Its eight neighbours have no distance, so each counts 5 %
        of the distance. Returns half the width of its pixel, and its uncertainty."""
        write_frames("one.json", [[[0, 0, 0], [0, 2000, 0], [0, 0, 0]]], focal, [noise, 0, 0])
        return 0.5 * 2 / focal, math.hypot(noise, 0.05 * 2)

    def test_a_sample_is_an_ellipsoid_along_its_ray(self):
        """The profile of its alpha in parallel views from several sides. Its weight is 0.8, since
        its uncertainty is the mean."""
        half, sigma = self.lone()
        self.works("brick", "one.json", "-o", "one.trip", "-q", "--uncertainty")
        place = {"objects": [{"data": "one.trip", "matrix": [
            0, 0, 1, 5, 0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 0, 1]}]}
        program.write("scene.json", json.dumps(place).encode())
        at = numpy.arange(65) - 32
        for name, options in (("one.trip", ()), ("one.trip", ("--order", "lists")),
                              ("one.trip", ("--renderer", "reference")), ("scene.json", ())):
            for degrees in 0, 30, 60, 100:
                turn = math.radians(degrees)
                middle, away = [0, 0, -2], [3 * math.sin(turn), 0, 3 * math.cos(turn)]
                if name == "scene.json":  # (x, y, z) goes to (z + 5, y, -x)
                    middle, away = [3, 0, 0], [away[2], 0, -away[0]]
                eye = [a + b for a, b in zip(middle, away)]
                picture = self.picture(name, "--size", "65x65", "--ortho", 2, "--up", "0,1,0", "--eye",
                                       ",".join(map(str, eye)), "--look", ",".join(map(str, middle)),
                                       *options)[:, :, 3]
                across = (math.cos(turn) * half) ** 2 + (math.sin(turn) * sigma) ** 2
                for profile, square in (picture[32], across), (picture[:, 32], half ** 2):
                    expected = (0.8 * facing(degrees) *
                                numpy.exp(-at ** 2 / 2 / (square * 32.5 ** 2 + 0.3)))
                    expected[expected < 1 / 255] = 0
                    numpy.testing.assert_allclose(profile, expected, atol=0.006,
                                                  err_msg=f"{name} {options} {degrees}")

    def test_weights_fall_with_uncertainty(self):
        """1 / (1 + (sigma / 2s)^2), with the harmonic mean s of all sigma. The view is the camera's."""
        depth = numpy.zeros((9, 9))
        depth[4, ::4] = 1000, 1500, 4000
        write_frames("three.json", [depth], 9, [0.01, 0, 0.02])
        z = numpy.array([1, 1.5, 4])
        sigma = numpy.hypot(0.01 + 0.02 * z * z, 0.05 * z)
        mean = 3 / (1 / sigma).sum()
        expected = 1 / (1 + (sigma / (2 * mean)) ** 2)
        self.assertTrue((numpy.diff(expected) < -0.05).all())
        picture = self.picture("three.json", "--uncertainty", "--size", "63x63", "--eye", "0,0,0", "--look",
                               "0,0,-1", "--up", "0,1,0", "--fov", math.degrees(2 * math.atan(4.5 / 9)))
        numpy.testing.assert_allclose(picture[31, 3::28, 3], expected, atol=0.003)

    def test_a_factor_widens_ellipsoids_and_keeps_their_length(self):
        half, sigma = self.lone()
        at = numpy.arange(65) - 32
        picture = self.picture("one.json", "--uncertainty", "--radius", "2x", "--size", "65x65", "--ortho", 2,
                               "--eye", "3,0,1", "--look", "0,0,-2", "--up", "0,1,0")[:, :, 3]
        for profile, square in ((picture[32], 2 * half ** 2 + sigma ** 2 / 2),
                                (picture[:, 32], 4 * half ** 2)):
            expected = 0.8 * facing(45) * numpy.exp(-at ** 2 / 2 / (square * 32.5 ** 2 + 0.3))
            expected[expected < 1 / 255] = 0
            numpy.testing.assert_allclose(profile, expected, atol=0.006)

    def error(self, degrees, *options):
        """Returns the mean difference of 255 from the exact picture of the corner, and the covered
        share."""
        pose = corner.pose_at(degrees)
        z, colours, _, _ = corner.photograph(pose)
        eye, look, up = pose[:3, 3], pose[:3, 3] + pose[:3, 2], -pose[:3, 1]
        view = [",".join(f"{x:.12g}" for x in v) for v in (eye, look, up)]
        fov = math.degrees(2 * math.atan(0.5 * corner.SIZE[1] / corner.FOCAL))
        picture = self.picture(CORNER, "--size", "160x120", "--eye", view[0], "--look", view[1], "--up",
                               view[2], "--fov", fov, *options)
        seen = (z < 4) & (picture[:, :, 3] > 0)
        apart = numpy.abs(picture[:, :, :3] - colours * picture[:, :, 3:])[seen]
        return 255 * apart.mean(), seen.mean()

    def test_ellipsoids_show_the_corner_between_its_cameras(self):
        """By depth, surfels of several noisy frames hide each other. Translucent ellipsoids blend them,
        so the error falls."""
        points = self.error(10, "--order", "depth")
        ellipsoids = self.error(10, "--uncertainty", "--opacity-scale", 0.2, "--normalise")
        self.assertGreater(min(points[1], ellipsoids[1]), 0.9)
        self.assertLess(ellipsoids[0], 0.8 * points[0])

    def test_normalising_does_not_count_the_background_twice(self):
        self.lone()
        view = ("one.json", "--uncertainty", "--size", "65x65", "--ortho", 2, "--eye", "0,0,3", "--look",
                "0,0,-2", "--up", "0,1,0", "--normalise")
        bare, red = self.picture(*view)[32], self.picture(*view, "--background", "red")[32]
        covered = bare[:, 3] > 0.5
        self.assertTrue(5 < covered.sum() < 60)
        numpy.testing.assert_allclose(red[covered], bare[covered], atol=0.01)
        numpy.testing.assert_allclose(red[0], [1, 0, 0, 1], atol=0.01)

    # ---- hyperlines ----

    def wall(self, colours):
        """Writes range images of the wall z = -2. Cameras stand beside one another, and each sees a
        color of its own. Returns their places."""
        places = numpy.array([[0.5 * i - 0.5, 0.1 * i, 0] for i in range(len(colours))])
        poses = numpy.tile(numpy.eye(4), (len(colours), 1, 1))
        poses[:, :3, 3] = places
        for i, colour in enumerate(colours):
            write_rgb(f"colour{i}.png", numpy.tile(numpy.uint8(colour), (15, 20, 1)))
        write_frames("wall.json", [numpy.full((15, 20), 2000)] * len(colours), 20, [0.01, 0, 0],
                     [f"colour{i}.png" for i in range(len(colours))], poses)
        return places

    def pixel(self, data, eye, look, *options):
        picture = self.picture(data, "--size", "9x9", "--fov", 2, "--up", "0,1,0", "--eye",
                               ",".join(map(str, eye)), "--look", ",".join(map(str, look)), *options)
        self.assertGreater(picture[4, 4, 3], 0.95)
        return picture[4, 4, :3] / picture[4, 4, 3]

    def test_a_point_has_the_colours_of_the_cameras_near_the_view(self):
        """Weights are the cosine of the angle between the rays to the eye and to a camera, to the
        power 32."""
        colours = numpy.array([[150, 100, 120], [110, 150, 100], [120, 110, 160]])
        places, at = self.wall(colours), numpy.array([0, 0, -2])
        self.works("brick", "wall.json", "-o", "wall.trip", "-q", "--hyperlines")
        place = {"objects": [{"data": "wall.trip", "matrix": [
            0, 0, 1, 5, 0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 0, 1]}]}
        program.write("wall.scene.json", json.dumps(place).encode())
        to = (places - at) / numpy.linalg.norm(places - at, axis=1)[:, None]
        for eye in [-1, 0, 0], [0.3, 0.4, -0.5]:
            view = (eye - at) / numpy.linalg.norm(eye - at)
            weights = (to @ view) ** 32
            expected = weights @ colours / weights.sum() / 255
            for options in (), ("--order", "lists"), ("--order", "depth"), ("--renderer", "reference"):
                numpy.testing.assert_allclose(self.pixel("wall.trip", eye, at, *options), expected, atol=0.012,
                                              err_msg=f"{eye} {options}")
            turned = self.pixel("wall.scene.json", [eye[2] + 5, eye[1], -eye[0]], [3, 0, 0])
            numpy.testing.assert_allclose(turned, expected, atol=0.012, err_msg=str(eye))
        mean = self.pixel("wall.trip", [-1, 0, 0], at, "--sh", 0)
        numpy.testing.assert_allclose(mean, colours.mean(axis=0) / 255, atol=0.012)
        self.works("info", "wall.trip", "--verify")

    def test_frames_of_one_wall_are_fused(self):
        """Frames after the first keep what it does not see. The point takes the mean distance."""
        self.wall([[200, 0, 0]] * 3)
        run = self.works("brick", "wall.json", "-o", "fused.trip", "--json", "--hyperlines")
        count = json.loads(run.stdout)["gaussians"]
        self.assertIn(f"{900 - count} of 900 samples", run.stderr)
        # the others lie 5 and 10 pixels aside, and 1 and 2 pixels up; half a pixel of each may be lost
        seen = 300 + 2 * (5 * 14 + 1 * 20)
        self.assertTrue(seen - 60 <= count <= seen + 80, count)
        program.write_png("depth1.png", numpy.full((15, 20), 2020, numpy.uint16))
        self.works("brick", "wall.json", "-o", "moved.trip", "-q", "--hyperlines")
        z = [self.depth_of(name) for name in ("fused.trip", "moved.trip")]
        self.assertAlmostEqual(z[0], 2, delta=1e-3)
        self.assertAlmostEqual(z[1], 2 + 0.02 / 3, delta=1e-3)

    def depth_of(self, data):
        self.works("render", data, "-o", "a.exr", "--depth", "deep.exr", "--size", "9x9", "--fov", 2, "--eye", "0,0,0",
                   "--look", "0,0,-2", "--up", "0,1,0")
        return program.read_exr_channels("deep.exr")[1][4, 4, 0]

    def test_hyperlines_show_the_corner_between_its_cameras(self):
        """The error is smaller than that of surfels, whose noise is not averaged."""
        points, lines = self.error(10), self.error(10, "--hyperlines")
        self.assertGreater(min(points[1], lines[1]), 0.9)
        self.assertLess(lines[0], 0.9 * points[0])

    # ---- refusals ----

    def test_hyperlines_are_refused_for_other_clouds_and_with_other_shapes(self):
        write_cloud("a.ply", grid(4))
        self.leaves_nothing(2, "brick", "a.ply", "-o", "no.trip", "--hyperlines", says="is no sequence")
        program.write_nrrd("v.nrrd", numpy.zeros((4, 4, 4), "u1"))
        self.leaves_nothing(2, "brick", "v.nrrd", "-o", "no.trip", "--hyperlines", says="is no cloud")
        self.lone()
        self.leaves_nothing(1, "brick", "one.json", "-o", "no.trip", "--hyperlines",
                            says="has no colour image")
        for options in ("--k", 8), ("--radius", 0.1), ("--outliers", 1), ("--color", "height"), ("--uncertainty",):
            self.leaves_nothing(2, "brick", CORNER, "-o", "no.trip", "--hyperlines", *options,
                                says="leave out")
        self.leaves_nothing(1, "brick", CORNER, "-o", "no.trip", "--hyperlines", "--memory", "1M",
                            says="raise --memory")

    def test_points_of_a_scan_are_ellipsoids_along_their_rays(self):
        """A bumpy surface with a scanner above, and one seen along parallel rays. The view is 30
        degrees beside the scanner. Expected values come from the formulas of point_ellipsoid.h, with
        all neighbours by brute force."""
        for name, scanner in ("scan.ptx", [0.4, -0.3, 40]), ("scan.ply", [0, 0, 1e6]):
            self.check_scan(name, numpy.array(scanner))

    def check_scan(self, name, scanner):
        r = numpy.random.default_rng(11)
        count, k = 300, 12
        points = r.uniform(-1, 1, (count, 3))
        points[:, 2] = 0.5 * points[:, 0] + 0.2 * numpy.sin(3 * points[:, 1]) + r.normal(0, 0.02, count)
        lines = [str(count), "1", " ".join(map(repr, scanner.tolist())),
                 "1 0 0", "0 1 0", "0 0 1", "1 0 0 0", "0 1 0 0", "0 0 1 0",
                 " ".join(map(repr, [*scanner.tolist(), 1])),
                 *[" ".join(map(repr, [*(p - scanner).tolist(), 1.0])) for p in points]]
        program.write("scan.ptx", ("\n".join(lines) + "\n").encode())
        cells = [f"1 {i // 2}" if i % 2 else "0" for i in range(2 * count)]  # every other one is empty
        program.write("scan.ply", "\n".join([
            "ply", "format ascii 1.0", "obj_info is_cyberware_data 1", "obj_info num_cols 1",
            f"obj_info num_rows {2 * count}", f"element vertex {count}",
            *(f"property double {axis}" for axis in "xyz"), f"element range_grid {2 * count}",
            "property list uchar int vertex_indices", "end_header",
            *(" ".join(map(repr, p.tolist())) for p in points), *cells, ""]).encode())
        away = numpy.linalg.norm(points[:, None] - points, axis=2)
        rays, half, sigma = scanner - points, numpy.empty(count), numpy.empty(count)
        rays /= numpy.linalg.norm(rays, axis=1)[:, None]
        for i in range(count):
            near = numpy.argsort(away[i])[:k + 1]  # the point itself is the first one
            variances, axes = numpy.linalg.eigh(numpy.cov(points[near].T, bias=True))
            cosine = max(abs(axes[:, 0] @ rays[i]), math.cos(1.5))
            spread = math.sqrt((numpy.linalg.norm(points[near[1:]] - points[near[1:]].mean(0), axis=1) ** 2).mean())
            apart = min(away[i, near[-1]], 1.7 * spread) * math.sqrt(math.pi / k)
            half[i] = math.sqrt(cosine) * apart / 2
            sigma[i] = math.sqrt(half[i] ** 2 * (1 / 16 + 1 / cosine ** 2 - 1) + variances[0] / cosine ** 2)
        opacity = 1 / (1 + (sigma / (2 * count / (1 / sigma).sum())) ** 2)
        turn = math.radians(30)
        toward = numpy.array([math.sin(turn), 0, math.cos(turn)])
        right, up = numpy.array([math.cos(turn), 0, -math.sin(turn)]), numpy.array([0, 1, 0])
        size, height = 90, 2.5
        scale = size / height
        at = numpy.arange(size) + 0.5 - size / 2
        passes = numpy.ones((size, size))
        for i in range(count):
            inside = numpy.eye(3) * half[i] ** 2 + numpy.outer(rays[i], rays[i]) * (sigma[i] ** 2 - half[i] ** 2)
            plane = numpy.stack([right, up])
            form = numpy.linalg.inv(plane @ inside @ plane.T * scale ** 2 + 0.3 * numpy.eye(2))
            dx, dy = numpy.meshgrid(at - scale * points[i] @ right, -at - scale * points[i] @ up)
            q = form[0, 0] * dx * dx + 2 * form[0, 1] * dx * dy + form[1, 1] * dy * dy
            alpha = opacity[i] * max(0, rays[i] @ toward) ** 4 * numpy.exp(-q / 2)
            passes *= 1 - numpy.where(alpha < 1 / 255, 0, numpy.minimum(alpha, 0.99))
        eye = 9 * toward
        for options in (), ("--threads", 1, "--memory", "32M"):
            picture = self.picture(name, "--uncertainty", "--size", f"{size}x{size}", "--ortho", height,
                                   "--eye", ",".join(map(repr, eye.tolist())), "--look", "0,0,0", "--up", "0,1,0",
                                   *options)
            far = numpy.abs(picture[:, :, 3] - (1 - passes))
            self.assertGreater((1 - passes).mean(), 0.3)
            self.assertLess(far.mean(), 0.002)
            self.assertLess(far.max(), 0.02)

    def test_more_scans_do_not_open_a_surface(self):
        """A scanner sees a floor from above, and four others at grazing angles. The width of a point is
        that of its own scanner's rays, however near the points of others are. A scan alone has the widths of its grid: halfway between
        four points its opacity is that of four Gaussians with half their distance as deviation."""
        side, step = 41, math.radians(1)

        def scan(at, x):
            """A scan of the floor at the grid of coordinates x, from a place."""
            a, b = numpy.meshgrid(x, x)
            rows = numpy.stack([a.ravel(), b.ravel(), 0 * a.ravel()], 1) - at
            place = " ".join(map(repr, at))
            head = (f"{len(x)}\n{len(x)}\n{place}\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n"
                    f"{place} 1\n")
            return head + "".join(" ".join(map(repr, r)) + " 1\n" for r in rows.tolist())

        grid = 3 * numpy.tan(step * (numpy.arange(side) - side // 2))
        above = scan([0, 0, 3], grid)
        beside = [scan([x, y, 1], grid + 0.01 * i) for i, (x, y) in
                  enumerate(((4, 0), (-4, 0), (0, 4), (0, -4)), 1)]
        program.write("one.ptx", above.encode())
        program.write("two.ptx", (above + "".join(beside)).encode())
        view = ("--uncertainty", "--size", "200x200", "--eye", "0,0,3", "--look", "0,0,0", "--up", "0,1,0",
                "--fov", 2 * math.degrees(math.atan(0.25)))  # 400 pixels for the distance of the scanner
        one, two = (self.picture(name, *view)[:, :, 3] for name in ("one.ptx", "two.ptx"))
        self.assertGreater((two - one)[20:180, 20:180].min(), -0.02)
        opacity = 1 / (1 + 1 / 4)  # all are about as uncertain
        apart = 400 * math.tan(step)
        alpha = opacity * math.exp(-apart ** 2 / 4 / (apart ** 2 / 4 + 0.3))
        middle = one[100 + round(apart / 2), 100 + round(apart / 2)]
        self.assertAlmostEqual(middle, 1 - (1 - alpha) ** 4, delta=0.06)

    def test_uncertainty_is_refused_for_what_has_none(self):
        write_cloud("a.ply", grid(4))
        write_las("a.las", grid(4), [2] * 16)
        program.write_nrrd("v.nrrd", numpy.zeros((4, 4, 4), "u1"))
        for name, says in (("a.ply", "does not tell where its scanner stood"), ("a.las", "does not tell"),
                           ("v.nrrd", "is no cloud"), (os.path.join(program.DATASETS, "train-1000.ply"),
                                                       "is no cloud")):
            self.leaves_nothing(2, "brick", name, "-o", "no.trip", "--uncertainty", says=says)
            self.leaves_nothing(2, "render", name, "-o", "no.png", "--uncertainty", says=says)
        self.lone()
        for options in ("--k", 8), ("--radius", 0.1):
            self.leaves_nothing(2, "brick", "one.json", "-o", "no.trip", "--uncertainty", *options,
                                says="do not apply")

    def test_memory_and_threads_do_not_change_the_data_set(self):
        made = []
        for kind in "--uncertainty", "--hyperlines":
            for options in ("--threads", 1), ("--threads", 3, "--memory", "24M"):
                self.works("brick", CORNER, "-o", "some.trip", "-q", kind, *options)
                made.append([pathlib.Path(path).read_bytes() for path in sorted(glob.glob("some.trip/*"))])
                shutil.rmtree("some.trip")
            self.assertEqual(*made[-2:])


if __name__ == "__main__":
    program.main()
