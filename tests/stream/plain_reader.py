#!/usr/bin/env python3
"""A second, plain reader of NAME.trip, written from stream/FORMAT.md alone.

Checks every checksum and prints one line for every voxel of every list, in list order:

    LIST i j k code [normal gx gy gz]

with the normal's record in hexadecimal and its gradient. Everything is read at once: it is for
tests and for understanding the format, not for large data.
"""
import struct
import sys

try:
    import numpy
    import xxhash
except ImportError as missing:
    print(f"plain_reader: {missing} (packages python3-numpy, python3-xxhash)", file=sys.stderr)
    sys.exit(77)

PLANES = ("voxels", "normals")


def fail(name, place, why):
    sys.exit(f"plain_reader: {name}: byte {place}: {why}")


def xxh64(data):
    return xxhash.xxh64(data, seed=0).intdigest()


def check_pages(name, data, page_bytes, checksums, start=0):
    pages = range(0, len(data), page_bytes)
    if len(pages) != len(checksums):
        fail(name, 0, "wrong number of page checksums")
    for at, checksum in zip(pages, checksums):
        if xxh64(data[at : at + page_bytes]) != checksum:
            fail(name, start + at, "page checksum")


def read_header(index):
    if index[:8] != b"TRIPTYCH":
        fail("index.trip", 0, "magic")
    header = {}
    layout = (
        "8x I:version I:header_bytes Q:header_checksum Q:index_bytes Q:checksums_offset "
        "Q:checksums_checksum 3Q:dims 12d:index_to_world d:code_lo d:code_hi d:value_min "
        "d:value_max d:gradient_scale Q:voxels Q:kept I:tile_log2 I:slab_sheets I:page_log2 "
        "I:planes I:list_count I:reserved Q:lists_offset Q:text_offset Q:text_bytes"
    )
    at = 0
    for item in layout.split():
        code, _, name = item.partition(":")
        values = struct.unpack_from("<" + code, index, at)
        at += struct.calcsize("<" + code)
        if name:
            header[name] = values[0] if len(values) == 1 else values
    if at != 272 or header["version"] != 1 or header["header_bytes"] != 1024:
        fail("index.trip", 8, "version or header size")
    if header["reserved"] or any(index[272:1024]):
        fail("index.trip", 272, "reserved bytes")
    if header["index_bytes"] != len(index):
        fail("index.trip", 24, "length of the file")
    if xxh64(index[:16] + bytes(8) + index[24:1024]) != header["header_checksum"]:
        fail("index.trip", 16, "header checksum")
    return header


def check_index(index, header):
    table = header["checksums_offset"]
    if xxh64(index[table:]) != header["checksums_checksum"]:
        fail("index.trip", table, "checksum of the page checksums")
    checksums = numpy.frombuffer(index, "<u8", offset=table)
    check_pages("index.trip", index[1024:table], 1 << header["page_log2"], checksums, 1024)


def read_list(index, header, number):
    at = header["lists_offset"] + 128 * number
    names = "splats slab_count slabs_offset brick_count bricks_offset counts_offset".split()
    axis, level = struct.unpack_from("<2I", index, at)
    out = dict(zip(names, struct.unpack_from("<6Q", index, at + 8)))
    out["page_checksums"] = struct.unpack_from("<4Q", index, at + 56)
    if axis != number or level != 0 or any(index[at + 88 : at + 128]):
        fail("index.trip", at, "list descriptor")
    return out


def morton(u, v):
    code = 0
    for bit in range(32):
        code |= (u >> bit & 1) << 2 * bit | (v >> bit & 1) << 2 * bit + 1
    return code


