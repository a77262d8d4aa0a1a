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
                apart = numpy.abs(distances[1] / distances[0] - 1)[seen]
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
        self.refused(b" " * (1 << 21), "larger than 1 MiB")
        self.refused([], "must be an object with a list")
        self.refused({}, "must be a list of 1 to 1000 objects")
        self.refused({"objects": []}, "must be a list of 1 to 1000 objects")
        self.refused({"objects": 1001 * [{"data": "a.ply"}]}, "must be a list of 1 to 1000 objects")
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

    def test_other_commands_and_options_refuse_scene_files(self):
        for command in ("accuracy", "scene.json", "-o", "r"), ("bench", "stream", "scene.json"):
            self.leaves_nothing(1, *command, says="scene.json: is not a data set")
        for command in ("view", "scene.json"), ("serve", "scene.json"), ("brick", "scene.json", "-o", "x.trip"):
            self.leaves_nothing(2, *command, says="scene.json: is a scene file; `triptych render` draws it")
        self.leaves_nothing(2, "render", "scene.json", "-o", "x.png", "--spacing", "1,1,1", says="--spacing")
        self.leaves_nothing(2, "render", "scene.json", "-o", "x.png", "--classify", "pre", says="--classify")
        self.leaves_nothing(2, "render", "scene.json", "c.trip", "-o", "x.png", says="scene file")


if __name__ == "__main__":
    program.main()
