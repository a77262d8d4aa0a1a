"""Tests of scene files: several data sets in one picture. The placed Gaussians are computed with NumPy,
and tests/gaussians/definition.py draws them. Neither has code of the program."""
import gzip
import json
import math
import os
import shutil
import struct
import sys

import numpy

import program
from test_gaussians import MEAN, MOST, many, options_of, row, view_of, write_scene

sys.path.insert(0, os.path.join(os.environ["TRIP_SOURCE_DIR"], "tests", "gaussians"))
import definition  # noqa: E402


def turn_of(axis, degrees):
    """Returns the matrix of a turn: the exponential of the cross product, by its series."""
    x, y, z = numpy.array(axis, float) / numpy.linalg.norm(axis) * math.radians(degrees)
    generator = numpy.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    sum_, term = numpy.eye(3), numpy.eye(3)
    for i in range(1, 40):
        term = term @ generator / i
        sum_ = sum_ + term
    return sum_


def quaternion_of(matrix):
    """Returns w, x, y, z of a rotation: the eigenvector of its axis, and the angle."""
    values, vectors = numpy.linalg.eig(matrix)
    axis = vectors[:, numpy.argmin(abs(values - 1))].real
    across = numpy.cross(axis, numpy.eye(3)[numpy.argmin(abs(axis))])
    across /= numpy.linalg.norm(across)
    angle = math.atan2(numpy.dot(numpy.cross(across, matrix @ across), axis), across @ matrix @ across)
    return numpy.array([math.cos(angle / 2), *(math.sin(angle / 2) * axis)])


def product(a, b):
    """Returns the product of a quaternion and rows of quaternions."""
    w, v = b[:, :1], b[:, 1:]
    return numpy.hstack([a[0] * w - v @ a[1:, None], a[0] * v + w * a[1:] + numpy.cross(a[1:], v)])


def placed(scene, turn=numpy.eye(3), scale=1.0, move=(0, 0, 0)):
    """Returns a scene of definition.py, placed. Harmonics are fitted to the turned colours."""
    d = numpy.random.default_rng(5).normal(size=(400, 3))
    d /= numpy.linalg.norm(d, axis=1, keepdims=True)
    count = scene["sh"].shape[1]
    fit = numpy.linalg.lstsq(definition.harmonics(count, d), definition.harmonics(count, d @ turn), rcond=None)[0]
    return {"centre": scale * scene["centre"] @ turn.T + numpy.array(move, float),
            "deviations": scale * scene["deviations"],
            "rotation": product(quaternion_of(turn), scene["rotation"]),
            "opacity": scene["opacity"],
            "sh": numpy.einsum("ij,njc->nic", fit, scene["sh"])}


def together(*scenes):
    most = max(scene["sh"].shape[1] for scene in scenes)
    padded = [{**scene, "sh": numpy.pad(scene["sh"], ((0, 0), (0, most - scene["sh"].shape[1]), (0, 0)))}
              for scene in scenes]
    return {key: numpy.concatenate([scene[key] for scene in padded]) for key in padded[0]}


def write_placed(path, scene):
    """Writes a scene of definition.py as a PLY."""
    rest = scene["sh"][:, 1:].transpose(0, 2, 1).reshape(len(scene["centre"]), -1)
    write_scene(path, numpy.column_stack([
        scene["centre"], scene["sh"][:, 0], rest, numpy.log(scene["opacity"] / (1 - scene["opacity"])),
        numpy.log(scene["deviations"]), scene["rotation"]]), math.isqrt(scene["sh"].shape[1]) - 1)


def write_objects(path, *objects):
    program.write(path, json.dumps({"objects": objects}).encode())
    return path


