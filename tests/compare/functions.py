"""Reads transfer functions in Triptych's `.tf` text (common/TRANSFER_FUNCTIONS.md) for the other
programs."""
import numpy as np

OPACITY_MAX = 0.9999


def read(path):
    """Returns points (value, r, g, b, opacity) in data units, with opacity per voxel."""
    points = []
    with open(path, encoding="utf-8") as file:
        for line in file:
            words = line.split("#")[0].split()
            if not words or words in (["unit", "voxel"], ["values", "data"]):
                continue
            if len(words) != 5:
                raise ValueError("%s: expected 5 numbers per line, opacity per voxel and values of "
                                 "the data" % path)
            points.append(tuple(float(word) for word in words))
    return points


def extinction(points, values):
    """Returns -ln(1 - opacity) per voxel at each value, as float32."""
    at = [p[0] for p in points]
    tau = np.empty(values.shape, np.float32)
    # One slice at a time saves memory: the largest volume has 10^9 voxels.
    for k in range(values.shape[0]):
        opacity = np.minimum(np.interp(values[k], at, [p[4] for p in points]), OPACITY_MAX)
        tau[k] = -np.log1p(-opacity)
    return tau
