"""Reads volumes as NumPy arrays, indexed [k, j, i], for programs without a reader: NRRD, NIfTI,
.vol and OpenVDB. The readers are simple and independent of Triptych's own. The positions of voxels
come from `triptych info`, so all programs draw the same object."""
import bz2
import gzip
import os
import struct
import zlib

import numpy as np

NRRD_TYPES = {
    "uint8": "u1", "uchar": "u1", "unsigned char": "u1", "uint16": "u2", "ushort": "u2",
    "unsigned short": "u2", "int16": "i2", "short": "i2", "signed short": "i2", "float": "f4",
    "double": "f8", "int8": "i1", "int": "i4", "int32": "i4", "uint32": "u4",
}
NIFTI_TYPES = {2: "u1", 4: "i2", 8: "i4", 16: "f4", 64: "f8", 256: "i1", 512: "u2", 768: "u4"}


def _decompress(encoding, data):
    if encoding in ("gzip", "gz"):
        return gzip.decompress(data)
    if encoding in ("bzip2", "bz2"):
        return bz2.decompress(data)
    if encoding == "raw":
        return data
    raise ValueError("unknown encoding: " + encoding)


def read_nrrd(path):
    with open(path, "rb") as file:
        head, _, data = file.read().partition(b"\n\n")
    fields = {}
    for line in head.decode("latin-1").splitlines()[1:]:
        key, colon, value = line.partition(":")
        if colon and not line.startswith("#") and not value.startswith("="):
            fields[key.strip().lower()] = value.strip()
    detached = fields.get("data file", fields.get("datafile"))
    if detached:
        with open(os.path.join(os.path.dirname(path), detached), "rb") as file:
            data = file.read()
    order = ">" if fields.get("endian") == "big" else "<"
    sizes = [int(n) for n in fields["sizes"].split()]
    values = np.frombuffer(_decompress(fields["encoding"], data),
                           order + NRRD_TYPES[fields["type"]], count=int(np.prod(sizes)))
    return values.reshape(sizes[::-1])


def read_nifti(path):
    with open(path, "rb") as file:
        data = file.read()
    if path.endswith(".gz"):
        data = gzip.decompress(data)
    order = "<" if struct.unpack_from("<i", data)[0] == 348 else ">"
    dims = struct.unpack_from(order + "8h", data, 40)[1:4]
    code, = struct.unpack_from(order + "h", data, 70)
    offset, slope, inter = struct.unpack_from(order + "3f", data, 108)
    values = np.frombuffer(data, order + NIFTI_TYPES[code], int(np.prod(dims)), int(offset))
    values = values.reshape(dims[::-1])
    if slope not in (0, 1) or (slope and inter):
        values = (values * np.float32(slope) + np.float32(inter)).astype(np.float32)
    return values


def read_vol(path):
    with open(path, "rb") as file:
        head, _, data = file.read().partition(b"\n.\n")
    fields = dict(line.split(":", 1) for line in head.decode("latin-1").splitlines() if ":" in line)
    dims = [int(fields[axis]) for axis in "XYZ"]
    return np.frombuffer(zlib.decompress(data), np.uint8).reshape(dims[::-1])


def read_vdb(path, dims, first_world):
    """Returns the box of `dims` voxels of the first scalar grid, from the voxel at `first_world`
    on."""
    import pyopenvdb as vdb
    grids = [g for g in vdb.readAllGridMetadata(path) if g.valueTypeName in ("float", "half")]
    grid = vdb.read(path, grids[0].name)
    first = np.rint(grid.transform.worldToIndex(tuple(first_world))).astype(int)
    values = np.zeros(dims, np.float32)
    grid.copyToArray(values, ijk=tuple(int(n) for n in first))
    return np.ascontiguousarray(values.transpose(2, 1, 0))


def read(path, info):
    """Returns the volume of a file in native byte order. `info` is the output of `triptych info
    --json` for its data set."""
    if path.endswith((".nhdr", ".nrrd")):
        values = read_nrrd(path)
    elif path.endswith((".nii", ".nii.gz")):
        values = read_nifti(path)
    elif path.endswith(".vol"):
        values = read_vol(path)
    elif path.endswith(".vdb"):
        values = read_vdb(path, info["dims"], [row[3] for row in info["index_to_world"]])
    else:
        raise ValueError(path + ": unknown type; use .nhdr, .nrrd, .nii, .nii.gz, .vol or .vdb")
    if list(values.shape[::-1]) != info["dims"]:
        raise ValueError("%s: the file has %s voxels, its data set %s" %
                         (path, values.shape[::-1], info["dims"]))
    return values.astype(values.dtype.newbyteorder("="), copy=False)
