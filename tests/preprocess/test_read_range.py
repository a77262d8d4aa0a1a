"""Tests the reader of range images. Positions, normals and uncertainties are closed forms of planes, or
the surfaces of datasets/corner.py."""
import json
import os
import struct
import sys
import unittest
import zlib

import numpy as np

from point_test import COLOUR, NORMAL, RADIUS, ROOT, SCAN, UNCERTAINTY, PointTest

WIDTH, HEIGHT, FOCAL = 40, 30, 50.0
POSE = np.array([[0.6, 0, 0.8, 1], [0, 1, 0, 2], [-0.8, 0, 0.6, 3], [0, 0, 0, 1]])
SLOPE = 0.3  # of a plane z = 2 + SLOPE x


def png(values):
    """Returns a PNG of grey in 16 bits, or of RGB in 8 bits."""
    deep = values.dtype == np.uint16
    rows = values.astype(">u2" if deep else "u1").reshape(len(values), -1)
    data = b"".join(b"\0" + row.tobytes() for row in rows)

    def part(name, body):
        return (struct.pack(">I", len(body)) + name + body +
                struct.pack(">I", zlib.crc32(name + body)))
    head = struct.pack(">IIBBBBB", values.shape[1], len(values), 16 if deep else 8, 0 if deep else 2,
                       0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + part(b"IHDR", head) + part(b"IDAT", zlib.compress(data)) +
            part(b"IEND", b""))


def exr(values, name=b"Z"):
    """Returns an OpenEXR file of one channel of floats, without compression."""
    height, width = values.shape
    box = struct.pack("<4i", 0, 0, width - 1, height - 1)

    def attribute(title, kind, body):
        return title + b"\0" + kind + b"\0" + struct.pack("<i", len(body)) + body
    channels = name + b"\0" + struct.pack("<iB3xii", 2, 0, 1, 1) + b"\0"
    head = (struct.pack("<ii", 20000630, 2) + attribute(b"channels", b"chlist", channels) +
            attribute(b"compression", b"compression", b"\0") +
            attribute(b"dataWindow", b"box2i", box) + attribute(b"displayWindow", b"box2i", box) +
            attribute(b"lineOrder", b"lineOrder", b"\0") +
            attribute(b"pixelAspectRatio", b"float", struct.pack("<f", 1)) +
            attribute(b"screenWindowCenter", b"v2f", struct.pack("<ff", 0, 0)) +
            attribute(b"screenWindowWidth", b"float", struct.pack("<f", 1)) + b"\0")
    first, line = len(head) + 8 * height, 8 + 4 * width
    offsets = struct.pack(f"<{height}Q", *(first + line * y for y in range(height)))
    return head + offsets + b"".join(
        struct.pack("<ii", y, 4 * width) + values[y].astype("<f4").tobytes() for y in range(height))


def tiff(values):
    """Returns a TIFF of floats in one strip."""
    height, width = values.shape
    tags = [(256, 3, width), (257, 3, height), (258, 3, 32), (259, 3, 1), (262, 3, 1), (273, 4, 8),
            (277, 3, 1), (278, 3, height), (279, 4, 4 * width * height), (339, 3, 3)]
    body = values.astype("<f4").tobytes()
    return (struct.pack("<2sHI", b"II", 42, 8 + len(body)) + body + struct.pack("<H", len(tags)) +
            b"".join(struct.pack("<HHII", t, k, 1, v) for t, k, v in tags) + bytes(4))


def plane(width=WIDTH, height=HEIGHT, focal=FOCAL, centre=None):
    """Returns the distances and points of a plane. `centre` is the pixel on the optical axis; pixel
    0 has its middle at 0.5."""
    centre = centre or (width / 2 + 0.5, height / 2 + 0.5)
    u, v = np.meshgrid(np.arange(width) + 0.5 - centre[0], np.arange(height) + 0.5 - centre[1])
    z = 2 / (1 - SLOPE * u / focal)
    return z, np.stack([u / focal * z, v / focal * z, z], axis=-1).reshape(-1, 3)


def placed(points, pose=POSE):
    return points @ pose[:3, :3].T + pose[:3, 3]


def grazing(cosine):
    theta = np.arccos(cosine)
    return 1e-4 * (theta / (np.pi / 2 - theta)) ** 2


