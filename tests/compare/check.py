"""Checks that all programs show the same view: each draws an object without symmetry, which must
cover the same pixels."""
import os
import tempfile
from collections import namedtuple

import numpy as np

import contenders
import pictures
from contenders import Unavailable
from prepare import Prepared

SIZE_PX = 512
VOXEL = 0.25  # world units
LIMIT_PX = 1.0  # maximum displacement; a mirrored or turned picture exceeds it widely
OUTLINE_LIMIT_VOXELS = 1.5  # a splat reaches further than interpolation

_Scene = namedtuple("Scene", "name function shading shows")


def _object():
    """Returns four balls placed without symmetry; uint8, [k, j, i]. All have one size, so a
    renderer that draws every outline too wide or too narrow does not move the centre of the
    silhouette."""
    k, j, i = np.ogrid[0:180.0, 0:260.0, 0:220.0]
    inside = np.zeros((180, 260, 220))
    for x, y, z in ((50, 60, 50), (170, 90, 60), (120, 200, 120), (60, 150, 135)):
        distance = np.sqrt((i - x) ** 2 + (j - y) ** 2 + (k - z) ** 2)
        inside = np.maximum(inside, np.clip(32.5 - distance, 0, 1))
    return np.rint(inside * 255).astype(np.uint8)


def _write(folder):
    values = _object()
    path = os.path.join(folder, "alignment.nrrd")
    sizes = " ".join(str(n) for n in values.shape[::-1])
    with open(path, "wb") as file:
        file.write(("NRRD0004\ntype: uint8\ndimension: 3\nsizes: %s\nencoding: raw\n"
                    "space: left-posterior-superior\n"
                    "space directions: (%g,0,0) (0,%g,0) (0,0,%g)\n"
                    "space origin: (-11,7,3)\n\n" % (sizes, VOXEL, VOXEL, VOXEL)).encode())
        file.write(values.tobytes())
    return path


def _opacity(one, view, folder):
    path = os.path.join(folder, one.name + ".png")
    one.picture(view, SIZE_PX, path)
    return pictures.load(path, is_opacity=one.name == "vdb_render")[..., 3]


def _displacement(ours, theirs):
    """Returns the displacement of the centre of the silhouette and of its outline, in pixels."""
    shift = pictures.centroid(theirs) - pictures.centroid(ours)
    apart = np.abs(pictures.edges(theirs) - pictures.edges(ours))
    return float(np.abs(shift).max()), float(apart.max())


def _voxel_px(view):
    """Returns the size of a voxel in the centre of the picture, in pixels."""
    distance = np.linalg.norm(np.array(view["eye"]) - np.array(view["look"]))
    return VOXEL * SIZE_PX / (2 * distance * np.tan(np.radians(view["fov_degrees"] / 2)))


def _compare(ours, other, views, folder):
    worst = {"displaced_px": 0.0, "outline_voxels": 0.0}
    for view in views:
        shift, apart = _displacement(_opacity(ours, view, folder), _opacity(other, view, folder))
        worst["displaced_px"] = max(worst["displaced_px"], shift)
        worst["outline_voxels"] = max(worst["outline_voxels"], apart / _voxel_px(view))
    return worst


def cameras_agree(options, log):
    """Returns the largest displacement of each program from Triptych over three views. Raises
    SystemExit if one is too large."""
    worst = {}
    with tempfile.TemporaryDirectory() as folder:
        prepared = Prepared(_Scene("alignment", "alignment", False, "balls"), _write(folder),
                            folder, options.triptych)
        ours = contenders.Triptych(prepared, "cpu", options.threads)
        views = ours.time_views(SIZE_PX, 3)
        for name in options.programs[1:]:
            try:
                other = contenders.make(name, prepared, options.threads)
                worst[name] = _compare(ours, other, views, folder)
                other.close()
            except Unavailable as why:
                log("alignment: %s left out: %s" % (name, why))
                continue
            log("alignment of %s: displaced by %.2f px, outlines %.1f voxels apart" %
                (name, worst[name]["displaced_px"], worst[name]["outline_voxels"]))
            if (worst[name]["displaced_px"] > LIMIT_PX or
                    worst[name]["outline_voxels"] > OUTLINE_LIMIT_VOXELS):
                raise SystemExit("compare: %s does not show the same view as Triptych; "
                                 "--no-alignment skips this check" %
                                 name)
    return worst
