"""Makes volumes by formula and writes them to the work folder if they are missing."""
import os
import subprocess

import numpy as np

EDGE = 256
MARSCHNER_LOBB = "marschner-lobb_%dx%dx%d_uint8.nhdr" % (EDGE, EDGE, EDGE)
POROUS = "porous.nrrd"


def marschner_lobb(edge):
    """Returns the test signal of Marschner & Lobb (1994, section 5) with f_M = 6 and alpha = 0.25,
    over [-1, 1]^3; uint8, [k, j, i]. At 40^3 most of its frequencies are just below the limit of
    the grid, at 256^3 far below."""
    at = np.linspace(-1, 1, edge)
    radius = np.hypot(at[:, None], at[None, :])
    ring = 0.25 * (1 + np.cos(2 * np.pi * 6 * np.cos(np.pi * radius / 2)))
    values = (1 - np.sin(np.pi * at / 2)[:, None, None] + ring[None]) / (2 * 1.25)
    return np.rint(255 * values).astype(np.uint8)


def make(name, folder, triptych):
    """Returns the path of the volume `name` in the folder, or None if `name` is not a generated
    volume. triptych-generate lies beside the program `triptych`."""
    if name not in (MARSCHNER_LOBB, POROUS):
        return None
    path = os.path.join(folder, name)
    if os.path.exists(path):
        return path
    if name == POROUS:
        generate = os.path.join(os.path.dirname(triptych), "triptych-generate")
        subprocess.run([generate, "porous", "-o", path], check=True)
        return path
    raw = name.replace(".nhdr", ".raw")
    marschner_lobb(EDGE).tofile(os.path.join(folder, raw))
    with open(path, "w", encoding="ascii") as file:
        file.write("NRRD0004\ntype: uint8\ndimension: 3\nsizes: %d %d %d\nencoding: raw\n"
                   "data file: %s\n\n" % (EDGE, EDGE, EDGE, raw))
    return path
