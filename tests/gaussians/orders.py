#!/usr/bin/python3
"""Prints how the orders of a Gaussian scene differ, and how much each of them pops.

    tests/gaussians/orders.py TRIPTYCH NAME.trip...

- Difference: of red, green and blue from `--order depth`, of 255, over all pixels of four views.
- Pops: the greatest second difference of a pixel, of 255, while the view turns in steps of 0.05
  degrees. Smooth motion has small second differences, so large ones are pops."""
import os
import subprocess
import sys
import tempfile

import numpy

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "cli"))
from exr import read_exr  # noqa: E402

VIEWS = 0, 70, 160, 250
WAYS = {"depth": [], "lists": ["--order", "lists"], "depth, --kernel exact": ["--kernel", "exact"]}


def draw(program, scene, path, *options):
    subprocess.run([program, "render", scene, "-o", path, "--background", "black", *options],
                   check=True, stdout=subprocess.DEVNULL)
    return 255 * read_exr(path)[..., :3]


def turned(program, scene, path, degrees, *options):
    return draw(program, scene, path, "--azimuth", repr(degrees), *options)


def compare(program, scene, path):
    truth = [turned(program, scene, path, v, "--size", "1024") for v in VIEWS]
    for name, options in WAYS.items():
        apart = [abs(turned(program, scene, path, v, "--size", "1024", *options) - t)
                 for v, t in zip(VIEWS, truth)]
        frames = [turned(program, scene, path, 20 + 0.05 * i, "--size", "512", *options)
                  for i in range(9)]
        pops = [abs(a - 2 * b + c).max() for a, b, c in zip(frames, frames[1:], frames[2:])]
        print("%s, %s: mean %.2f, maximum %.0f; pops %.1f" %
              (os.path.basename(scene), name, numpy.mean(apart), numpy.max(apart), max(pops)),
              flush=True)


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    with tempfile.TemporaryDirectory() as folder:
        for scene in sys.argv[2:]:
            compare(sys.argv[1], scene, os.path.join(folder, "picture.exr"))


if __name__ == "__main__":
    main()
