#!/usr/bin/env python3
"""A second, plain reader of NAME.trip, written from stream/FORMAT.md alone.

Checks every checksum and prints one line for each record of each list, in the order of the lists:

    LIST i j k code [normal gx gy gz] [deviation]

LIST        the axis ("x") for voxels of level 0, else axis, level and kind ("z0.halo", "y1.means")
code        the 16-bit code; a code of means includes depth and cover
normal      the record of the normal, in hexadecimal
gx gy gz    the gradient in world space; if the record stores the direction only, its length is
            gradient_full
deviation   the standard deviation of the voxels of level 0 below a coarse value, in codes

The reader loads whole files. It serves tests and explains the format; it is not for large data.
"""
import struct
import sys

try:
    import numpy
    import xxhash
except ImportError as missing:
    print(f"plain_reader: {missing} (packages python3-numpy, python3-xxhash)", file=sys.stderr)
    sys.exit(77)

KINDS = (
    ("voxels", "normals"),
    ("halo",),
    ("means", "mean-normals"),
    ("values", None, "deviations"),
)
PACKED = (2, 3)  # kinds with packed codes for every value of code_bytes
VALUES = 3


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


def unpack(layout, data, at):
    """Returns the named fields of a layout, and the offset of their end."""
    fields = {}
    for item in layout.split():
        code, _, name = item.partition(":")
        values = struct.unpack_from("<" + code, data, at)
        at += struct.calcsize("<" + code)
        if name:
            fields[name] = values[0] if len(values) == 1 else values
    return fields, at


def read_header(index):
    if index[:8] != b"TRIPTYCH":
        fail("index.trip", 0, "magic")
    header, at = unpack(
        "8x I:version I:header_bytes Q:header_checksum Q:index_bytes Q:checksums_offset "
        "Q:checksums_checksum 3Q:dims 12d:index_to_world d:code_lo d:code_hi d:value_min "
        "d:value_max Q:reserved_scale 3d:gradient_step d:gradient_full Q:voxels Q:kept Q:halo "
        "I:tile_log2 I:slab_sheets I:page_log2 I:planes I:code_bytes I:normal_bytes I:list_count "
        "I:reserved Q:lists_offset Q:text_offset Q:text_bytes Q:coordinates_offset "
        "Q:code_table_offset I:code_table_entries I:code_table_step_log2 d:typical_min d:typical_max",
        index,
        0,
    )
    if at != 360 or header["version"] not in (6, 7) or header["header_bytes"] != 1024:
        fail("index.trip", 8, "version or header size")
    if header["reserved"] or header["reserved_scale"] or any(index[360:1024]):
        fail("index.trip", 360, "reserved bytes")
    if header["index_bytes"] != len(index):
        fail("index.trip", 24, "length of the file")
    if xxh64(index[:16] + bytes(8) + index[24:1024]) != header["header_checksum"]:
        fail("index.trip", 16, "header checksum")
    if header["planes"] >> (header["version"] - 4):  # version 7 adds bit 2
        fail("index.trip", 276, "planes")
    return header


def check_index(index, header):
    table = header["checksums_offset"]
    if xxh64(index[table:]) != header["checksums_checksum"]:
        fail("index.trip", table, "checksum of the page checksums")
    checksums = numpy.frombuffer(index, "<u8", offset=table)
    check_pages("index.trip", index[1024:table], 1 << header["page_log2"], checksums, 1024)


def check_coordinates(index, header):
    at = header["coordinates_offset"]
    for voxels in header["dims"] if at else ():
        places = struct.unpack_from(f"<{voxels}d", index, at)
        steps = [b - a for a, b in zip(places, places[1:])]
        if places[0] != 0 or places[-1] != voxels - 1 or not all(1e-6 <= s for s in steps):
            fail("index.trip", at, "coordinates")
        at += 8 * voxels


def read_list(index, header, number):
    at = header["lists_offset"] + 320 * number
    a_list, end = unpack(
        "I:axis I:level I:kind I:planes 3Q:dims 12d:index_to_world d:sheet_first d:sheet_step "
        "Q:records Q:slab_count Q:slabs_offset Q:brick_count Q:bricks_offset Q:runs_offset "
        "4Q:plane_bytes 4Q:page_checksums",
        index,
        at,
    )
    if a_list["axis"] > 2 or a_list["kind"] >= len(KINDS) or any(index[end : at + 320]):
        fail("index.trip", at, "list descriptor")
    a_list["files"] = [
        plane and f"{'xyz'[a_list['axis']]}{a_list['level']}.{plane}" for plane in KINDS[a_list["kind"]]
    ]
    plain = a_list["level"] == 0 and a_list["kind"] == 0
    a_list["name"] = "xyz"[a_list["axis"]] if plain else a_list["files"][0]
    return a_list