def write_spz(path, count, seed):
    """Writes an antialiased SPZ file of version 2. Returns its scene."""
    r = numpy.random.default_rng(seed)
    centre = r.integers(-4000, 4000, (count, 3))
    alpha, colour = r.integers(20, 250, count), r.integers(0, 256, (count, 3))
    size, turn = r.integers(70, 110, (count, 3)), r.integers(60, 190, (count, 3))
    data = struct.pack("<IIIBBBB", 0x5053474E, 2, count, 0, 12, 1, 0)
    data += b"".join(int(c).to_bytes(3, "little", signed=True) for c in centre.ravel())
    data += b"".join(part.astype("u1").tobytes() for part in (alpha, colour, size, turn))
    program.write(path, gzip.compress(data))
    vector = turn / 127.5 - 1
    w = numpy.sqrt(numpy.maximum(0, 1 - (vector ** 2).sum(1, keepdims=True)))
    turns = numpy.hstack([w, vector])
    return {"centre": centre / 4096, "deviations": numpy.exp(size / 16 - 10), "opacity": alpha / 255,
            "rotation": turns / numpy.linalg.norm(turns, axis=1, keepdims=True),
            "sh": ((colour / 255 - 0.5) / 0.15)[:, None, :]}


def rays_of(view):
    """Returns the origins and the directions of the pixels, with depth 1 along each direction."""
    width, height = view["size"]
    right, down, forward = definition.basis_of(view)
    if view.get("ortho_height"):
        step = view["ortho_height"] / height
    else:
        step = 2 * math.tan(math.radians(view["fov"]) / 2) / height
    x = (numpy.arange(width) + 0.5 - width / 2)[None, :, None] * step * right
    y = (numpy.arange(height) + 0.5 - height / 2)[:, None, None] * step * down
    if view.get("ortho_height"):
        return view["eye"] + x + y, numpy.broadcast_to(forward, (height, width, 3))
    return numpy.broadcast_to(view["eye"], (height, width, 3)), forward + x + y


def depths_within(view, lo, hi):
    """Returns the view depths at which the rays enter and leave a box."""
    origin, direction = rays_of(view)
    with numpy.errstate(divide="ignore", invalid="ignore"):
        a, b = (numpy.array(lo) - origin) / direction, (numpy.array(hi) - origin) / direction
    enters, leaves = numpy.fmin(a, b).max(2), numpy.fmax(a, b).min(2)
    return enters, numpy.maximum(enters, leaves), numpy.linalg.norm(direction, axis=2)


def over(front, back):
    return front + (1 - front[:, :, 3:]) * back


def fog(length, *kinds):
    """Returns the picture of fogs that fill the same length. A kind is an opacity per unit, and a colour."""
    taus = numpy.array([-math.log(1 - opacity) for opacity, _ in kinds])
    colour = sum(tau * numpy.array(colour) for tau, (_, colour) in zip(taus, kinds)) / max(taus.sum(), 1e-300)
    alpha = -numpy.expm1(-taus.sum() * length)
    return numpy.dstack([alpha[:, :, None] * colour, alpha])


