"""Tests that the examples of README.md run unchanged and draw the picture that they promise."""
import gzip
import os
import re
import shlex
import struct
import unittest

import program

try:
    import numpy
    from PIL import Image
except ImportError:
    print("skipped: python3-pil is not installed")
    raise SystemExit(program.SKIPPED)

ROOT = os.environ["TRIP_SOURCE_DIR"]
# Other tests cover these commands: they install, wait for a person, or measure for long.
ELSEWHERE = ("./demo.sh", "./check.sh", "export", "tests/compare/compare", "triptych view",
             "triptych serve", "triptych bench", "triptych accuracy")
# Replacements that make an example faster: smaller volumes, fewer pictures, a given error.
SMALLER = (("512x512x512", "128x128x128"), ("-s 512", "-s 128"), ("--memory 64M", "--memory 96M"),
           ("--orbit 60", "--orbit 3"), ("turn.mp4", "turn.png"), ("--size 512", "--size 96"))


def examples():
    """Yields the command lines in the shell blocks of README.md, without comments."""
    with open(os.path.join(ROOT, "README.md"), encoding="utf-8") as f:
        blocks = re.findall(r"^```sh\n(.*?)^```$", f.read(), re.S | re.M)
    for line in "".join(blocks).replace("\\\n", " ").splitlines():
        words = shlex.split(line, comments=True)
        if words:
            yield shlex.join(words)


def read_picture(path):
    with Image.open(path) as image:
        return numpy.asarray(image.convert("RGB")).astype(int)


def read_nifti(path):
    """Returns the values of a NIfTI file with the axes Z, Y, X, and the affine map to world space."""
    with gzip.open(path) as f:
        data = f.read()
    sizes = struct.unpack_from("<3h", data, 42)
    code, = struct.unpack_from("<h", data, 70)
    offset, = struct.unpack_from("<f", data, 108)
    values = numpy.frombuffer(data, {2: "u1", 4: "<i2"}[code], numpy.prod(sizes), int(offset))
    return values.reshape(sizes[::-1]), numpy.frombuffer(data, "<f4", 12, 280).reshape(3, 4)


def read_nrrd(path):
    """Returns the values of stent.nrrd with the axes Z, Y, X. Its voxels are world units."""
    with open(path, "rb") as f:
        header, data = f.read().split(b"\n\n", 1)
    sizes = [int(n) for n in re.search(rb"^sizes: (.*)$", header, re.M)[1].split()]
    return numpy.frombuffer(gzip.decompress(data), "<f4").reshape(sizes[::-1]), numpy.eye(3, 4)


def covered(path):
    """Returns which pixels differ clearly from the background."""
    pixels = read_picture(path)
    return abs(pixels - pixels[0, 0]).max(axis=-1) > 24


def read_camera(text):
    """Returns the options of the view that --explain prints, as a function of their names."""
    return lambda name: numpy.array(re.search(rf"--{name} (\S+)", text)[1].split(","), float)


def outline(solid, affine, option, size):
    """Returns which pixels show the centre of a solid voxel."""
    points = numpy.stack(numpy.nonzero(solid)[::-1], axis=1) @ affine[:, :3].T + affine[:, 3]
    front = option("look") - option("eye")
    right = numpy.cross(front, option("up"))
    down = numpy.cross(front, right)
    axes = numpy.stack([axis / numpy.linalg.norm(axis) for axis in (right, down, front)])
    x, y, depth = ((points - option("eye")) @ axes.T).T
    scale = size / 2 / numpy.tan(numpy.radians(option("fov")[0] / 2)) / depth
    seen = numpy.zeros((size, size), bool)
    seen[(size / 2 + scale * y).astype(int), (size / 2 + scale * x).astype(int)] = True
    return seen


def share(a, b):
    """Returns which share of the pixels in a or b is in both."""
    return (a & b).sum() / (a | b).sum()


