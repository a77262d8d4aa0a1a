"""Compares the renderers of Gaussian scenes with definition.py, on two scenes in seven views each.

    test_definition.py DRAW_DUMP
"""
import math
import os
import subprocess
import sys
import tempfile
import unittest

import numpy

import definition

DRAW = sys.argv.pop()
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "cli"))
import program  # noqa: E402

DATASETS = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "datasets")
UP = numpy.array([0.0, -1, 0])  # captures are y-down
MEAN, MOST = 0.1, 2.0  # of 255


def around(scene, size, count, distance):
    """Views from a circle above and below the middle 96 % of the centres."""
    lo, hi = numpy.percentile(scene["centre"], [2, 98], axis=0)
    middle, radius = (lo + hi) / 2, numpy.linalg.norm(hi - lo) / 2
    for i in range(count):
        turn, rise = 2 * math.pi * i / count + 0.3, (-0.35, 0.1)[i % 2]
        away = numpy.array([math.cos(turn) * math.cos(rise), math.sin(rise),
                            math.sin(turn) * math.cos(rise)])
        yield {"eye": middle + away * radius * distance, "look": middle, "up": UP, "fov": 50,
               "size": size}


def write_dump(path, scene, view, antialiased):
    nearest_first = definition.order(scene, view)
    count = len(nearest_first)
    coefficients = numpy.zeros((count, 16, 3))
    coefficients[:, :scene["sh"].shape[1]] = scene["sh"][nearest_first]
    degree = math.isqrt(scene["sh"].shape[1]) - 1
    header = [*view["size"], view.get("ortho_height", 0), view["fov"], *view["eye"], *view["look"],
              *view["up"], degree, antialiased, 1, 0, 0]
    numbers = numpy.column_stack([scene[key][nearest_first] for key in
                                  ("centre", "deviations", "rotation", "opacity")]
                                 + [coefficients.reshape(count, 48)])
    with open(path, "wb") as file:
        file.write(numpy.array(header, "<f8").tobytes())
        file.write(numbers.astype("<f8").tobytes())


def read_scaled(name, scale):
    """Reads a scene and scales it, so that the near plane removes little of a small one."""
    scene = definition.read_ply(os.path.join(DATASETS, name))
    scene["centre"] = scene["centre"] * scale
    scene["deviations"] = scene["deviations"] * scale
    return scene


class Definition(unittest.TestCase):
    def pictures(self, scene, view, antialiased=False):
        """Yields the picture of each renderer."""
        width, height = view["size"]
        with tempfile.TemporaryDirectory() as folder:
            dump, out = os.path.join(folder, "scene"), os.path.join(folder, "picture")
            write_dump(dump, scene, view, antialiased)
            for renderer in ("cpu", "reference", *program.GL):
                subprocess.run([DRAW, dump, out, renderer, "2"], check=True)
                yield renderer, numpy.fromfile(out, "<f4").reshape(height, width, 4)

    def expect_definition(self, scene, view, antialiased=False, opacity=0.0):
        expected = definition.draw(scene, view, antialiased)
        self.assertGreater(expected[:, :, 3].mean(), opacity)
        for renderer, picture in self.pictures(scene, view, antialiased):
            apart = 255 * numpy.abs(picture - expected)
            self.assertLess(apart.mean(), MEAN, renderer)
            self.assertLess(apart.max(), MOST, renderer)

    def expect_all_views(self, name, scale, distance, opacity):
        scene = read_scaled(name, scale)
        views = list(around(scene, (192, 128), 6, distance))
        for view in views:
            with self.subTest(scene=name, eye=view["eye"]):
                self.expect_definition(scene, view, opacity=opacity)
        views[0]["ortho_height"] = numpy.linalg.norm(views[0]["eye"] - views[0]["look"]) * 0.8
        self.expect_definition(scene, views[0], antialiased=True, opacity=opacity)

    def test_a_slice_of_a_donut_in_seven_views(self):
        self.expect_all_views("donut_slice.ply", 20, 2.2, 0.05)

    def test_a_train_with_harmonics_in_seven_views(self):
        self.expect_all_views("train-1000.ply", 1, 1.2, 0.005)

    def test_a_view_among_the_gaussians_clamps_the_jacobian(self):
        scene = read_scaled("donut_slice.ply", 20)
        scene["centre"] -= numpy.median(scene["centre"], axis=0)
        view = {"eye": numpy.array([0.1, 0.2, 0.3]), "look": numpy.array([-1.0, 0.2, 0.3]), "up": UP,
                "fov": 35, "size": (96, 128)}
        offset = (scene["centre"] - view["eye"]) @ definition.basis_of(view).T
        z = offset[:, 2]
        beyond = numpy.abs(offset[:, 1] / z) > 1.3 * math.tan(math.radians(17.5))
        self.assertGreater((beyond & (z > definition.NEAR)).sum(), 100)
        self.expect_definition(scene, view, opacity=0.3)


class Harmonics(unittest.TestCase):
    def test_they_are_those_of_known_directions(self):
        values = definition.harmonics(16, numpy.array([[0, 0, 1.0], [1, 0, 0], [0, 1, 0]]))
        one, three = math.sqrt(1 / (4 * math.pi)), math.sqrt(3 / (4 * math.pi))
        numpy.testing.assert_allclose(values[:, 0], one)
        numpy.testing.assert_allclose(values[:, 1:4], three * numpy.array(
            [[0, 1, 0], [0, 0, -1], [-1, 0, 0]]), atol=1e-15)
        numpy.testing.assert_allclose(values[0, [6, 12]], [math.sqrt(5 / (4 * math.pi)),
                                                            math.sqrt(7 / (4 * math.pi))])


if __name__ == "__main__":
    program.main()
