"""A second reader of the data sets of Gaussian scenes, written from stream/GAUSSIANS.md alone: the
bricks, their cones and the sides of their surfels. It can also write a changed index."""
import os
import struct

import numpy
import xxhash

HEADER = 512
NODE = numpy.dtype([("lo", "<f8", 3), ("hi", "<f8", 3), ("width", "<f8"), ("nodes", "<u8"),
                    ("first_brick", "<u8", 3), ("brick_count", "<u4", 3), ("level", "<u4")])
BRICK = numpy.dtype([("centre_lo", "<f8", 3), ("centre_hi", "<f8", 3), ("reach_lo", "<f8", 3),
                     ("reach_hi", "<f8", 3), ("first_record", "<u8"), ("records", "<u4"),
                     ("size_class", "<i4"), ("log", "<f4", 2), ("colour_lo", "<f4", 3),
                     ("colour_hi", "<f4", 3), ("scale", "<f4", 3), ("opacity_max", "<f4"),
                     ("checksums", "<u8", 4), ("cone_axis", "<f4", 3), ("cone_cosine", "<f4")])


class Scene:
    """`nodes` and `bricks[axis]` are arrays that a caller can change before write_index()."""

    def __init__(self, path):
        self.path = path
        with open(os.path.join(path, "index.trip"), "rb") as file:
            self.index = bytearray(file.read())
        assert self.index[:8] == b"TRIPGAUS" and struct.unpack_from("<I", self.index, 8)[0] == 3
        counts, offsets = (struct.unpack_from("<3Q", self.index, at) for at in (56, 80))
        nodes, at = struct.unpack_from("<2Q", self.index, 272)
        self.flags = struct.unpack_from("<I", self.index, 52)[0]
        self.nodes = numpy.frombuffer(self.index, NODE, nodes, at)
        self.bricks = [numpy.frombuffer(self.index, BRICK, n, at) for n, at in zip(counts, offsets)]
        self.records = [numpy.fromfile(os.path.join(path, axis + ".gaussians"), "<u8").reshape(-1, 3)
                        for axis in "xyz"]

    def write_index(self):
        def seal(at, data):
            struct.pack_into("<Q", self.index, at, xxhash.xxh64(bytes(data), seed=0).intdigest())

        seal(24, self.index[HEADER:])
        self.index[16:24] = bytes(8)
        seal(16, self.index[:HEADER])
        with open(os.path.join(self.path, "index.trip"), "wb") as file:
            file.write(self.index)

    def surfels(self, axis, brick):
        """Returns the centres, the normals, and whether each surfel lacks a front side."""
        b = self.bricks[axis][brick]
        words = self.records[axis][b["first_record"]:][:b["records"]]

        def bits(word, at, count):
            return (words[:, word] >> numpy.uint64(at) & numpy.uint64((1 << count) - 1)).astype(int)

        codes = numpy.stack([bits(0, 21 * a, 21) for a in range(3)], 1)
        centre = b["centre_lo"] + codes * (b["centre_hi"] - b["centre_lo"]) / 2097151
        others = numpy.stack([(2 * bits(1, 2 + 12 * k, 12) / 4094 - 1) / 2 ** 0.5 for k in range(3)], 1)
        squares = (others ** 2).sum(1, keepdims=True)
        others /= numpy.where(squares > 1, squares ** 0.5, 1)
        rotation = numpy.empty((len(words), 4))
        largest = bits(1, 0, 2)
        for which in range(4):
            here = largest == which
            rest = [k for k in range(4) if k != which]
            rotation[numpy.ix_(here, rest)] = others[here]
            rotation[here, which] = numpy.maximum(0, 1 - squares[here, 0]) ** 0.5
        low, high = map(float, b["log"])
        codes = numpy.stack([bits(2, 12 * a, 12) for a in range(3)], 1)
        deviation = numpy.where(codes, numpy.exp(low + (codes - 1) * (high - low) / 4094), 0)
        least = 2 - deviation[:, ::-1].argmin(1)  # the last one of equal axes
        w, x, y, z = rotation.T
        axes = numpy.array([[1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
                            [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
                            [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)]])
        return centre, axes[least, :, numpy.arange(len(words))], bits(0, 63, 1) == 1
