"""Synthetic records of LAS, for the tests of LAS and LAZ. Each number comes from a generator that is
written out here, so the records are the same everywhere."""
import struct

import numpy as np

# Bytes of a record, and offsets of its time, colour, near infrared and wave.
FORMATS = {0: (20, None, None, None, None), 1: (28, 20, None, None, None), 2: (26, None, 20, None, None),
           3: (34, 20, 28, None, None), 4: (57, 20, None, None, 28), 5: (63, 20, 28, None, 34),
           6: (30, 22, None, None, None), 7: (36, 22, 30, None, None), 8: (38, 22, 30, 36, None),
           9: (59, 22, None, None, 30), 10: (67, 22, 30, 36, 38)}
SCALE = np.array([0.001, 0.001, 0.002])
OFFSET = np.array([600000, 5000000, -10.0])


class Numbers:
    """A linear congruential generator (Knuth's MMIX)."""

    def __init__(self, seed):
        self.state = seed

    def below(self, limit):
        self.state = (self.state * 6364136223846793005 + 1442695040888963407) % 2 ** 64
        return (self.state >> 33) % limit


def records_of(kind, count, extra=0):
    """Returns the records of a point format: steps of all sizes, all returns, repeated and interleaved
    times, and four channels of the scanner in the formats from 6 on."""
    r = Numbers(kind + 1)
    size, time_at, colour_at, nir_at, wave_at = FORMATS[kind]
    out = np.zeros((count, size + extra), np.uint8)
    xyz, colour, wave = [0, 0, 0], [0, 0, 0], 1000
    times = [245370.25, 249783.5, 1e9]
    intensity = number = returns = klass = flags = 0
    for i in range(count):
        row = bytearray(size + extra)
        for a in range(3):
            step = r.below(2 << r.below(24)) - (1 << r.below(22)) if r.below(4) else 0
            xyz[a] = max(-2 ** 31, min(2 ** 31 - 1, xyz[a] + step))
        if r.below(3) == 0:
            returns = r.below(8 if kind < 6 else 16)
        if r.below(2) == 0:
            number = r.below(8 if kind < 6 else 16)
        if r.below(3):
            intensity = r.below(65536)
        if r.below(3) == 0:
            klass = r.below(32 if kind < 6 else 256)
        if r.below(4) == 0:
            flags = r.below(256)
        if kind < 6:
            struct.pack_into("<3iHBBBBH", row, 0, *xyz, intensity,
                             number | returns << 3 | flags & 0xc0, klass | flags << 5 & 0x60, r.below(9),
                             r.below(3), r.below(5))
        else:
            struct.pack_into("<3iHBBBBhH", row, 0, *xyz, intensity, number | returns << 4,
                             flags & 0xfb, klass, r.below(3), r.below(99) - 50, r.below(5))
        if time_at:
            k = r.below(3)
            if r.below(5):
                times[k] += (1 + r.below(4)) * 2e-5 * (1 if r.below(9) else -1) * 10 ** r.below(5)
            struct.pack_into("<d", row, time_at, times[k])
        if colour_at:
            for c in range(3):
                if r.below(3):
                    colour[c] = r.below(65536)
            if r.below(4) == 0:
                colour = [r.below(65536)] * 3
            struct.pack_into("<3H", row, colour_at, *colour)
        if nir_at:
            struct.pack_into("<H", row, nir_at, r.below(65536))
        if wave_at:
            wave += r.below(3) * r.below(1 << 20)
            struct.pack_into("<BQI4f", row, wave_at, r.below(4), wave, r.below(999), r.below(9) / 4,
                             r.below(5), r.below(7), r.below(9))
        for b in range(extra):
            row[size + b] = r.below(256) if r.below(2) else 7
        out[i] = np.frombuffer(bytes(row), np.uint8)
    return out


def column(records, at, kind):
    return records[:, at:at + np.dtype(kind).itemsize].copy().view(kind)[:, 0]


class Values:
    """The values of records, by the tables of the LAS specification."""

    def __init__(self, kind, records):
        _, time_at, colour_at, _, _ = FORMATS[kind]
        self.position = np.stack([column(records, 4 * a, "<i4") for a in range(3)], 1) * SCALE + OFFSET
        self.intensity = column(records, 12, "<u2")
        byte, flags = records[:, 14], records[:, 15]
        self.return_number = byte & 7 if kind < 6 else byte & 15
        self.returns = byte >> 3 & 7 if kind < 6 else byte >> 4
        self.classification = flags & 31 if kind < 6 else records[:, 16]
        self.withheld = (flags >> 7 if kind < 6 else flags >> 2 & 1).astype(bool)
        self.time = column(records, time_at, "<f8") if time_at else np.zeros(len(records))
        self.colour = (np.stack([column(records, colour_at + 2 * c, "<u2") for c in range(3)], 1)
                       if colour_at else np.zeros((len(records), 3))) / 65535


def las(kind, records, minor=None, vlrs=(), evlrs=(), **changes):
    """Returns a file of LAS. `vlrs` are (user, id, bytes). `changes` replace values of the header."""
    minor = (4 if kind >= 6 else 2 + (kind >= 4)) if minor is None else minor
    size = {0: 227, 1: 227, 2: 227, 3: 235, 4: 375}[minor]
    xyz = np.stack([column(records, 4 * a, "<i4") for a in range(3)], 1) * SCALE + OFFSET if len(
        records) else np.zeros((1, 3))
    heads = b"".join(struct.pack("<H16sHH32s", 0, user.encode(), number, len(data), b"") + data
                     for user, number, data in vlrs)
    after = b"".join(struct.pack("<H16sHQ32s", 0, user.encode(), number, len(data), b"") + data
                     for user, number, data in evlrs)
    values = dict(data_at=size + len(heads), format=kind, bytes=records.shape[1], count=len(records),
                  scale=SCALE, offset=OFFSET, lo=xyz.min(0), hi=xyz.max(0), vlrs=len(vlrs), size=size,
                  evlr_at=0, evlr_count=len(evlrs), legacy=None, minor=minor)
    values["evlr_at"] = size + len(heads) + records.size if evlrs else 0
    values.update(changes)
    v = values
    legacy = v["legacy"] if v["legacy"] is not None else v["count"] if minor < 4 else 0
    bounds = [x for a in range(3) for x in (v["hi"][a], v["lo"][a])]
    head = struct.pack("<4sHH16sBB32s32sHHHIIBHI5I12d", b"LASF", 0, 0, b"", 1, v["minor"], b"a scanner",
                       b"a test", 1, 2024, v["size"], v["data_at"], v["vlrs"], v["format"], v["bytes"],
                       legacy, 0, 0, 0, 0, 0, *v["scale"], *v["offset"], *bounds)
    if minor >= 3:
        head += struct.pack("<Q", 0)
    if minor >= 4:
        head += struct.pack("<QIQ15Q", v["evlr_at"], v["evlr_count"], v["count"], *[0] * 15)
    return head + heads + records.tobytes() + after
