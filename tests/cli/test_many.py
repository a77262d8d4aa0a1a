"""Tests a data set with more than 2^32 splats in each list, and more than 2^32 bytes before the
visible ones. The test writes sparse files by stream/FORMAT.md. All voxels of the solid grid have
value 0, except a cube of 64 voxels a side near the far corner. Pages that no test reads stay
holes."""
import os
import struct

import xxhash

import program

DIMS = (2048, 2048, 1152)
EDGE = 64  # edge of tiles, slabs and the cube
CUBE = (1920, 1920, 1024)
VALUE = 128
OPACITY = 0.01
PAGE = 1 << 16
# Size of a block with all voxels: presence, masks, one byte for each code.
BLOCK_BYTES = 8 + 64 * 8 + EDGE * EDGE
VOXELS = DIMS[0] * DIMS[1] * DIMS[2]


def block(value):
    return b"\xff" * (8 + 64 * 8) + bytes([value]) * (EDGE * EDGE)


def xxh64(data):
    return xxhash.xxh64(data, seed=0).intdigest()


def morton(u, v):
    return sum((u >> bit & 1) << 2 * bit | (v >> bit & 1) << 2 * bit + 1 for bit in range(8))


class Axis:
    """The list along one axis, with its tables and its file. The file holds only the blocks of the
    cube and of the bricks around it."""

    def __init__(self, folder, axis):
        self.axis, self.u, self.v = axis, (axis + 1) % 3, (axis + 2) % 3
        tiles = [(u, v) for u in range(DIMS[self.u] // EDGE) for v in range(DIMS[self.v] // EDGE)]
        self.tiles = sorted(tiles, key=lambda tile: morton(*tile))
        self.slab_count = DIMS[axis] // EDGE
        self.brick_count = self.slab_count * len(tiles)
        self.bytes = self.brick_count * EDGE * BLOCK_BYTES
        self.path = os.path.join(folder, "xyz"[axis] + "0.voxels")
        self.write_blocks()

    def away(self, slab, tile):
        """Returns the distance of a brick from the cube in bricks, as the maximum over the axes."""
        at = {self.axis: slab, self.u: tile[0], self.v: tile[1]}
        return max(abs(at[a] - CUBE[a] // EDGE) for a in range(3))

    def write_blocks(self):
        pages, per_sheet = set(), len(self.tiles)
        with open(self.path, "wb") as f:
            f.truncate(self.bytes)
            for slab in range(self.slab_count):
                for rank, tile in enumerate(self.tiles):
                    away = self.away(slab, tile)
                    for sheet in range(EDGE if away < 2 else 0):
                        at = ((slab * EDGE + sheet) * per_sheet + rank) * BLOCK_BYTES
                        f.seek(at)
                        f.write(block(0 if away else VALUE))
                        pages.update((at // PAGE, (at + BLOCK_BYTES - 1) // PAGE))
        self.checksums = [xxh64(bytes(PAGE))] * -(-self.bytes // PAGE)
        with open(self.path, "rb") as f:
            for page in pages | {len(self.checksums) - 1}:
                f.seek(page * PAGE)
                self.checksums[page] = xxh64(f.read(PAGE))

    def tables(self):
        """Returns the tables of slabs, bricks, runs and page checksums."""
        each, slabs, bricks = len(self.tiles), [], []
        for slab in range(self.slab_count):
            first = slab * each
            slabs.append(struct.pack("<3Q2I", first, first * EDGE ** 3, first * EDGE * BLOCK_BYTES,
                                     each, slab))
            for tile in self.tiles:
                code = 85 * (258 + (0 if self.away(slab, tile) else VALUE))
                bricks.append(struct.pack("<3I2H6BH", *tile, EDGE ** 3, code, code, 0, EDGE - 1, 0,
                                          EDGE - 1, 0, EDGE - 1, 0))
        runs = struct.pack("<2H", EDGE * EDGE, BLOCK_BYTES // 8) * (self.brick_count * EDGE)
        return [b"".join(slabs), b"".join(bricks), runs,
                struct.pack(f"<{len(self.checksums)}Q", *self.checksums)]

    def descriptor(self, offsets):
        slabs, bricks, runs, checksums = offsets
        return struct.pack("<4I3Q12d2d6Q4Q4Q7Q", self.axis, 0, 0, 1, *DIMS, *IDENTITY, 0, 1, VOXELS,
                           self.slab_count, slabs, self.brick_count, bricks, runs, self.bytes,
                           0, 0, 0, checksums, *[0] * 10)


IDENTITY = (1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0)


def write_data_set(folder):
    os.mkdir(folder)
    axes = [Axis(folder, axis) for axis in range(3)]
    at, tables, descriptors = 1024 + 3 * 320, [], []
    for axis in axes:
        offsets = []
        for table in axis.tables():
            offsets.append(at)
            tables.append(table)
            at += len(table)
        descriptors.append(axis.descriptor(offsets))
    body = b"".join(descriptors + tables) + b"{}" + bytes(6)
    pages = [xxh64(body[i : i + PAGE]) for i in range(0, len(body), PAGE)]
    checksums = struct.pack(f"<{len(pages)}Q", *pages)
    end = 1024 + len(body)
    header = bytearray(struct.pack(
        "<8s2I4Q3Q12d4dQ3dd3Q8I4Q", b"TRIPTYCH", 6, 1024, 0, end + len(checksums), end,
        xxh64(checksums), *DIMS, *IDENTITY, -258, 513, 0, 255, 0, 0, 0, 0, 0, VOXELS, VOXELS, 0,
        6, EDGE, 16, 1, 1, 0, 3, 0, 1024, at, 2, 0))
    header += bytes(1024 - len(header))
    struct.pack_into("<2d", header, 344, 0, 255)  # the typical range
    struct.pack_into("<Q", header, 16, xxh64(bytes(header)))
    program.write(os.path.join(folder, "index.trip"), bytes(header) + body + checksums)


class Many(program.ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        write_data_set("many.trip")
        program.write("many.tf", f"0 1 .5 .25 0\n{VALUE} 1 .5 .25 {OPACITY}\n".encode())

    def test_more_than_2_to_the_32_splats_are_counted(self):
        self.assertGreater(VOXELS, 2**32)
        info = self.info("many.trip")
        self.assertEqual([info["kept"]] + [l["records"] for l in info["lists"]], 4 * [VOXELS])
        for file in "x0.voxels", "y0.voxels", "z0.voxels":
            size = os.stat(os.path.join("many.trip", file))
            self.assertGreater(size.st_size, 2**32)
            self.assertLess(512 * size.st_blocks, 2**28)

    def test_splats_beyond_2_to_the_32_are_drawn_along_each_axis(self):
        """Each ray passes 64 voxels along an axis. With `post` it passes 63 cells, and half a voxel
        more at each end."""
        alpha = 1 - (1 - OPACITY) ** EDGE
        middle = [c + (EDGE - 1) / 2 for c in CUBE]
        for axis in range(3):
            eye = [m + (400 if a == axis else 0) for a, m in enumerate(middle)]
            up = [a == (axis + 1) % 3 for a in range(3)]
            view = [f"--eye={eye[0]},{eye[1]},{eye[2]}", "--ortho=40", "--size=16x16",
                    f"--look={middle[0]},{middle[1]},{middle[2]}", "--memory=512M",
                    f"--up={up[0]:d},{up[1]:d},{up[2]:d}", "--tf=many.tf", "--no-shading"]
            for renderer in ("cpu", "reference") + program.GL:
                for classify in "post", "pre":
                    p = self.picture("many.trip", *view, "--renderer", renderer, "--classify",
                                     classify)
                    self.assertLess(abs(p[..., 3] - alpha).max(), 1e-4)
                    self.assertLess(abs(p[..., 1] - alpha / 2).max(), 1e-4)


if __name__ == "__main__":
    program.main()