def runs(index, header, a_list):
    """Yields (sheet, tile_u, tile_v, first splat, count) in file order."""
    sheets = header["slab_sheets"]
    splat = 0
    bricks_before = 0
    for s in range(a_list["slab_count"]):
        at = a_list["slabs_offset"] + 24 * s
        first_brick, first_splat, brick_count, slab = struct.unpack_from("<2Q2I", index, at)
        if (first_brick, first_splat) != (bricks_before, splat):
            fail("index.trip", at, "slab does not follow the one before")
        bricks = []
        for b in range(first_brick, first_brick + brick_count):
            brick_at = a_list["bricks_offset"] + 24 * b
            brick = struct.unpack_from("<3I2H6BH", index, brick_at)
            counts_at = a_list["counts_offset"] + 2 * sheets * b
            counts = struct.unpack_from(f"<{sheets}H", index, counts_at)
            if sum(counts) != brick[2] or brick[11]:
                fail("index.trip", brick_at, "brick")
            bricks.append((brick[0], brick[1], counts))
        codes = [morton(u, v) for u, v, _ in bricks]
        if codes != sorted(set(codes)):
            fail("index.trip", at, "bricks are not in Morton order")
        for sheet in range(sheets):
            for u, v, counts in bricks:
                if counts[sheet]:
                    yield slab * sheets + sheet, u, v, splat, counts[sheet]
                splat += counts[sheet]
        bricks_before += brick_count
    if splat != a_list["splats"] or splat != header["kept"]:
        fail("index.trip", 216, "number of splats")


def read_plane(folder, index, header, a_list, number, plane):
    name = "xyz"[number] + "." + PLANES[plane]
    with open(f"{folder}/{name}", "rb") as file:
        data = file.read()
    page = 1 << header["page_log2"]
    count = -(-len(data) // page)
    if len(data) != 4 * a_list["splats"]:
        fail(name, len(data), "length of the file")
    offset = a_list["page_checksums"][plane]
    check_pages(name, data, page, numpy.frombuffer(index, "<u8", count=count, offset=offset))
    return numpy.frombuffer(data, "<u4")


def gradients(normals, scale):
    """Rows (gx, gy, gz) of normal records."""
    x = (normals & 4095) * 2.0 / 4095 - 1
    y = (normals >> 12 & 4095) * 2.0 / 4095 - 1
    z = 1 - abs(x) - abs(y)
    fold_x = (1 - abs(y)) * numpy.where(x < 0, -1, 1)
    fold_y = (1 - abs(x)) * numpy.where(y < 0, -1, 1)
    direction = numpy.stack([numpy.where(z < 0, fold_x, x), numpy.where(z < 0, fold_y, y), z], 1)
    length = ((normals >> 24) / 255.0) ** 2 * scale
    return direction * (length / numpy.linalg.norm(direction, axis=1))[:, None]


def print_list(folder, index, header, number, out):
    a_list = read_list(index, header, number)
    voxels = read_plane(folder, index, header, a_list, number, 0)
    normals = None
    if header["planes"] & 2:
        normals = read_plane(folder, index, header, a_list, number, 1)
        gradient = gradients(normals.astype("i8"), header["gradient_scale"])
    tile = 1 << header["tile_log2"]
    for sheet, tile_u, tile_v, first, count in runs(index, header, a_list):
        for n in range(first, first + count):
            voxel = int(voxels[n])
            place = [0, 0, 0]
            place[number] = sheet
            place[(number + 1) % 3] = tile_u * tile + (voxel & 255)
            place[(number + 2) % 3] = tile_v * tile + (voxel >> 8 & 255)
            line = "%s %d %d %d %d" % ("xyz"[number], *place, voxel >> 16)
            if normals is not None:
                line += " %08x %.9g %.9g %.9g" % (normals[n], *gradient[n])
            out.write(line + "\n")


def main():
    if len(sys.argv) != 2:
        sys.exit("usage: plain_reader.py NAME.trip")
    folder = sys.argv[1]
    with open(f"{folder}/index.trip", "rb") as file:
        index = file.read()
    header = read_header(index)
    check_index(index, header)
    for number in range(3):
        print_list(folder, index, header, number, sys.stdout)


main()
