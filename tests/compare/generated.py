"""Makes volumes by formula and writes them to the work folder if they are missing."""
import os

import numpy as np

EDGE = 256
MARSCHNER_LOBB = "marschner-lobb_%dx%dx%d_uint8.nhdr" % (EDGE, EDGE, EDGE)


def marschner_lobb(edge):
    """Returns the test signal of Marschner & Lobb (1994, section 5) with f_M = 6 and alpha = 0.25,
    over [-1, 1]^3; uint8, [k, j, i]. At 40^3 most of its frequencies are just below the limit of
    the grid, at 256^3 far below."""
    at = np.linspace(-1, 1, edge)
    radius = np.hypot(at[:, None], at[None, :])
    ring = 0.25 * (1 + np.cos(2 * np.pi * 6 * np.cos(np.pi * radius / 2)))
    values = (1 - np.sin(np.pi * at / 2)[:, None, None] + ring[None]) / (2 * 1.25)
    return np.rint(255 * values).astype(np.uint8)


def make(name, folder):
    """Returns the path of the volume `name` in the folder, or None if `name` is not a generated
    volume."""
    if name != MARSCHNER_LOBB:
        return None
    path = os.path.join(folder, name)
    if not os.path.exists(path):
        raw = name.replace(".nhdr", ".raw")
        marschner_lobb(EDGE).tofile(os.path.join(folder, raw))
        with open(path, "w", encoding="ascii") as file:
            file.write("NRRD0004\ntype: uint8\ndimension: 3\nsizes: %d %d %d\nencoding: raw\n"
                       "data file: %s\n\n" % (EDGE, EDGE, EDGE, raw))
    return path
