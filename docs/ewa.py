#!/usr/bin/env python3
"""Draws docs/ewa.png: the cases of Zwicker et al. 2001 with plain splats, Swan's uniform scaling
and EWA.

docs/ewa.py build/release/triptych docs/ewa.png

Each row is a case: a receding checkerboard, a zebra with voxels twice as long as wide, one with
voxels four times as long, and a disc of few voxels close up. Each column is a filter. The reference
renderer draws all pictures.
"""
import os
import struct
import subprocess
import sys
import tempfile
import zlib

WIDTH, HEIGHT, ENLARGED, GAP = 150, 110, 2, 6
FILTERS = ["none", "uniform", "ewa"]


def checkers(u, v):
    return int(u * 64) % 2 != int(v * 64) % 2


def zebra(u, v):
    return int(u * 64 + 8 * (2 * v - 1) ** 2) % 2 == 0


def disc(u, v):
    return (u - 0.5) ** 2 + (v - 0.5) ** 2 < 0.1


# Pattern, voxels along x and y, length of a voxel along x, eye, target point, field of view in
# degrees.
CASES = [
    (checkers, 512, 512, 1, (256, -40, 36), (256, 160, 0), 50),
    (zebra, 256, 512, 2, (256, -40, 36), (256, 160, 0), 50),
    (zebra, 128, 512, 4, (256, -40, 36), (256, 160, 0), 50),
    (disc, 6, 24, 4, (12, -4, 16), (12, 9, 0), 60),
]


def write_volume(folder, pattern, nx, ny):
    path = os.path.join(folder, "plane.raw")
    with open(path, "wb") as file:
        for j in range(ny):
            file.write(
                bytes(255 if pattern((i + 0.5) / nx, (j + 0.5) / ny) else 1 for i in range(nx))
            )
    return path


def read_png(path):
    """Returns rows of RGB bytes, each pixel repeated ENLARGED times. Reads 8-bit PNG files without
    interlace."""
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
    raw, rows, before, at = zlib.decompress(packed), [], bytes(width * step), 0
    for _ in range(height):
        row = bytearray(raw[at + 1 : at + 1 + width * step])
        for i in range(width * step):
            left = row[i - step] if i >= step else 0
            above, corner = before[i], before[i - step] if i >= step else 0
            guess = left + above - corner
            nearest = min((left, above, corner), key=lambda value: abs(guess - value))
            row[i] = (row[i] + [0, left, above, (left + above) // 2, nearest][raw[at]]) & 255
        rows.append(b"".join(ENLARGED * bytes(row[i : i + 3]) for i in range(0, width * step, step)))
        before, at = row, at + 1 + width * step
    return rows


def write_png(path, rows):
    def chunk(name, body):
        return struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))

    header = struct.pack(">IIBBBBB", len(rows[0]) // 3, len(rows), 8, 2, 0, 0, 0)
    body = zlib.compress(b"".join(b"\0" + row for row in rows), 9)
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header))
        file.write(chunk(b"IDAT", body) + chunk(b"IEND", b""))


def draw(triptych, folder, case):
    """Returns the pictures of a case, one for each filter."""
    pattern, nx, ny, length, eye, look, fov = case
    volume, data = write_volume(folder, pattern, nx, ny), os.path.join(folder, "plane.trip")
    function, picture = os.path.join(folder, "plane.tf"), os.path.join(folder, "plane.png")
    with open(function, "w", encoding="ascii") as file:
        file.write("values data\nunit voxel\n1 0.05 0.05 0.1 0.9999\n255 1 1 0.95 0.9999\n")
    subprocess.run(
        [triptych, "brick", volume, "--size", f"{nx},{ny},1", "--type", "uint8", "--keep-all"]
        + ["--spacing", f"{length},1,1", "--tf", function, "-o", data, "-q", "--levels", "0"]
        + (["--force"] if os.path.exists(data) else []),
        check=True,
    )
    pictures = []
    for low_pass in FILTERS:
        subprocess.run(
            [triptych, "render", data, "-o", picture, "--renderer", "reference", "--no-shading"]
            + ["--kernel", "ewa", "--low-pass", low_pass, "--compositing", "sheet"]
            + ["--method", "axis", "--size", f"{WIDTH}x{HEIGHT}", "--fov", str(fov)]
            + ["--eye", ",".join(map(str, eye)), "--up", "0,0,1"]
            + ["--look", ",".join(map(str, look)), "--background", "0.35,0.45,0.6"],
            check=True,
        )
        pictures.append([row for row in read_png(picture) for _ in range(ENLARGED)])
    return pictures


def main():
    triptych, output = sys.argv[1:]
    rows, gap = [], b"\xff" * (3 * GAP)
    with tempfile.TemporaryDirectory() as folder:
        for case in CASES:
            pictures = draw(triptych, folder, case)
            if rows:
                rows += [b"\xff" * len(rows[0])] * GAP
            rows += [gap.join(columns) for columns in zip(*pictures)]
    write_png(output, rows)


if __name__ == "__main__":
    main()
