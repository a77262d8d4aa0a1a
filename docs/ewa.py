#!/usr/bin/python3
"""Draws docs/ewa.png: cases like the ones of Zwicker et al. 2001, by five filters and as they should
be. Prints how far each filter is from the true picture.

docs/ewa.py build/release/triptych docs/ewa.png [integral]

Each row is a case: a receding checkerboard, a zebra with voxels twice as long as wide, one with
voxels four times as long, and a disc of few voxels close up. Each column is a filter. The last
column is the truth: the mean of the splats over each pixel's area, without a filter. The reference
renderer draws it with 8 x 8 rays per pixel. With `integral`, the integral renderer computes it with
4 x 4 rays, which takes minutes. Needs NumPy.
"""
import os
import struct
import subprocess
import sys
import tempfile
import zlib

import numpy

WIDTH, HEIGHT, ENLARGED, GAP, RIM = 150, 110, 2, 6, 3
DARK, LIGHT, BACKGROUND = (0.05, 0.05, 0.1), (1, 1, 0.95), (0.35, 0.45, 0.6)
OPACITY = 0.002  # per voxel: splats add up, and hide nothing
FILTERS = {
    "plain splats": ["--low-pass", "none"],
    "plain, 2 x 2 rays": ["--low-pass", "none", "--samples", "2"],
    "uniform, 1 pixel": ["--low-pass", "uniform", "--low-pass-width", "1"],
    "EWA, 1 pixel": ["--low-pass-width", "1"],
    "EWA, 0.4 pixels": [],
}
REFERENCE = ["--renderer", "reference", "--method", "axis"]
TRUTH = REFERENCE + ["--kernel", "exact", "--low-pass", "none", "--samples", "8"]
INTEGRAL = ["--renderer", "integral", "--field", "splats", "--samples", "4", "--tolerance", "1e-6"]


def checkers(u, v):
    return (numpy.floor(u * 128) + numpy.floor(v * 128)) % 2 == 1


def zebra(u, v):
    return numpy.floor(u * 64 + 8 * (2 * v - 1) ** 2) % 2 == 0


def disc(u, v):
    return (u - 0.5) ** 2 + (v - 0.5) ** 2 < 0.1


# Name, pattern, voxels along x and y, length of a voxel along x, eye, target point, field of view in
# degrees.
CASES = [
    ("checkerboard", checkers, 512, 512, 1, (256, -40, 36), (256, 160, 0), 50),
    ("zebra, 2 : 1", zebra, 256, 512, 2, (256, -40, 36), (256, 160, 0), 50),
    ("zebra, 4 : 1", zebra, 128, 512, 4, (256, -40, 36), (256, 160, 0), 50),
    ("disc, 4 : 1", disc, 6, 24, 4, (12, -4, 16), (12, 9, 0), 60),
]


def write_volume(folder, pattern, nx, ny):
    u, v = (numpy.arange(nx) + 0.5) / nx, (numpy.arange(ny) + 0.5) / ny
    path = os.path.join(folder, "plane.raw")
    numpy.where(pattern(u[None, :], v[:, None]), 255, 1).astype("u1").tofile(path)
    return path


def read_png(path):
    """Returns height x width x RGB from 0 to 1. Reads 8-bit PNG files without interlace."""
    with open(path, "rb") as file:
        data = file.read()
    at, packed, width, height, kind = 8, b"", 0, 0, 0
    while at < len(data):
        (length,) = struct.unpack(">I", data[at : at + 4])
        name, body = data[at + 4 : at + 8], data[at + 8 : at + 8 + length]
        if name == b"IHDR":
            width, height, depth, kind = struct.unpack(">IIBB", body[:10])
            assert depth == 8 and kind in (2, 6)
        if name == b"IDAT":
            packed += body
        at += 12 + length
    step = 3 if kind == 2 else 4
    raw, rows, before, at = zlib.decompress(packed), b"", bytes(width * step), 0
    for _ in range(height):
        row = bytearray(raw[at + 1 : at + 1 + width * step])
        for i in range(width * step):
            left = row[i - step] if i >= step else 0
            above, corner = before[i], before[i - step] if i >= step else 0
            guess = left + above - corner
            nearest = min((left, above, corner), key=lambda value: abs(guess - value))
            row[i] = (row[i] + [0, left, above, (left + above) // 2, nearest][raw[at]]) & 255
        rows, before, at = rows + row, row, at + 1 + width * step
    return numpy.frombuffer(rows, "u1").reshape(height, width, step)[..., :3] / 255


def write_png(path, picture):
    """Writes height x width x RGB from 0 to 1."""

    def chunk(name, body):
        return struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))

    rows = numpy.rint(picture * 255).astype("u1")
    header = struct.pack(">IIBBBBB", rows.shape[1], rows.shape[0], 8, 2, 0, 0, 0)
    body = zlib.compress(b"".join(b"\0" + row.tobytes() for row in rows), 9)
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header))
        file.write(chunk(b"IDAT", body) + chunk(b"IEND", b""))