def morton(u, v):
    code = 0
    for bit in range(32):
        code |= (u >> bit & 1) << 2 * bit | (v >> bit & 1) << 2 * bit + 1
    return code


def place(code):
    """Returns (u, v) of a Morton code."""
    u = sum((code >> 2 * bit & 1) << bit for bit in range(8))
    return u, sum((code >> 2 * bit + 1 & 1) << bit for bit in range(8))


def runs(index, header, a_list):
    """Yields (sheet, tile_u, tile_v, first record, count, first byte, bytes) in file order."""
    sheets = header["slab_sheets"]
    record = block = bricks_before = 0
    for s in range(a_list["slab_count"]):
        at = a_list["slabs_offset"] + 32 * s
        first_brick, first_record, first_block, brick_count, slab = struct.unpack_from(
            "<3Q2I", index, at
        )
        if (first_brick, first_record, first_block) != (bricks_before, record, block):
            fail("index.trip", at, "slab does not follow the one before")
        bricks = []
        for b in range(first_brick, first_brick + brick_count):
            brick_at = a_list["bricks_offset"] + 24 * b
            brick = struct.unpack_from("<3I2H8B", index, brick_at)
            runs_at = a_list["runs_offset"] + 4 * sheets * b
            numbers = struct.unpack_from(f"<{2 * sheets}H", index, runs_at)
            if sum(numbers[::2]) != brick[2] or brick[12]:
                fail("index.trip", brick_at, "brick")
            bricks.append((brick[0], brick[1], numbers[::2], numbers[1::2]))
        codes = [morton(u, v) for u, v, _, _ in bricks]
        if codes != sorted(set(codes)):
            fail("index.trip", at, "bricks are not in Morton order")
        for sheet in range(sheets):
            for u, v, counts, words in bricks:
                if counts[sheet]:
                    yield slab * sheets + sheet, u, v, record, counts[sheet], block, 8 * words[sheet]
                record += counts[sheet]
                block += 8 * words[sheet]
        bricks_before += brick_count
    if record != a_list["records"] or block != a_list["plane_bytes"][0]:
        fail("index.trip", a_list["slabs_offset"], "number of records or bytes")