class Readme(program.ProgramTest):
    def test_each_example_works_and_draws_a_picture(self):
        os.symlink(program.DATASETS, "datasets")
        pictures = 0
        recipes = {"bones.png", "brain.png", "cells.png", "smoke.png", "labels.png", "turn.png"}
        for line in examples():
            if line.startswith(ELSEWHERE) or "--error" in line:
                continue
            for large, small in SMALLER:
                line = line.replace(large, small)
            name, *arguments = shlex.split(line)
            with self.subTest(line):
                try:
                    program.skip_what_is_switched_off(arguments)
                except unittest.SkipTest:
                    recipes -= set(arguments)
                    continue
                self.works(*arguments, program={"triptych": program.PROGRAM,
                                                "triptych-generate": program.GENERATE}[name], timeout=200)
                if "render" in arguments:
                    path = arguments[arguments.index("-o") + 1]
                    self.assert_not_empty(path)
                    check = getattr(self, "check_" + os.path.splitext(path)[0], None)
                    if check:
                        recipes.discard(path)
                        check(path, arguments)
                    pictures += 1
        self.assertGreater(pictures, 6)
        self.assertEqual(recipes, set())

    def assert_not_empty(self, path):
        if not os.path.exists(path):
            path = path.replace(".png", "-000.png")
        pixels = read_picture(path)
        self.assertGreater((abs(pixels - pixels[0, 0]).max(axis=-1) > 16).mean(), 0.01, path)

    def assert_outline(self, path, line, solid, affine, side, overlap):
        """Asserts that the picture shows this side of the solid voxels: upright, not mirrored, and in
        their place."""
        line = ["outline.png" if word == path else word for word in line]
        camera = read_camera(self.works(*line, "--size", "128", "--explain").stdout.decode())
        towards = camera("eye") - camera("look")
        self.assertGreater(towards @ side, 0.7 * numpy.linalg.norm(towards))
        self.assertEqual(camera("up").tolist(), [0, 0, 1])
        expected = outline(solid, affine, camera, 128)
        picture = covered("outline.png")
        shares = [share(picture, turned) for turned in (expected, expected[::-1], expected[:, ::-1])]
        self.assertGreater(shares[0], overlap, shares)
        self.assertGreater(shares[0], max(shares[1:]) + 0.01, shares)

    def check_bones(self, path, line):
        """The front is -Y in a file without orientation. Metal is grey and the brightest. Vessels and bone
        have the colour of ivory."""
        values, affine = read_nrrd("datasets/stent.nrrd")
        self.assert_outline(path, line, values > 0.17, affine, (0, -1, 0), 0.7)
        pixels = read_picture(path).reshape(-1, 3)
        light = pixels.sum(axis=1)
        metal = pixels[light > 600]
        self.assertGreater(len(metal), 0.001 * len(pixels))
        self.assertLess(abs(metal - metal.mean(axis=1, keepdims=True)).mean(), 16)
        ivory = pixels[(light > 200) & (light < 450)]
        self.assertGreater((ivory[:, 0] - ivory[:, 2]).mean(), 20)

    def check_brain(self, path, line):
        """The face of a patient looks to +Y. The folds are bright, the furrows between them dark."""
        values, affine = read_nifti("datasets/ch2bet.nii.gz")
        self.assert_outline(path, line, values > 40, affine, (0, 1, 0), 0.9)
        light = read_picture(path).sum(axis=-1)[covered(path)]
        self.assertGreater(numpy.percentile(light, 95), 2 * numpy.percentile(light, 15))

    def check_cells(self, path, line):
        """The ball lacks its upper part, and its voxels are longer along Z."""
        with Image.open("datasets/cells.ome.tif") as image:
            pages = []
            for number in range(64, 128):  # the second channel
                image.seek(number)
                pages.append(numpy.asarray(image))
        walls = numpy.stack(pages) > 30
        walls[numpy.arange(64) * 0.6 > 21] = False
        self.assert_outline(path, line, walls, numpy.diag([0.25, 0.25, 0.6, 0])[:3], (0, 0, 1), 0.95)

    def check_smoke(self, path, _line):
        """The flame at the foot is orange, the smoke above it is grey."""
        pixels = read_picture(path)
        red_over_blue = pixels[..., 0] - pixels[..., 2]
        self.assertGreater((red_over_blue[3 * len(pixels) // 4:] > 60).mean(), 0.02)
        self.assertLess(abs(red_over_blue[:len(pixels) // 2]).max(), 40)
        self.assertGreater(pixels[:len(pixels) // 2].max(), 80)

    def check_labels(self, path, line):
        """The left side of a patient is -X. The regions have many hues."""
        labels, affine = read_nifti("datasets/inia19-NeuroMaps.nii.gz")
        self.assert_outline(path, line, labels != 0, affine, (-1, 0, 0), 0.9)
        regions = covered(path)
        with Image.open(path) as image:
            hue, saturation, _ = numpy.moveaxis(numpy.asarray(image.convert("HSV")).astype(int), -1, 0)
        hues = numpy.bincount(hue[regions & (saturation > 60)] // 16, minlength=16) / regions.sum()
        self.assertGreaterEqual((hues > 0.005).sum(), 9, hues)

    def check_turn(self, path, _line):
        """The background is white in each picture, and the tooth turns."""
        widths = set()
        for number in range(3):
            pixels = read_picture(path.replace(".png", f"-{number:03}.png"))
            for corner in (pixels[0, 0], pixels[0, -1], pixels[-1, 0], pixels[-1, -1]):
                self.assertEqual(corner.tolist(), [255, 255, 255])
            tooth = abs(pixels - 255).max(axis=-1) > 64
            self.assertTrue(tooth[len(tooth) // 3, len(tooth) // 2])
            widths.add(int(tooth.any(axis=0).sum()))
        self.assertGreater(len(widths), 1)

    def test_all_examples_have_known_options(self):
        for line in examples():
            name, *arguments = shlex.split(line)
            if name != "triptych":
                continue
            text = self.works(arguments[0], "--help=all").stdout.decode()
            for option in arguments:
                if option.startswith("--"):
                    self.assertIn(option.split("=")[0], text, line)

    def test_the_page_is_short_and_its_links_exist(self):
        with open(os.path.join(ROOT, "README.md"), encoding="utf-8") as f:
            text = f.read()
        self.assertLessEqual(text.count("\n"), 140)
        for page in ("README.md", "CONTRIBUTING.md", *(f"docs/{n}" for n in os.listdir(os.path.join(ROOT, "docs"))
                                                     if n.endswith(".md"))):
            with open(os.path.join(ROOT, page), encoding="utf-8") as f:
                text = re.sub(r"```.*?```", "", f.read(), flags=re.S)
            for link in re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", text):
                if not link.startswith("http"):
                    target = os.path.join(ROOT, os.path.dirname(page), link)
                    self.assertTrue(os.path.exists(target), f"{page}: {link}")


if __name__ == "__main__":
    program.main()