def draw(triptych, folder, case, truth):
    """Returns the pictures of a case, one for each filter, then the truth."""
    _, pattern, nx, ny, length, eye, look, fov = case
    volume, data = write_volume(folder, pattern, nx, ny), os.path.join(folder, "plane.trip")
    function, picture = os.path.join(folder, "plane.tf"), os.path.join(folder, "plane.png")
    with open(function, "w", encoding="ascii") as file:
        file.write("values data\nunit voxel\n")
        for value, colour in (1, DARK), (255, LIGHT):
            print(value, *colour, OPACITY, file=file)
    subprocess.run(
        [triptych, "brick", volume, "--size", f"{nx},{ny},1", "--type", "uint8", "--keep-all"]
        + ["--spacing", f"{length},1,1", "--tf", function, "-o", data, "-q", "--levels", "0"]
        + (["--force"] if os.path.exists(data) else []),
        check=True,
    )
    pictures = []
    for options in [REFERENCE + ["--kernel", "ewa"] + own for own in FILTERS.values()] + [truth]:
        subprocess.run(
            [triptych, "render", data, "-o", picture, "--no-shading", "--normalise"]
            + ["--size", f"{WIDTH}x{HEIGHT}", "--eye", ",".join(map(str, eye)), "--up", "0,0,1"]
            + ["--look", ",".join(map(str, look)), "--background", ",".join(map(str, BACKGROUND))]
            + ["--fov", str(fov)] + options,
            check=True, stdout=subprocess.DEVNULL,
        )
        pictures.append(read_png(picture))
    return pictures


def inside_of(picture):
    """Returns the pixels that lie at least RIM pixels inside the plane."""
    covered = abs(picture - BACKGROUND).max(axis=2) > 0.02
    inside = numpy.zeros_like(covered)
    window = numpy.lib.stride_tricks.sliding_window_view(covered, (2 * RIM + 1, 2 * RIM + 1))
    inside[RIM:-RIM, RIM:-RIM] = window.all(axis=(2, 3))
    return inside


def print_errors(name, pictures):
    """Prints the mean differences from the last picture, in the far third of the plane's rows of
    pixels and in the other rows."""
    *filtered, truth = pictures
    inside = inside_of(truth)
    rows = numpy.flatnonzero(inside.any(axis=1))
    border = rows[0] + len(rows) // 3
    cells = []
    for picture in filtered:
        error = 255 * abs(picture - truth).mean(axis=2)
        parts = [error[part][inside[part]].mean() for part in (slice(border), slice(border, None))]
        cells.append(" / ".join(f"{part:.1f}" for part in parts))
    print(f"| {name} |", " | ".join(cells), "|", flush=True)


def main():
    triptych, output, *integral = sys.argv[1:]
    rows = []
    print("| case |", " | ".join(FILTERS), "|")
    print("|---|" + "---:|" * len(FILTERS))
    with tempfile.TemporaryDirectory() as folder:
        for case in CASES:
            pictures = draw(triptych, folder, case, INTEGRAL if integral else TRUTH)
            print_errors(case[0], pictures)
            large = [p.repeat(ENLARGED, 0).repeat(ENLARGED, 1) for p in pictures]
            gap = numpy.ones((HEIGHT * ENLARGED, GAP, 3))
            rows.append(numpy.hstack(sum(([p, gap] for p in large), [])[:-1]))
    gap = numpy.ones((GAP, rows[0].shape[1], 3))
    write_png(output, numpy.vstack(sum(([row, gap] for row in rows), [])[:-1]))


if __name__ == "__main__":
    main()