def read_plane(folder, index, header, a_list, plane):
    name = a_list["files"][plane]
    with open(f"{folder}/{name}", "rb") as file:
        data = file.read()
    page = 1 << header["page_log2"]
    count = -(-len(data) // page)
    if len(data) != a_list["plane_bytes"][plane]:
        fail(name, len(data), "length of the file")
    offset = a_list["page_checksums"][plane]
    check_pages(name, data, page, numpy.frombuffer(index, "<u8", count=count, offset=offset))
    return data


def group_forms(masks, data):
    """Returns the form of each square's group, and the number of bytes of all forms."""
    group_of, count, records = [], 0, 32
    for mask in masks:
        if records >= 32:
            count, records = count + 1, 0
        records += bin(mask).count("1")
        group_of.append(count - 1)
    forms = struct.unpack_from(f"<{count}I", data)
    return [forms[group] for group in group_of], -(-count // 2) * 8


def packed_codes(name, at, masks, data):
    """Returns the 16-bit codes, and the offset of their end."""
    forms, start = group_forms(masks, data)
    codes = []
    for mask, form in zip(masks, forms):
        count, width = bin(mask).count("1"), form >> 16
        if width > 16 or width % 2:
            fail(name, at, "width")
        end = start + -(-count * width // 8)
        bits = int.from_bytes(data[start:end], "little")
        codes += [(form & 65535) + (bits >> width * n & (1 << width) - 1) for n in range(count)]
        start = end
    return codes, start


def decode_block(header, kind, name, at, block, count):
    """Returns (u, v, code) of each record of a block."""
    words = 4 if header["tile_log2"] == 7 else 1
    present = int.from_bytes(block[: 8 * words], "little")
    squares = [n for n in range(64 * words) if present >> n & 1]
    if present >> (1 << 2 * (header["tile_log2"] - 3)):
        fail(name, at, "squares outside the tile")
    masks = struct.unpack_from(f"<{len(squares)}Q", block, 8 * words)
    places = []
    for square, mask in zip(squares, masks):
        if mask == 0:
            fail(name, at, "empty mask")
        places += [place(64 * square + bit) for bit in range(64) if mask >> bit & 1]
    data = block[8 * (words + len(squares)) :]
    if header["code_bytes"] == 1 and kind not in PACKED:
        codes, end = [85 * (258 + code) for code in data[:count]], count
    else:
        step = 85 if header["code_bytes"] == 1 and kind == VALUES else 1
        codes, end = packed_codes(name, at, masks, data)
        codes = [step * code for code in codes]
    if len(places) != count or len(data) != (end + 7) // 8 * 8 or any(data[end:]):
        fail(name, at, "block")
    return [(u, v, code) for (u, v), code in zip(places, codes)]


def wide_gradients(normals, full):
    """Returns rows (gx, gy, gz) of 4-byte normals."""
    signed = lambda n: numpy.where(n > 511, n - 1024, n)
    parts = [signed(normals >> 10 * n & 1023) + (normals >> 30 & 1) / 2 for n in range(3)]
    small = numpy.stack(parts, 1) * (full / 511)
    x = (normals & 4095) * 2.0 / 4095 - 1
    y = (normals >> 12 & 4095) * 2.0 / 4095 - 1
    z = 1 - abs(x) - abs(y)
    fold_x = (1 - abs(y)) * numpy.where(x < 0, -1, 1)
    fold_y = (1 - abs(x)) * numpy.where(y < 0, -1, 1)
    direction = numpy.stack([numpy.where(z < 0, fold_x, x), numpy.where(z < 0, fold_y, y), z], 1)
    length = (1 + (normals >> 24 & 127) / 32) ** 2 * full
    large = direction * (length / numpy.linalg.norm(direction, axis=1))[:, None]
    return numpy.where((normals >> 31)[:, None] == 1, large, small)


def narrow_gradients(normals, header):
    """Returns rows (gx, gy, gz) of 3-byte normals."""
    signed = lambda n: numpy.where(n > 127, n - 256, n)
    step = numpy.array(header["gradient_step"])
    index = numpy.stack(
        [signed(normals & 255), signed(normals >> 8 & 255), normals >> 16 & 127], 1
    ) * step
    linear = numpy.array(header["index_to_world"]).reshape(3, 4)[:, :3]
    small = index @ numpy.linalg.inv(linear)
    p = (normals & 4095) * 2.0 / 4095 - 1
    q = (normals >> 12 & 2047) * 2.0 / 2047 - 1
    up = 1 - numpy.maximum(abs(p), abs(q))
    direction = numpy.stack([(p + q) / 2, (p - q) / 2, up], 1)
    large = direction * (header["gradient_full"] / numpy.linalg.norm(direction, axis=1))[:, None]
    return numpy.where((normals >> 23 & 1)[:, None] == 1, large, small)


def read_normals(folder, index, header, a_list):
    """Returns records and gradients, or None twice if the list has no normals."""
    if not a_list["planes"] & 2:
        return None, None
    size = header["normal_bytes"]
    data = numpy.frombuffer(read_plane(folder, index, header, a_list, 1), "u1")
    if len(data) != size * a_list["records"]:
        fail(a_list["files"][1], len(data), "length of the file")
    parts = data.reshape(-1, size).astype("i8")
    normals = sum(parts[:, n] << 8 * n for n in range(size))
    if size == 4:
        return normals, wide_gradients(normals, header["gradient_full"])
    return normals, narrow_gradients(normals, header)


def read_deviations(folder, index, header, a_list):
    """Returns the deviations in codes, or None if the list has none."""
    if a_list["planes"] >> 2 == 0:
        return None
    data = numpy.frombuffer(read_plane(folder, index, header, a_list, 2), "u1")
    if len(data) != a_list["records"]:
        fail(a_list["files"][2], len(data), "length of the file")
    return 32767.5 * (data / 255) ** 2


def print_list(folder, index, header, number, out):
    a_list = read_list(index, header, number)
    voxels = read_plane(folder, index, header, a_list, 0)
    normals, gradient = read_normals(folder, index, header, a_list)
    deviations = read_deviations(folder, index, header, a_list)
    tile, axis = 1 << header["tile_log2"], a_list["axis"]
    for sheet, tile_u, tile_v, first, count, at, size in runs(index, header, a_list):
        block = decode_block(header, a_list["kind"], a_list["files"][0], at, voxels[at : at + size], count)
        for n, (u, v, code) in enumerate(block, first):
            where = [0, 0, 0]
            where[axis] = sheet
            where[(axis + 1) % 3] = tile_u * tile + u
            where[(axis + 2) % 3] = tile_v * tile + v
            line = "%s %d %d %d %d" % (a_list["name"], *where, code)
            if normals is not None:
                line += " %08x %.9g %.9g %.9g" % (normals[n], *gradient[n])
            if deviations is not None:
                line += " %.6g" % deviations[n]
            out.write(line + "\n")


def main():
    if len(sys.argv) != 2:
        sys.exit("usage: plain_reader.py NAME.trip")
    folder = sys.argv[1]
    with open(f"{folder}/index.trip", "rb") as file:
        index = file.read()
    header = read_header(index)
    check_index(index, header)
    check_coordinates(index, header)
    for number in range(header["list_count"]):
        print_list(folder, index, header, number, sys.stdout)


main()