class RangeTest(PointTest):
    def folder_of(self, depths, poses, colours=(), intrinsics=True, suffix=".color.png"):
        """Writes a folder in the layout of 7-Scenes. Returns its path."""
        folder = self.path("frames")
        os.makedirs(folder, exist_ok=True)
        if intrinsics:
            camera = [[FOCAL, 0, WIDTH / 2], [0, FOCAL, HEIGHT / 2], [0, 0, 1]]
            np.savetxt(os.path.join(folder, "camera-intrinsics.txt"), camera)
        for i, depth in enumerate(depths):
            self.path(f"frames/frame-{i:06d}.depth.png", png(depth))
            if poses[i] is not None:
                np.savetxt(os.path.join(folder, f"frame-{i:06d}.pose.txt"), poses[i])
            if i < len(colours):
                self.path(f"frames/frame-{i:06d}{suffix}", png(colours[i]))
        return folder

    def json_of(self, frames, **more):
        return self.path("transforms.json", json.dumps(dict(more, frames=frames)).encode())

    # ---- folders ----

    def test_a_plane_has_its_points_normals_radii_and_uncertainties(self):
        z, points = plane()
        steps = np.round(z * 1000).astype(np.uint16)
        exact = points * (steps / 1000 / z).reshape(-1, 1)
        got = self.read_path(self.folder_of([steps], [POSE]))
        self.assertEqual(got.attributes, NORMAL | RADIUS | SCAN | UNCERTAINTY)
        self.same(got.position, placed(exact), 1e-6)
        self.assertEqual(got.scans, [[1, 1, 2, 3, WIDTH, HEIGHT]])
        normal = np.array([SLOPE, 0, -1]) / np.hypot(SLOPE, 1)  # to the camera
        self.assertLess(np.abs(got.normal - POSE[:3, :3] @ normal).max(), 0.02)  # whole millimetres
        cosine = -(points @ normal) / np.linalg.norm(points, axis=1)
        half = steps.ravel() / 2000 / FOCAL
        self.same(got.footprint, half, 1e-7)
        self.same(got.radius, 2 ** 0.5 * half / cosine, 5e-4)
        depth = points[:, 2]
        sensor = 0.0012 + 0.0019 * (depth - 0.4) ** 2 + grazing(cosine) / np.sqrt(depth)
        self.assertGreaterEqual((got.uncertainty - sensor).min(), -1e-5)
        self.same(got.uncertainty, sensor, 1e-4)  # rounding counts as roughness

    def test_a_jump_and_a_hole_are_uncertain(self):
        """Three of the eight neighbours beside a jump count 5 % of the distance each."""
        steps = np.full((HEIGHT, WIDTH), 2000, np.uint16)
        steps[:, 20:] = 3000
        steps[10, 5] = 0
        got = self.read_path(self.folder_of([steps], [np.eye(4)]))
        self.assertEqual((got.points, got.empty), (HEIGHT * WIDTH - 1, 1))
        at = {tuple(k): u for k, u in zip(np.argwhere(steps.ravel().reshape(HEIGHT, WIDTH) > 0),
                                          got.uncertainty)}
        sensor = 0.0012 + 0.0019 * 1.6 ** 2
        for pixel, share in ((15, 19), 3 / 8), ((10, 6), 1 / 8), ((15, 8), 0):
            theta = np.arctan(np.hypot(pixel[1] - WIDTH / 2, pixel[0] - HEIGHT / 2) / FOCAL)
            first = sensor + grazing(np.cos(theta)) / np.sqrt(2)
            self.assertAlmostEqual(at[pixel], np.hypot(first, 0.1 * share ** 0.5), delta=1e-6)

    def test_colours_are_of_the_colour_image_also_of_another_size(self):
        random = np.random.default_rng(5)
        steps = np.full((HEIGHT, WIDTH), 1500, np.uint16)
        same = random.integers(0, 256, (HEIGHT, WIDTH, 3)).astype(np.uint8)
        folder = self.folder_of([steps], [np.eye(4)], [same])
        got = self.read_path(folder)
        self.assertEqual(got.attributes & COLOUR, COLOUR)
        self.same(got.colour, same.reshape(-1, 3) / 255, 1e-6)
        ramp = np.zeros((2 * HEIGHT, 2 * WIDTH, 3), np.uint8)
        ramp[..., 0] = 2 * np.arange(2 * WIDTH)
        ramp[..., 1] = 3 * np.arange(2 * HEIGHT)[:, None]
        got = self.read_path(self.folder_of([steps], [np.eye(4)], [ramp]))
        self.same(got.colour[:, 0].reshape(HEIGHT, WIDTH)[0] * 255, 4 * np.arange(WIDTH) + 1, 1e-4)
        self.same(got.colour[:, 1].reshape(HEIGHT, WIDTH)[:, 0] * 255, 6 * np.arange(HEIGHT) + 1.5,
                  1e-4)

    def test_values_without_a_distance_and_frames_without_a_pose_are_left_out(self):
        steps = np.full((HEIGHT, WIDTH), 1000, np.uint16)
        steps[0, :4] = 0, 65535, 65534, 1
        lost = np.full((4, 4), -np.inf)
        got = self.read_path(self.folder_of([steps] * 3, [np.eye(4), lost, None]))
        self.assertEqual((got.points, got.empty), (HEIGHT * WIDTH - 2, 2))
        self.assertIn("2 of 3 frames have no pose; they are left out", got.notes)
        self.assertAlmostEqual(got.position[0, 2], 65.534, places=5)

    def test_without_a_camera_the_one_of_the_kinect_is_used(self):
        steps = np.full((480, 640), 1000, np.uint16)
        got = self.read_path(self.folder_of([steps], [np.eye(4)], intrinsics=False))
        self.same(got.position[0], [-320 / 585, -240 / 585, 1], 1e-6)
        self.assertTrue(any("585" in note for note in got.notes), got.notes)

    def test_scannet(self):
        z, points = plane()
        for i in 2, 10:
            for folder in "depth", "color", "pose", "intrinsic":
                os.makedirs(self.path("scan/" + folder), exist_ok=True)
            self.path(f"scan/depth/{i}.png", png(np.round(z * 1000).astype(np.uint16)))
            np.savetxt(self.path(f"scan/pose/{i}.txt"), POSE if i == 2 else np.eye(4))
        camera = np.diag([FOCAL, FOCAL, 1, 1])
        camera[:2, 2] = WIDTH / 2, HEIGHT / 2
        np.savetxt(self.path("scan/intrinsic/intrinsic_depth.txt"), camera)
        got = self.read_path(self.path("scan"))
        self.assertEqual(got.format, "range images (ScanNet)")
        self.assertEqual([s[1:4] for s in got.scans], [[1, 2, 3], [0, 0, 0]])  # 2 before 10
        self.same(got.position[:len(points)], placed(points), 1e-3)

    def test_the_corner_has_the_surfaces_that_it_was_made_of(self):
        sys.path.insert(0, os.path.join(ROOT, "datasets"))
        import corner
        folder = self.path("corner")
        corner.write(folder, noisy=False)
        got = self.read_path(folder)
        first = 0
        for angle in corner.ANGLES:
            pose = corner.pose_at(angle)
            z, colours, normals, surface = corner.photograph(pose)
            kept = z < 4
            points = pose[:3, 3] + corner.rays_of(pose)[kept] * z[kept][:, None]
            some = slice(first, first + len(points))
            first += len(points)
            self.same(got.position[some], points, 1e-3)
            self.same(got.colour[some], np.round(colours[kept] * 255) / 255, 1e-6)
            cosine = (got.normal[some] * normals[kept]).sum(-1)
            ball = surface[kept] == 3
            self.assertGreater(np.median(cosine), 0.999)
            self.assertGreater((cosine[ball] > 0.95).mean(), 0.85)
        self.assertEqual(first, got.points)

    # ---- JSON ----

    def test_json_has_axes_of_opengl_and_floats_in_any_format(self):
        z, points = plane(centre=(WIDTH / 2, HEIGHT / 2))
        flip = np.diag([1.0, -1, -1, 1])
        frames = []
        for name, data in (("a.exr", exr(z)), ("b.tif", tiff(z)),
                           ("c.png", png(np.round(z * 1000).astype(np.uint16))),
                           ("d.exr", exr(z, b"depth.Z"))):
            self.path(name, data)
            frames.append({"depth_file_path": name, "transform_matrix": (POSE @ flip).tolist()})
        got = self.read_path(self.json_of(frames, fl_x=FOCAL, fl_y=FOCAL))
        for i, error in enumerate([1e-5, 1e-5, 1e-3, 1e-5]):
            self.same(got.position[i * len(points):(i + 1) * len(points)], placed(points), error)

    def test_json_scales_cameras_and_units_and_limits_distances(self):
        """A camera for twice the size, in centimetres, and a frame with a camera of its own."""
        z, points = plane(centre=(WIDTH / 2, HEIGHT / 2))
        self.path("a.png", png(np.round(z * 100).astype(np.uint16)))
        self.path("b.tif", tiff(np.where(z < 2, z, np.nan)))
        pose = np.diag([1.0, -1, -1, 1]).tolist()
        frames = [{"depth_file_path": "a.png", "transform_matrix": pose},
                  {"depth_file_path": "b.tif", "transform_matrix": pose, "fl_x": FOCAL,
                   "fl_y": FOCAL, "w": WIDTH, "h": HEIGHT, "cx": WIDTH / 2, "cy": HEIGHT / 2,
                   "depth_unit_scale_factor": 2, "depth_near": 3.5, "depth_noise": [0.5, 0.25, 0]},
                  {"file_path": "only.png", "transform_matrix": pose}]
        got = self.read_path(self.json_of(frames, fl_x=2 * FOCAL, fl_y=2 * FOCAL, w=2 * WIDTH,
                                          h=2 * HEIGHT, cx=WIDTH, cy=HEIGHT,
                                          depth_unit_scale_factor=0.01))
        self.same(got.position[:len(points)], points, 0.01)
        second = 2 * points[(points[:, 2] < 2) & (2 * points[:, 2] >= 3.5)]
        self.same(got.position[len(points):], second, 1e-5)
        self.assertIn("1 of 3 frames have no depth image; they are left out", got.notes)
        inner = got.uncertainty[len(points):].reshape(HEIGHT, -1)[5:-5, 3:-3]
        deep = second[:, 2].reshape(HEIGHT, -1)[5:-5, 3:-3]
        self.same(inner, 0.5 + 0.25 * deep, 1e-5)  # no term of grazing angles

    def test_json_with_a_field_of_view_and_distortion(self):
        k1, k2, p1, p2 = -0.2, 0.05, 0.004, -0.003
        self.path("a.tif", tiff(np.full((HEIGHT, WIDTH), 1.0)))
        frame = {"depth_file_path": "a.tif", "transform_matrix": np.diag([1.0, -1, -1, 1]).tolist()}
        angle = 2 * np.arctan(0.5 * WIDTH / FOCAL)
        got = self.read_path(self.json_of([frame], camera_angle_x=angle, camera_model="OPENCV",
                                          k1=k1, k2=k2, p1=p1, p2=p2))
        x, y, rr = got.position[:, 0], got.position[:, 1], (got.position[:, :2] ** 2).sum(-1)
        radial = 1 + k1 * rr + k2 * rr * rr  # the forward formula gives the pixels
        u = x * radial + 2 * p1 * x * y + p2 * (rr + 2 * x * x)
        v = y * radial + p1 * (rr + 2 * y * y) + 2 * p2 * x * y
        at = np.meshgrid(np.arange(WIDTH) + 0.5 - WIDTH / 2, np.arange(HEIGHT) + 0.5 - HEIGHT / 2)
        self.same(u * FOCAL, at[0].ravel(), 1e-3)
        self.same(v * FOCAL, at[1].ravel(), 1e-3)

    # ---- faults ----

    def test_faults_are_one_line_each(self):
        self.path("a.png", png(np.full((4, 4), 1000, np.uint16)))
        self.path("rgb.png", png(np.zeros((4, 4, 3), np.uint8)))
        pose = np.eye(4).tolist()
        good = {"depth_file_path": "a.png", "transform_matrix": pose, "fl_x": 5}
        for change, says in (
                ({"transform_matrix": [[1, 2], [3]]}, "matrix of 4 rows"),
                ({"transform_matrix": (2 * np.eye(4)).tolist()}, "no rotation"),
                ({"transform_matrix": np.diag([-1, 1, 1, 1]).tolist()}, "no rotation"),
                ({"fl_x": -5}, "fl_x"), ({"fl_x": "5"}, "fl_x"), ({"camera_model": "FISHEYE"}, "camera"),
                ({"depth_noise": [1, 2]}, "three numbers"), ({"depth_far": -1}, "depth_far"),
                ({"depth_file_path": "none.png"}, "none.png"),
                ({"depth_file_path": "rgb.png"}, "3 channels")):
            frames = json.dumps({"frames": [dict(good, **change)]}).encode()
            self.refused("transforms.json", frames, says)
        text = json.dumps({"frames": [good]}).encode()
        self.refused("transforms.json", text[:-4], "is not JSON")
        self.refused("transforms.json", text.replace(b'"frames"', b'"frame"'), "frames")
        self.refused("transforms.json", json.dumps(
            {"frames": [{"transform_matrix": pose}], "x": "depth_file_path"}).replace(
                "\"x\": ", "").replace(", \"depth_file_path\"", ", \"depth_file_path\": 1").encode(),
                     "no range image with a pose")
        del good["fl_x"]
        self.refused("transforms.json", json.dumps({"frames": [good]}).encode(), "focal length")

    def test_a_damaged_image_is_one_line(self):
        steps = np.full((HEIGHT, WIDTH), 1000, np.uint16)
        folder = self.folder_of([steps, steps], [np.eye(4)] * 2)
        whole = png(steps)
        self.refused("frames/frame-000001.depth.png", whole, "is no cloud")  # not a folder
        self.path("frames/frame-000001.depth.png", whole[:60])
        made = self.__class__.read_faulty(folder)
        self.assertEqual((made.code, len(made.lines)), (1, 1), made.lines)
        self.assertIn("frame-000001.depth.png", made.lines[0])
        self.path("frames/frame-000001.depth.png", whole)
        self.path("frames/frame-000001.pose.txt", b"1 0 0 zero\n")
        made = self.__class__.read_faulty(folder)
        self.assertEqual((made.code, len(made.lines)), (1, 1), made.lines)
        self.assertIn("no number", made.lines[0])

    @staticmethod
    def read_faulty(path):
        from point_test import Read
        return Read(path)


if __name__ == "__main__":
    unittest.main()
