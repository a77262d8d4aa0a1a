#!/usr/bin/python3
"""Prints a table of a scene from near to far: Gaussians drawn, bytes read and errors, with coarse
levels (--lod 1) and without (--lod 0).

    tests/gaussians/levels.py TRIPTYCH NAME.trip...

- Error: mean difference of red, green and blue from the whole scene with 4 x 4 samples, of 255, over
  the picture, and over the pixels that the scene covers.
- Jump: the greatest mean difference of two frames when the eye moves away by 1 % a frame."""
import json
import os
import subprocess
import sys
import tempfile

import numpy

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "cli"))
from exr import read_exr  # noqa: E402

NEAR, FAR, FOV, SIZE, ZOOM_SIZE = 1.2, 80, 40, 512, 128


class Scene:
    def __init__(self, program, path, folder):
        self.program, self.path, self.out = program, path, os.path.join(folder, "picture.exr")
        run = subprocess.run([program, "info", "--json", path], check=True, stdout=subprocess.PIPE)
        info = json.loads(run.stdout)
        lo, hi = numpy.array(info["typical_bounds"])
        self.up = -1 if info["y_down"] else 1
        self.middle, self.radius = (lo + hi) / 2, numpy.linalg.norm(hi - lo) / 2

    def draw(self, distance, size, *options):
        """Draws from so many radii away. Returns the picture and its statistics."""
        eye = self.middle + distance * self.radius * numpy.array([0.48, 0.36 * self.up, 0.8 * self.up])

        def text(vector):
            return ",".join(repr(float(x)) for x in vector)

        stats = subprocess.run(
            [self.program, "render", self.path, "-o", self.out, "--background", "white", "--eye",
             text(eye), "--look", text(self.middle), "--up", text([0, self.up, 0]), "--fov",
             str(FOV), "--size", str(size), "--stats", "-", *options],
            check=True, stdout=subprocess.PIPE).stdout
        return 255 * read_exr(self.out)[..., :3].clip(0, 1), json.loads(stats)["frames"][0]


def print_path(scene):
    distance = NEAR
    while distance < FAR:
        truth, _ = scene.draw(distance, SIZE, "--lod", "0", "--samples", "4")
        covered = (truth < 254).any(axis=2)
        row = "| %s | %.1f |" % (os.path.basename(scene.path)[:-5], distance)
        for lod in "0", "1":
            picture, stats = scene.draw(distance, SIZE, "--lod", lod)
            apart = abs(picture - truth)
            row += " %d | %d | %.2f | %.1f |" % (stats["gaussians"], stats["bytes_read"],
                                                 apart.mean(), apart[covered].mean())
        print(row, flush=True)
        distance *= 2


def print_jumps(scene):
    found = []
    for lod in "0", "1":
        distance, before, jumps = NEAR, None, []
        while distance < FAR:
            picture, _ = scene.draw(distance, ZOOM_SIZE, "--lod", lod)
            if before is not None:
                jumps.append(abs(picture - before).mean())
            before = picture
            distance *= 1.01
        found.append(max(jumps))
        far = jumps[len(jumps) // 3:]
        found.append(max(far))
    print("%s: greatest jump without levels %.3f (beyond the first third %.3f), with levels %.3f (%.3f)"
          % (os.path.basename(scene.path), *found), flush=True)


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    with tempfile.TemporaryDirectory() as folder:
        scenes = [Scene(sys.argv[1], path, folder) for path in sys.argv[2:]]
        print("| scene | radii | Gaussians, 0 | bytes, 0 | error, 0 | covered, 0 | Gaussians, 1 |"
              " bytes, 1 | error, 1 | covered, 1 |")
        print("|---|" + "---:|" * 9)
        for scene in scenes:
            print_path(scene)
        for scene in scenes:
            print_jumps(scene)


if __name__ == "__main__":
    main()
