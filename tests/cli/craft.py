"""Makes data sets with valid checksums and wrong contents. A test changes bytes of a data set that
`brick` made, then seals it. Offsets are as in stream/FORMAT.md."""
import struct

import xxhash

HEADER_BYTES = 1024


def xxh64(data):
    return xxhash.xxh64(bytes(data), seed=0).intdigest()


class Dataset:
    """The files of a data set in memory. `index` and `planes["x0.voxels"]` are byte arrays that a
    test can change."""

    def __init__(self, path):
        with open(f"{path}/index.trip", "rb") as f:
            self.index = bytearray(f.read())
        self.lists = self.number("<I", 288)
        self.names = [self.plane_names(number) for number in range(self.lists)]
        self.planes = {}
        for names in self.names:
            for name in names.values():
                with open(f"{path}/{name}", "rb") as f:
                    self.planes[name] = bytearray(f.read())

    def number(self, layout, at):
        return struct.unpack_from(layout, self.index, at)[0]

    def put(self, layout, at, *values):
        struct.pack_into(layout, self.index, at, *values)

    def list_at(self, number):
        """Returns the offset of a list's descriptor."""
        return self.number("<Q", 296) + 320 * number

    def plane_names(self, number):
        """Returns the names of a list's files by plane."""
        at = self.list_at(number)
        axis, level, kind, planes = struct.unpack_from("<4I", self.index, at)
        names = (
            ("voxels", "normals"), ("halo",), ("means", "mean-normals"), ("values", None, "deviations")
        )[kind]
        return {
            plane: f"{'xyz'[axis]}{level}.{name}"
            for plane, name in enumerate(names) if planes >> plane & 1
        }

    def bricks(self, number):
        """Returns the offsets of a list's bricks."""
        at = self.list_at(number)
        first = self.number("<Q", at + 184)
        return [first + 24 * i for i in range(self.number("<Q", at + 176))]

    def slabs(self, number):
        at = self.list_at(number)
        first = self.number("<Q", at + 168)
        return [first + 32 * i for i in range(self.number("<Q", at + 160))]

    def runs(self, number):
        """Yields for every run of a list, in file order: the offsets of its entry, brick and block,
        and its records and words."""
        at = self.list_at(number)
        table, sheets = self.number("<Q", at + 192), self.number("<I", 268)
        bricks, first = self.bricks(number), 0
        for slab in self.slabs(number):
            block, count = self.number("<Q", slab + 16), self.number("<I", slab + 24)
            for sheet in range(sheets):
                for brick in range(first, first + count):
                    entry = table + 4 * (sheets * brick + sheet)
                    records, words = struct.unpack_from("<2H", self.index, entry)
                    if records:
                        yield entry, bricks[brick], block, records, words
                    block += 8 * words
            first += count

    def page_sums(self, data):
        page = 1 << self.number("<I", 272)
        return [xxh64(data[at : at + page]) for at in range(0, len(data), page)]

    def seal(self):
        """Writes valid checksums for the current bytes."""
        for number in range(self.lists):
            for plane, name in self.names[number].items():
                sums = self.page_sums(self.planes[name])
                at = self.number("<Q", self.list_at(number) + 232 + 8 * plane)
                self.put(f"<{len(sums)}Q", at, *sums)
        table = self.number("<Q", 32)
        sums = self.page_sums(self.index[HEADER_BYTES:table])
        self.put(f"<{len(sums)}Q", table, *sums)
        self.put("<Q", 40, xxh64(self.index[table:]))
        self.put("<Q", 16, 0)
        self.put("<Q", 16, xxh64(self.index[:HEADER_BYTES]))

    def write(self, path):
        """Seals the data set and writes it into an existing folder."""
        self.seal()
        with open(f"{path}/index.trip", "wb") as f:
            f.write(self.index)
        for name, data in self.planes.items():
            with open(f"{path}/{name}", "wb") as f:
                f.write(data)