class Scenes(program.ProgramTest):
    def setUp(self):
        """Writes three scenes, and places them between one another."""
        write_scene("a.ply", many(1500, degree=3), 3)
        write_scene("b.ply", many(1000, seed=2, degree=1), 1)
        write_scene("c.ply", many(800, seed=3, spread=3))
        if not os.path.exists("c.trip"):
            self.works("brick", "c.ply", "-o", "c.trip", "-q")
        a, b, c = (definition.read_ply(name + ".ply") for name in "abc")
        turn, other = turn_of((1, 2, -0.5), 70), turn_of((0, 1, 1), -130)
        matrix = numpy.eye(4)
        matrix[:3, :3], matrix[:3, 3] = 0.6 * other, (0.4, 0.2, -0.3)
        self.objects = [
            {"data": "a.ply"},
            {"data": "b.ply", "translate": [0.5, -0.2, 0.3], "scale": 1.4,
             "rotate": {"axis": [1, 2, -0.5], "degrees": 70}},
            {"data": "c.trip", "matrix": matrix.ravel().tolist()},
            {"data": "a.ply", "translate": [-0.6, 0.5, 0], "rotate": {"axis": [0, 0, 2], "degrees": 90}}]
        self.truth = together(a, placed(b, turn, 1.4, (0.5, -0.2, 0.3)), placed(c, other, 0.6, (0.4, 0.2, -0.3)),
                              placed(a, turn_of((0, 0, 1), 90), 1, (-0.6, 0.5, 0)))
        write_objects("scene.json", *self.objects)

    def expect(self, expected, picture, why, mean=MEAN, most=MOST):
        self.assertGreater(expected[:, :, 3].mean(), 0.05)
        apart = 255 * numpy.abs(picture - expected)
        self.assertLess(apart.mean(), mean, why)
        self.assertLess(apart.max(), most, why)

    # ---- pictures ----

    def test_placed_scenes_are_drawn_as_one_scene_by_the_definition(self):
        for view in view_of((1.5, -1, 3)), view_of((-2, 0.4, 2.5), ortho_height=3):
            expected = definition.draw(self.truth, view)
            for renderer in "cpu", "reference", *program.GL:
                picture = self.picture("scene.json", *options_of(view), "--renderer", renderer)
                self.expect(expected, picture, renderer)

    def test_lists_and_distances_are_those_of_one_scene(self):
        """A list of the picture's axes is no list of a turned object, so its stream sorts more."""
        write_placed("one.ply", self.truth)
        for view in view_of((1.5, -1, 3)), view_of((-2, 0.4, 2.5), ortho_height=3):
            for order in "depth", "lists":
                pictures, distances = [], []
                for name in "one.ply", "scene.json":
                    self.works("render", name, "-o", "p.exr", "--depth", "z.exr", *options_of(view),
                               "--order", order)
                    pictures.append(program.read_exr("p.exr"))
                    distances.append(program.read_exr_channels("z.exr")[1][..., 0])
                self.expect(*pictures, order)
                seen = pictures[0][:, :, 3] > 0.1
                self.assertGreater(seen.sum(), 500)
                apart = numpy.abs(distances[1][seen] / distances[0][seen] - 1)
                self.assertLess(numpy.quantile(apart, 0.99), 0.005)
                self.assertLess(apart.max(), 0.05)

    def test_the_default_view_is_that_of_one_scene(self):
        """It fits the union of the typical bounds, which is a little larger than those of all Gaussians."""
        write_objects("moved.json", {"data": "c.ply"}, {"data": "c.ply", "translate": [9, 0, 0]})
        c = definition.read_ply("c.ply")
        write_placed("moved.ply", together(c, placed(c, move=(9, 0, 0))))
        eyes = []
        for name in "moved.ply", "moved.json":
            camera = self.stats(name, "--size", "64")["frames"][0]["camera"].split()
            eyes.append(numpy.array(camera[camera.index("--eye") + 1].split(","), float))
        numpy.testing.assert_allclose(eyes[1], eyes[0], atol=1)
        self.assertGreater(numpy.linalg.norm(eyes[0]), 9)

    def test_an_antialiased_scene_stays_so_beside_others(self):
        spz = write_spz("s.spz", 600, 4)
        b = definition.read_ply("b.ply")
        view = view_of((1.5, -1, 6))
        plain = definition.draw(together(spz, b), view)
        spz["opacity"] = definition.project(spz, view, antialiased=True)[2]
        expected = definition.draw(together(spz, b), view)
        self.assertGreater(255 * numpy.abs(expected - plain).mean(), 5 * MEAN)
        for objects in ["s.spz", "b.ply"], ["b.ply", "s.spz"]:
            write_objects("both.json", *({"data": name} for name in objects))
            self.expect(expected, self.picture("both.json", *options_of(view)), objects)

    def test_a_placed_scene_has_the_coarse_gaussians_of_the_moved_view(self):
        """The scene from the eye in its own space has the same rays, so coarse Gaussians stand for the same."""
        rows = numpy.array(many(60000, seed=7))
        rows[:, 7:10] = math.log(0.012)
        write_scene("far.ply", rows)
        turn, move, scale = turn_of((1, 2, -0.5), 70), numpy.array([0.5, -0.2, 0.3]), 0.5
        write_objects("far.json", {"data": "far.ply", "translate": move.tolist(), "scale": scale,
                                   "rotate": {"axis": [1, 2, -0.5], "degrees": 70}})
        for more in {}, {"ortho_height": 4}:
            view = view_of((8, -6, 9), size=(80, 60), fov=20, **more)
            own = view_of(turn.T @ (view["eye"] - move) / scale, turn.T @ (view["look"] - move) / scale,
                          turn.T @ view["up"], view["size"], view["fov"], **{k: v / scale for k, v in more.items()})
            pictures, counts = [], []
            for name, of in ("far.ply", own), ("far.json", view):
                pictures.append(self.picture(name, *options_of(of), "--lod", 8))
                counts.append([self.stats(name, *options_of(of), "--lod", lod)["frames"][0]["gaussians"]
                               for lod in range(1, 9)])
            self.assertEqual(*counts)
            self.assertGreater(len(set(counts[0])), 2)  # at first only some are coarse
            self.expect(*pictures, more)
            self.assertGreater(255 * numpy.abs(self.picture("far.json", *options_of(view), "--lod", 0)
                                               - pictures[1]).max(), 1)

    def test_the_order_of_the_objects_changes_no_bit(self):
        view = options_of(view_of((1.5, -1, 3)))
        one = self.picture("scene.json", *view)
        write_objects("back.json", *self.objects[::-1])
        self.assertTrue((one == self.picture("back.json", *view)).all())

    def test_threads_and_memory_change_no_bit(self):
        for order in "depth", "lists":
            one, *others = (self.picture("scene.json", "--size", "150x130", "--order", order, *o)
                            for o in ((), ("--threads", "1"), ("--threads", "5"), ("--memory", "60M")))
            for other in others:
                self.assertTrue((one == other).all(), order)

    def test_a_turntable_and_a_path_have_the_pictures_of_single_views(self):
        self.works("render", "scene.json", "--size", "40", "--orbit", "3", "-o", "o.exr")
        run = self.works("render", "scene.json", "--size", "40", "--orbit", "3", "-o", "p.exr", "--stats", "-")
        for i, frame in enumerate(json.loads(run.stdout)["frames"]):
            alone = self.picture("scene.json", *frame["camera"].split())
            numpy.testing.assert_allclose(program.read_exr(f"o-{i:03}.exr"), alone, atol=1e-4)
        keys = [{"seconds": t, "eye": [x, 0, 4], "look": [0, 0, 0], "up": [0, -1, 0], "fov": 40}
                for t, x in ((0, -1), (1, 1))]
        program.write("way.json", json.dumps({"triptych_path": 1, "frames_per_second": 2, "keys": keys}).encode())
        self.works("render", "scene.json", "--size", "40", "--path", "way.json", "-o", "f.exr")
        alone = self.picture("scene.json", *options_of(view_of((1, 0, 4), size=(40, 40), fov=40)))
        numpy.testing.assert_allclose(program.read_exr("f-002.exr"), alone, atol=1e-3)

    # ---- volumes ----

    RED, BLUE = (0.06, (0.9, 0.3, 0.1)), (0.03, (0.1, 0.4, 0.9))  # opacity per voxel, and colour

    def fog_box(self, name, shape, value):
        """Writes a constant volume. Its matter fills the box between its outer voxel centres."""
        program.write_nrrd(name, numpy.full(shape[::-1], value, "u1"))
        entries = ((7, self.RED), (9, self.BLUE))
        lines = [" ".join(map(str, (v + d, *colour, opacity))) for v, (opacity, colour) in entries for d in (-0.5, 0.5)]
        program.write("fog.tf", "\n".join(["values data", "unit voxel", *lines, ""]).encode())
        return "--tf", "fog.tf", "--no-shading"

    def fog_views(self, middle):
        """From the front, oblique, parallel, and from inside."""
        x, y, z = middle
        yield view_of((x, y, z + 90), middle, up=(0, 1, 0), fov=30)
        yield view_of((x + 50, y + 35, z + 60), middle, up=(0, 1, 0), fov=30)
        yield view_of((x + 50, y - 25, z - 60), middle, up=(0, 1, 0), ortho_height=40)
        yield view_of((x - 3, y + 2, z + 8), (x, y, z - 9), up=(0, 1, 0), fov=60)

    def test_gaussians_before_in_and_behind_fog_follow_the_closed_form(self):
        """The fog up to the depth of a centre attenuates the Gaussian, in oblique views and from inside too."""
        look = self.fog_box("box.nrrd", (24, 30, 33), 7)
        lo, hi = numpy.zeros(3), numpy.array([23, 29, 32.0])
        centres = [(12, 15, 45), (10, 14, 23.4), (14, 16, 9.7), (11, 13, -12)]
        colours = [(0.1, 0.9, 0.2), (0.2, 0.3, 0.9), (0.9, 0.9, 0.1), (0.9, 0.1, 0.9)]
        write_scene("dots.ply", [row(c, rgb, 0.7, (4, 3, 3.5)) for c, rgb in zip(centres, colours)])
        dots = definition.read_ply("dots.ply")
        write_objects("fog.json", {"data": "box.nrrd"}, {"data": "dots.ply"})
        for view in self.fog_views((12, 15, 16)):
            enters, leaves, stretch = depths_within(view, lo, hi)
            enters, leaves = numpy.maximum(enters, 0), numpy.maximum(leaves, 0)

            truth, at = numpy.zeros((*view["size"][::-1], 4)), enters
            for i in definition.order(dots, view):
                depth = (dots["centre"][i] - view["eye"]) @ definition.basis_of(view)[2]
                until = numpy.clip(depth, at, leaves)
                truth = over(truth, fog((until - at) * stretch, self.RED))
                truth = over(truth, definition.draw({k: v[i:i + 1] for k, v in dots.items()}, view))
                at = until
            truth = over(truth, fog((leaves - at) * stretch, self.RED))
            picture = self.picture("fog.json", *look, *options_of(view), "--early-termination", 0)
            apart = 255 * numpy.abs(picture - truth)
            wrong = over(definition.draw(dots, view), fog((leaves - enters) * stretch, self.RED))
            self.assertGreater(255 * numpy.abs(wrong - truth).max(), 20)
            self.assertLess(apart.mean(), MEAN)
            self.assertLess(apart.max(), 0.3)

    def test_two_fogs_within_one_another_follow_the_closed_form(self):
        """Where both are, their extinctions add up. The second one is turned, and scaled by 0.5: its opacity
        per voxel stays."""
        look = self.fog_box("red.nrrd", (24, 30, 33), 7)
        self.fog_box("blue.nrrd", (40, 36, 44), 9)
        turn, move, scale = turn_of((1, 1, 0.3), 40), numpy.array([2, 14, 4.0]), 0.5
        matrix = numpy.eye(4)
        matrix[:3, :3], matrix[:3, 3] = scale * turn, move
        objects = [{"data": "red.nrrd"}, {"data": "blue.nrrd", "matrix": matrix.ravel().tolist()}]
        write_objects("fogs.json", *objects)
        write_objects("back.json", *objects[::-1])
        for view in self.fog_views((12, 15, 16)):
            own = view_of(turn.T @ (view["eye"] - move) / scale, turn.T @ (view["look"] - move) / scale,
                          turn.T @ view["up"], view["size"], view["fov"])
            if view.get("ortho_height"):
                own["ortho_height"] = view["ortho_height"] / scale
            red = depths_within(view, (0, 0, 0), (23, 29, 32))
            blue = depths_within(own, (0, 0, 0), (39, 35, 43))
            spans = [(red[0], red[1], red[2], self.RED), (blue[0] * scale, blue[1] * scale, blue[2] / scale, self.BLUE)]
            ends = numpy.sort(numpy.maximum([end for span in spans for end in span[:2]], 0), axis=0)
            truth = numpy.zeros((*view["size"][::-1], 4))
            for a, b in zip(ends, ends[1:]):
                lengths = [numpy.where((from_ < b) & (to > a), (b - a) * stretch, 0) for from_, to, stretch, _ in spans]
                taus = [-math.log(1 - kind[0]) * length for (*_, kind), length in zip(spans, lengths)]
                alpha = -numpy.expm1(-sum(taus))
                colour = sum(tau[:, :, None] * numpy.array(kind[1]) for (*_, kind), tau in zip(spans, taus))
                colour /= numpy.maximum(sum(taus), 1e-300)[:, :, None]
                truth = over(truth, numpy.dstack([alpha[:, :, None] * colour, alpha]))
            alone = [self.picture(o["data"], *look, *options_of(view)) for o in objects[:1]]
            self.assertGreater(255 * numpy.abs(alone[0] - truth).max(), 20)
            for name in "fogs.json", "back.json":
                apart = 255 * numpy.abs(self.picture(name, *look, *options_of(view), "--early-termination", 0) - truth)
                self.assertLess(apart.mean(), MEAN)
                self.assertLess(apart.max(), 0.5)

    def test_a_volume_alone_is_drawn_as_without_a_scene_file(self):
        """A placement of the volume and of the view by powers of two gives the same rays."""
        look = self.fog_box("alone.nrrd", (20, 18, 16), 9)
        matrix = numpy.diag([2.0, 2, 2, 1])
        write_objects("alone.json", {"data": "alone.nrrd", "matrix": matrix.ravel().tolist()})
        view, there = view_of((30, 20, 40), (10, 9, 8)), view_of((60, 40, 80), (20, 18, 16))
        a = self.picture("alone.nrrd", *look, *options_of(view), "--background", "0,0,0,0")
        b = self.picture("alone.json", *look, *options_of(there))
        self.assertGreater(a[:, :, 3].max(), 0.2)
        self.assertLess(255 * numpy.abs(a - b).max(), 0.5)

    def test_clip_planes_cut_volumes_and_scenes_alike(self):
        look = self.fog_box("cut.nrrd", (24, 24, 24), 9)
        write_scene("cut.ply", [row((6, 12, 12), (0, 1, 0), 0.9, (2, 2, 2)), row((18, 12, 12), (1, 0, 0), 0.9, (2, 2, 2))])
        write_scene("left.ply", [row((6, 12, 12), (0, 1, 0), 0.9, (2, 2, 2))])
        program.write_nrrd("half.nrrd", numpy.full((24, 24, 13), 9, "u1"))
        turned = {"rotate": {"axis": [0, 0, 1], "degrees": 90}, "translate": [23, 0, 0]}
        write_objects("cut.json", {"data": "cut.nrrd", **turned}, {"data": "cut.ply"})
        write_objects("half.json", {"data": "half.nrrd"}, {"data": "left.ply"})
        view = options_of(view_of((12, 30, 70), (12, 12, 12), up=(0, 1, 0), fov=40))
        cut = self.picture("cut.json", *look, *view, "--clip-plane=-1,0,0,12")
        half = self.picture("half.json", *look, *view)
        self.assertGreater(half[:, :, 3].max(), 0.8)
        self.assertLess(255 * numpy.abs(cut - half).mean(), 0.3)
        self.assertLess(255 * numpy.abs(cut - half).max(), 6)

    def test_volumes_beside_scenes_in_turntables_memory_and_threads(self):
        look = self.fog_box("mixed.nrrd", (40, 40, 40), 7)
        write_objects("mixed.json", {"data": "mixed.nrrd", "scale": 0.05, "translate": [-1, -1, -1]}, *self.objects)
        self.works("render", "mixed.json", *look, "--size", "40", "--orbit", "2", "-o", "o.exr")
        run = self.works("render", "mixed.json", *look, "--size", "40", "--orbit", "2", "-o", "p.exr", "--stats", "-")
        stats = json.loads(run.stdout)
        for i, frame in enumerate(stats["frames"]):
            alone = self.picture("mixed.json", *look, *frame["camera"].split())
            numpy.testing.assert_allclose(program.read_exr(f"o-{i:03}.exr"), alone, atol=1e-4)
            self.assertEqual(frame["gaussians"], 4800)
        self.assertLess(stats["memory_peak_bytes"], stats["memory_limit_bytes"])
        one, *others = (self.picture("mixed.json", *look, "--size", "150x130", *o)
                        for o in ((), ("--threads", "1"), ("--threads", "5"), ("--memory", "100M")))
        for other in others:
            self.assertTrue((one == other).all())
        stats = self.stats("mixed.json", *look, "--size", "150x130", "--memory", "100M")
        self.assertEqual(stats["memory_limit_bytes"], 100 << 20)
        self.assertLessEqual(stats["memory_peak_bytes"], 100 << 20)
        if not program.SANITIZED:
            self.assertLess(stats["peak_rss_bytes"], 132 << 20)
        fine = self.picture("mixed.json", *look, "--size", "64", "--samples", "2")
        coarse = self.picture("mixed.json", *look, "--size", "64")
        self.assertTrue(0 < 255 * numpy.abs(fine - coarse).mean() < 6)

    # ---- runs ----

    def test_the_statistics_count_the_gaussians_of_each_object(self):
        frame = self.stats("scene.json", *options_of(view_of((0, 0, 30), fov=20)))["frames"][0]
        self.assertEqual(frame["gaussians_by_object"], [1500, 1000, 800, 1500])
        self.assertEqual(frame["gaussians"], 4800)
        text = self.works("render", "scene.json", "--size", "40", "-o", "a.png", "--explain").stdout.decode()
        self.assertIn("object 3    800 Gaussians", text)

    def test_a_thousand_objects_fit_a_small_memory(self):
        """Each object is open only while the merge is within its depths."""
        places = [[3.0 * (i % 10), 3.0 * (i // 10 % 10), 3.0 * (i // 100)] for i in range(1000)]
        write_objects("many.json", *({"data": "a.ply", "translate": place} for place in places))
        view = options_of(view_of((13, 13, -60), (13, 13, 0), fov=60))
        frame = self.stats("many.json", *view, "--memory", "160M")
        self.assertEqual(frame["frames"][0]["gaussians_by_object"], 1000 * [1500])
        self.assertLessEqual(frame["memory_peak_bytes"], 160 << 20)
        if not program.SANITIZED:
            self.assertLess(frame["peak_rss_bytes"], 192 << 20)
        self.fails(1, "render", "many.json", "-o", "a.png", *view, "--memory", "64M", says="raise --memory")

    def test_paths_are_relative_to_the_file(self):
        os.makedirs("folder", exist_ok=True)
        shutil.copy("b.ply", "folder/own.ply")
        write_objects("folder/scene.json", {"data": "own.ply"}, {"data": "../c.trip"},
                      {"data": os.path.abspath("a.ply")})
        self.assertGreater(self.picture("folder/scene.json", "--size", "40")[:, :, 3].max(), 0.5)

    def test_info_tells_the_places(self):
        info = json.loads(self.works("info", "--json", "scene.json").stdout)
        self.assertEqual([o["data"] for o in info["objects"]], ["a.ply", "b.ply", "c.trip", "a.ply"])
        numpy.testing.assert_allclose(info["objects"][2]["matrix"], self.objects[2]["matrix"])
        turned = numpy.array(info["objects"][1]["matrix"]).reshape(4, 4)
        numpy.testing.assert_allclose(turned[:3, :3], 1.4 * turn_of((1, 2, -0.5), 70), atol=1e-12)
        text = self.works("info", "scene.json").stdout.decode()
        self.assertIn("scaled by 1.4, turned by 70 degrees, moved by 0.5, -0.2, 0.3", text)

    def test_the_picture_overwrites_no_object(self):
        program.write("only.json", b'{"objects": [{"data": "d.exr"}]}')
        shutil.copy("b.ply", "d.exr")
        with open("d.exr", "rb") as file:
            before = file.read()
        self.fails(2, "render", "only.json", "-o", "d.exr")
        with open("d.exr", "rb") as file:
            self.assertEqual(file.read(), before)

    # ---- refusals ----

    def refused(self, text, says, status=1):
        program.write("bad.json", text if isinstance(text, bytes) else json.dumps(text).encode())
        for command in ("render", "bad.json", "-o", "bad.png"), ("info", "bad.json"):
            self.leaves_nothing(status, *command, says=says)

    def object_refused(self, says, **members):
        self.refused({"objects": [{"data": "a.ply"}, {"data": "b.ply", **members}]}, says)

    def test_each_fault_of_a_file_is_one_line(self):
        self.refused(b"", "is not JSON")
        self.refused(b"objects", "is not JSON")
        self.refused(b'{"objects": [{"data": "a.ply"}', "is not JSON")
        self.refused(b'{"objects": [{"data": "a.ply"}]} more', "text behind its JSON")
        self.refused(b'{"objects": [{"data": "a.ply", "scale": NaN}]}', "is not JSON")
        self.refused(b'{"objects": [{"data": "a.ply"}]}\0', "byte 0")
        self.refused(b"[" * 100000, "nested")
        self.refused(b" " * (1 << 25), "larger than 16 MiB")
        self.refused([], "must be an object with a list")
        self.refused({}, "must be a list of 1 to 16384 objects")
        self.refused({"objects": []}, "must be a list of 1 to 16384 objects")
        self.refused({"objects": 16385 * [{"data": "a.ply"}]}, "must be a list of 1 to 16384 objects")
        self.refused({"objects": [{"data": "a.ply"}], "light": 1}, "light is no member")
        self.refused(b'{"objects": [{"data": "a.ply", "data": "b.ply"}]}', "object 1: data is given twice")
        self.refused({"objects": [3]}, "object 1: is no JSON object")
        self.refused({"objects": [{"scale": 1}]}, "object 1: data must be the path")
        self.refused({"objects": [{"data": "absent.ply"}]}, "absent.ply: cannot open")
        write_objects("inner.json", {"data": "a.ply"})
        self.refused({"objects": [{"data": "inner.json"}]}, "inner.json is a scene file itself")
        self.refused({"objects": [{"data": "bad.json"}]}, "bad.json is a scene file itself")

    def test_each_fault_of_a_place_is_one_line(self):
        self.object_refused("object 2: turn is no member", turn=1)
        self.object_refused("translate must be 3 finite numbers", translate=[1, 2])
        self.object_refused("translate must be 3 finite numbers", translate=[1, 2, "3"])
        self.object_refused("scale must be a finite number", scale="2")
        self.object_refused("scale must be above 0", scale=0)
        self.object_refused("scale must be above 0", scale=-1)
        self.object_refused("rotate must have an axis and degrees", rotate=90)
        self.object_refused("rotate needs an axis with a length", rotate={"axis": [0, 0, 0], "degrees": 1})
        self.object_refused("rotate has no degrees", rotate={"axis": [0, 0, 1]})
        self.object_refused("matrix must be 16 finite numbers", matrix=[1, 0, 0, 0])
        self.object_refused("last row", matrix=numpy.arange(16).tolist())
        self.object_refused("scale and matrix exclude each other", scale=2, matrix=numpy.eye(4).ravel().tolist())
        self.refused(b'{"objects": [{"data": "a.ply", "scale": 1e999}]}', "scale must be a finite number")

    def test_a_matrix_that_no_gaussian_scene_can_have_is_refused(self):
        for diagonal in (0, 0, 0), (1, 1, 0), (1, 1, 2), (-1, 1, 1), (1e-200, 1e200, 1):
            matrix = numpy.diag([*diagonal, 1]).ravel().tolist()
            write_objects("bad.json", {"data": "a.ply"}, {"data": "b.ply", "matrix": matrix})
            self.leaves_nothing(2, "render", "bad.json", "-o", "bad.png", says="scale it evenly")
        shear = numpy.eye(4)
        shear[0, 1] = 0.5
        write_objects("bad.json", {"data": "b.ply", "matrix": shear.ravel().tolist()})
        self.leaves_nothing(2, "render", "bad.json", "-o", "bad.png", says="scale it evenly")

    def test_commands_and_options_for_data_sets_refuse_scene_files(self):
        for command in ("accuracy", "scene.json", "-o", "r"), ("bench", "stream", "scene.json"):
            self.leaves_nothing(1, *command, says="scene.json: is not a data set")
        self.leaves_nothing(2, "brick", "scene.json", "-o", "x.trip",
                            says="scene.json: is a scene file; `triptych render` draws it")
        self.leaves_nothing(2, "render", "scene.json", "-o", "x.png", "--spacing", "1,1,1", says="--spacing")
        self.leaves_nothing(2, "render", "scene.json", "-o", "x.png", "--classify", "pre", says="--classify")
        for name in "scene.json", "c.trip":
            self.leaves_nothing(2, "render", name, "-o", "x.png", "--clip-box", "voxels:0,0,0,1,1,1",
                                says="voxels: does not apply")
        self.leaves_nothing(2, "info", "--verify", "scene.json", says="--verify: applies to data sets only")
        self.leaves_nothing(2, "render", "scene.json", "c.trip", "-o", "x.png", says="scene file")


if __name__ == "__main__":
    program.main()
