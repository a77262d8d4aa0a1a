"""Reads OpenEXR files as the program writes them."""
import struct
import zlib

import numpy


def read_exr(path):
    """Reads like read_linear_exr() and applies the sRGB curve to the colours without their alpha,
    in double precision."""
    picture = read_linear_exr(path).astype(float)
    alpha = picture[..., 3:]
    straight = picture[..., :3] / numpy.where(alpha > 0, alpha, 1)
    curve = 1.055 * numpy.maximum(straight, 1e-9) ** (1 / 2.4) - 0.055
    display = numpy.where(straight <= 0.0031308, 12.92 * straight, curve)
    return numpy.concatenate([display * numpy.where(alpha > 0, alpha, 1), alpha], axis=-1)


def read_linear_exr(path):
    """Returns the colours of an OpenEXR file as height x width x RGBA."""
    names, picture = read_exr_channels(path)
    assert names == [b"A", b"B", b"G", b"R"], names
    return picture[..., [3, 2, 1, 0]]


def read_exr_channels(path):
    """Reads an OpenEXR file of scan lines with ZIP compression and float channels. Returns the
    names of the channels, and height x width x channels."""
    with open(path, "rb") as f:
        data = f.read()
    at, window, names = 8, None, []
    while data[at]:
        name_end = data.index(0, at)
        type_end = data.index(0, name_end + 1)
        (size,) = struct.unpack_from("<i", data, type_end + 1)
        if data[at:name_end] == b"dataWindow":
            window = struct.unpack_from("<4i", data, type_end + 5)
        if data[at:name_end] == b"channels":
            listed = data[type_end + 5 : type_end + 5 + size]
            while listed[0]:
                end = listed.index(0)
                names.append(listed[:end])
                listed = listed[end + 17 :]
        at = type_end + 5 + size
    width, height = window[2] + 1, window[3] + 1
    blocks = -(-height // 16)
    count = len(names)
    picture = numpy.empty((height, width, count), numpy.float32)
    for offset in struct.unpack_from(f"<{blocks}Q", data, at + 1):
        y, size = struct.unpack_from("<2i", data, offset)
        rows = min(16, height - y)
        plain = exr_unpack(data[offset + 8 : offset + 8 + size], rows * width * count * 4)
        picture[y : y + rows] = plain.reshape(rows, count, width).transpose(0, 2, 1)
    return names, picture


def exr_unpack(packed, size):
    """Reverses ZIP compression of OpenEXR: zlib, differences, and two interleaved halves of bytes.
    Data that would not shrink is stored uncompressed."""
    if len(packed) == size:
        return numpy.frombuffer(packed, "<f4")
    steps = numpy.frombuffer(zlib.decompress(packed), numpy.uint8).astype(numpy.int64)
    steps[1:] -= 128
    halves = (numpy.cumsum(steps) & 255).astype(numpy.uint8)
    plain = numpy.empty_like(halves)
    plain[0::2], plain[1::2] = halves[: (size + 1) // 2], halves[(size + 1) // 2 :]
    return plain.view("<f4")
