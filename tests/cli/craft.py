"""Data sets with right checksums and wrong contents: change the bytes of one that `brick` made, then
seal it. Offsets are those of stream/FORMAT.md."""
import struct

import xxhash

HEADER_BYTES = 1024


def xxh64(data):
    return xxhash.xxh64(bytes(data), seed=0).intdigest()


class Dataset:
    """The files of a data set, to be changed and written: `index` and `planes["x.voxels"]` are
    byte arrays."""

    def __init__(self, path):
        with open(f"{path}/index.trip", "rb") as f:
            self.index = bytearray(f.read())
        self.plane_names = ["voxels", "normals"][: self.number("<I", 236).bit_length()]
        self.planes = {}
        for axis in "xyz":
            for plane in self.plane_names:
                with open(f"{path}/{axis}.{plane}", "rb") as f:
                    self.planes[f"{axis}.{plane}"] = bytearray(f.read())

    def number(self, layout, at):
        return struct.unpack_from(layout, self.index, at)[0]

    def put(self, layout, at, *values):
        struct.pack_into(layout, self.index, at, *values)

    def list_at(self, axis):
        """Where the descriptor of a list, 0 to 2, stands."""
        return self.number("<Q", 248) + 128 * axis

    def bricks(self, axis):
        """Where the bricks of a list stand."""
        at = self.list_at(axis)
        first = self.number("<Q", at + 40)
        return [first + 24 * i for i in range(self.number("<Q", at + 32))]

    def slabs(self, axis):
        at = self.list_at(axis)
        first = self.number("<Q", at + 24)
        return [first + 24 * i for i in range(self.number("<Q", at + 16))]

    def page_sums(self, data):
        page = 1 << self.number("<I", 232)
        return [xxh64(data[at : at + page]) for at in range(0, len(data), page)]

    def seal(self):
        """Right checksums for what stands there now."""
        for axis, letter in enumerate("xyz"):
            for plane, name in enumerate(self.plane_names):
                sums = self.page_sums(self.planes[f"{letter}.{name}"])
                at = self.number("<Q", self.list_at(axis) + 56 + 8 * plane)
                self.put(f"<{len(sums)}Q", at, *sums)
        table = self.number("<Q", 32)
        sums = self.page_sums(self.index[HEADER_BYTES:table])
        self.put(f"<{len(sums)}Q", table, *sums)
        self.put("<Q", 40, xxh64(self.index[table:]))
        self.put("<Q", 16, 0)
        self.put("<Q", 16, xxh64(self.index[:HEADER_BYTES]))

    def write(self, path):
        """Sealed, into a folder that exists."""
        self.seal()
        with open(f"{path}/index.trip", "wb") as f:
            f.write(self.index)
        for name, data in self.planes.items():
            with open(f"{path}/{name}", "wb") as f:
                f.write(data)
