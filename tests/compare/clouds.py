#!/usr/bin/python3
"""Compares pictures of clouds of points with a ray caster of opaque discs (tests/gaussians/discs.py),
and with other programs.

    tests/compare/clouds.py TRIPTYCH FOLDER CLOUD.ply...

Prints a line for each cloud and program: the mean difference of colours in pixels that both cover, of
255; the share of pixels that only one covers; and how far, in pixels, 99 % and all of these lie from
the other silhouette. Each pixel of the ray caster is the mean of 4 x 4 rays. FOLDER gets the pictures
side by side: the ray caster, Triptych deferred and by depth, and f3d with the same camera. A second
picture has Triptych and CloudCompare's viewer from the front, each with its own frame.

The Debian packages f3d, cloudcompare, xvfb and imagemagick are needed for the other programs; a
missing program is left out with a line.
"""
import os
import re
import shutil
import subprocess
import sys
import time

import numpy

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [os.path.join(HERE, "..", "gaussians"), os.path.join(HERE, "..", "cli")]
import discs  # noqa: E402
from exr import read_exr  # noqa: E402

SIZE, SCREEN, CLOUDCOMPARE_SECONDS = 512, ":97", 15


def call(*words, **more):
    return subprocess.run(words, capture_output=True, text=True, check=True, **more).stdout


def view_of(triptych, path):
    """Returns the default view by the names of its options, and for discs.py."""
    said = call(triptych, "render", path, "-o", "view.png", "--size", "16", "--explain", "-q")
    camera = dict(re.findall(r"--(eye|look|up|fov) (\S+)", re.search("^camera.*$", said, re.M).group()))
    view = {k: numpy.array([float(x) for x in camera[k].split(",")]) for k in ("eye", "look", "up")}
    view.update(fov=float(camera["fov"]), size=(SIZE, SIZE))
    return camera, view


def draw_by_triptych(triptych, path, camera, order):
    options = [f"--{k}={v}" for k, v in camera.items()]
    call(triptych, "render", path, "-o", f"{order}.exr", "-q", "--order", order, "--size", str(SIZE),
         "--background", "transparent", *options)
    return read_exr(f"{order}.exr")


def draw_by_f3d(path, camera):
    """Points of one pixel with the colours of the file, by f3d. Returns None if it is missing."""
    if not shutil.which("f3d") or not shutil.which("xvfb-run"):
        print("left out: f3d or xvfb is not installed")
        return None
    call("xvfb-run", "-a", "f3d", path, f"--camera-position={camera['eye']}",
         f"--camera-focal-point={camera['look']}", f"--camera-view-up={camera['up']}",
         f"--camera-view-angle={camera['fov']}", f"--resolution={SIZE},{SIZE}", "--bg-color=0,0,0", "-s",
         "--comp=-2", "-o", "--point-size=0", "--output=f3d.png", timeout=120)
    call("convert", "f3d.png", "-alpha", "off", "-depth", "8", "rgb:f3d.rgb")
    rgb = numpy.fromfile("f3d.rgb", "u1").reshape(SIZE, SIZE, 3) / 255
    return numpy.dstack([rgb, (rgb.max(2) > 0).astype(float)])


def beside_cloudcompare(triptych, path, name):
    if not shutil.which("ccViewer") or not shutil.which("import"):
        print("left out: cloudcompare or imagemagick is not installed")
        return
    with subprocess.Popen(["Xvfb", SCREEN, "-screen", "0", "900x700x24"], stderr=subprocess.DEVNULL) as screen:
        time.sleep(1)
        shown = dict(os.environ, DISPLAY=SCREEN, LIBGL_ALWAYS_SOFTWARE="1")
        with subprocess.Popen(["ccViewer", path], env=shown, stderr=subprocess.DEVNULL) as viewer:
            time.sleep(CLOUDCOMPARE_SECONDS)
            call("import", "-window", "root", "window.png", env=shown)
            viewer.kill()
        screen.kill()
    call(triptych, "render", path, "-o", "front.png", "-q", "--size", "700", "--view", "front", "--ortho", "fit")
    call("convert", "front.png", "window.png", "+append", f"{name}-cloudcompare.png")


def write_png(name, picture):
    rgb = numpy.clip(255 * picture[:, :, :3] + 0.5, 0, 255).astype("u1")
    with open("picture.rgb", "wb") as f:
        f.write(rgb.tobytes())
    call("convert", "-size", f"{SIZE}x{SIZE}", "-depth", "8", "rgb:picture.rgb", name)


def main(triptych, folder, *paths):
    triptych, paths = os.path.abspath(triptych), [os.path.abspath(p) for p in paths]
    os.makedirs(folder, exist_ok=True)
    os.chdir(folder)
    for path in paths:
        cloud = discs.shape(discs.read_ply(path))
        camera, view = view_of(triptych, path)
        truth, name = discs.draw(cloud, view), os.path.splitext(os.path.basename(path))[0]
        pictures = {order: draw_by_triptych(triptych, path, camera, order) for order in ("deferred", "depth")}
        pictures["f3d"] = draw_by_f3d(path, camera)
        write_png("discs.png", truth)
        names = ["discs.png"]
        for program, picture in pictures.items():
            if picture is None:
                continue
            d = discs.compare(picture, truth)
            print(f"{name:16} {program:9} colour {d['colour']:.2f}  differing {100 * d['differing']:.1f} %  "
                  f"silhouettes {d['silhouette99']:.1f}, at most {d['silhouette']:.1f} px", flush=True)
            write_png(f"{program}.png", picture)
            names.append(f"{program}.png")
        call("convert", *names, "+append", f"{name}.png")
        beside_cloudcompare(triptych, path, name)


if __name__ == "__main__":
    main(*sys.argv[1:])
