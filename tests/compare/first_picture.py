#!/usr/bin/python3
"""Measures the seconds from a file to its picture: `triptych render VOLUME -o x.png`, as a table.

    tests/compare/first_picture.py build/release/triptych [VOLUME_XxYxZ_TYPE.raw] [FILE...]

The script writes the volume in every file format that it can write, and also measures the given
files. Without a volume it uses the included tooth. "First" bricks into an empty cache, "again"
finds the data set there. Each time comes with the processor seconds, which other work on the
machine hardly changes. All times are medians of ROUNDS runs, with the files in the page cache.
"""
import bz2
import gzip
import os
import re
import resource
import shutil
import statistics
import struct
import subprocess
import sys
import tempfile
import time

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
ROUNDS = 3

for name in "TRIP_PROGRAM", "TRIP_QUICK_PROGRAM", "TRIP_GENERATE":
    os.environ.setdefault(name, "")
os.environ.setdefault("TRIP_SOURCE_DIR", ROOT)
sys.path.insert(0, os.path.join(ROOT, "tests", "cli"))
import numpy
import program


def read_volume(path):
    """Reads a raw file, compressed or not, with size and type from its name. Returns values as (z,
    y, x)."""
    name = re.search(r"_(\d+)x(\d+)x(\d+)_(\w+)\.raw(\.gz|\.bz2)?$", path)
    if not name:
        sys.exit(f"first_picture: {path}: rename it like engine_256x256x128_uint8.raw")
    x, y, z = (int(n) for n in name.groups()[:3])
    opens = {None: open, ".gz": gzip.open, ".bz2": bz2.open}[name[5]]
    with opens(path, "rb") as f:
        values = numpy.frombuffer(f.read(), numpy.dtype(name[4].replace("float", "float32")))
    return values.reshape(z, y, x)


def tooth():
    values = numpy.fromfile(os.path.join(ROOT, "datasets", "tooth.raw"), ">u2")
    return values.astype("<u2").reshape(161, 94, 103)


def write_pages(path, values):
    """Writes a TIFF of several pages, one strip each. The tags are image width and length, bits, no
    compression, black is 0, and the position of the strip."""
    depth, height, width = values.shape
    size, place = height * width * values.dtype.itemsize, 8
    with open(path, "wb") as f:
        f.write(struct.pack("<2sHI", b"II", 42, place))
        for k, image in enumerate(values):
            tags = [(256, width), (257, height), (258, 8 * values.dtype.itemsize), (259, 1)]
            tags += [(262, 1), (273, place + 110), (278, height), (279, size)]
            place += 110 + size
            f.write(struct.pack("<H", len(tags)))
            for tag, value in tags:
                f.write(struct.pack("<HHII", tag, 4, 1, value))
            f.write(struct.pack("<I8x", place if k + 1 < depth else 0))
            f.write(image.tobytes())


def write_netcdf(path, values):
    """Writes netCDF in the classic format: three dimensions and a variable of floats, no
    attributes."""
    name = lambda text: struct.pack(">I", len(text)) + text + b"\0" * (-len(text) % 4)
    sizes = zip((b"z", b"y", b"x"), values.shape)
    dims = b"".join(name(axis) + struct.pack(">I", size) for axis, size in sizes)
    head = b"CDF\1" + struct.pack(">3I", 0, 10, 3) + dims
    head += struct.pack(">4I", 0, 0, 11, 1) + name(b"values")
    head += struct.pack(">6I", 3, 0, 1, 2, 0, 0)
    head += struct.pack(">3I", 5, 4 * values.size, len(head) + 12)
    program.write(path, head + values.astype(">f4").tobytes())


def write_detached(values, raw):
    """Writes headers with data in other files: one file, compressed or not, one per slice, or
    .img."""
    z, y, x = values.shape
    header = (
        f"NRRD0004\ntype: {program.NRRD_TYPES[values.dtype.str[1:]]}\ndimension: 3\n"
        f"sizes: {x} {y} {z}\nspacings: 1 1 1\nendian: little\n"
    )
    program.write("beside.nhdr", f"{header}encoding: raw\ndata file: {raw}\n".encode())
    program.write("packed.nhdr", f"{header}encoding: bzip2\ndata file: {raw}.bz2\n".encode())
    many = f"encoding: raw\ndata file: slice%04d.raw 0 {z - 1} 1 2\n"
    program.write("slices.nhdr", (header + many).encode())
    for k, image in enumerate(values):
        program.write_raw(f"slice{k:04d}.raw", image)
    with open("plain.nii", "rb") as f:
        pair = bytearray(f.read(348))
    struct.pack_into("<f", pair, 108, 0)
    program.write("pair.hdr", bytes(pair[:344]) + b"ni1\0")
    program.write_raw("pair.img", values)


def write_forms(values):
    """Writes the values in every file format. Returns (label, path) of each."""
    z, y, x = values.shape
    kind = program.NRRD_TYPES[values.dtype.str[1:]]
    raw = f"raw_{x}x{y}x{z}_{kind}.raw"
    program.write_raw(raw, values)
    program.write_nrrd("attached.nrrd", values)
    program.write_nrrd("packed.nrrd", values, encoding="gzip")
    program.write_nifti("plain.nii", values)
    program.write_nifti("packed.nii.gz", values, packed=True)
    for pack, ending in (gzip.compress, ".gz"), (bz2.compress, ".bz2"):
        program.write(raw + ending, pack(values.tobytes()))
    write_detached(values, raw)
    forms = [
        ("raw", raw),
        ("raw, gzip", raw + ".gz"),
        ("raw, bzip2", raw + ".bz2"),
        ("NRRD", "attached.nrrd"),
        ("NRRD, gzip", "packed.nrrd"),
        ("NRRD, detached header", "beside.nhdr"),
        ("NRRD, detached, bzip2", "packed.nhdr"),
        ("NRRD, detached, one file per slice", "slices.nhdr"),
        ("NIfTI", "plain.nii"),
        ("NIfTI, gzip", "packed.nii.gz"),
        ("NIfTI, .hdr and .img", "pair.hdr"),
    ]
    if values.dtype == numpy.uint8:
        program.write_vol("packed.vol", values)
        forms.append((".vol", "packed.vol"))
    program.write_stack("tiff", values, program.write_tiff, "tif")
    program.write_stack("png", values, program.write_png, "png")
    program.write_stack("exr", values, program.write_exr, "exr")
    os.makedirs("dicom")
    for k, image in enumerate(values):
        program.write_dicom(f"dicom/{k:04d}.dcm", image.astype(numpy.uint16), k)
    stacks = [(name, name.split()[0].lower()) for name in ("TIFF stack", "PNG stack", "EXR stack")]
    write_netcdf("plain.nc", values)
    write_pages("pages.tif", values)
    places = [(0, 0, k) for k in range(z)]
    frames = values.astype(numpy.uint16)
    program.write_dicom("frames.dcm", frames, 0, (1, 1, 1), places[0], frames=places)
    pages = ("TIFF with pages", "pages.tif")
    forms.append(("netCDF", "plain.nc"))
    return forms + stacks + [pages, ("DICOM series", "dicom"), ("DICOM with frames", "frames.dcm")]


def beside(path):
    """Returns the files with the values of a header."""
    endings = {"beside.nhdr": ".raw", "packed.nhdr": ".raw.bz2", "pair.hdr": ".img"}
    if path == "slices.nhdr":
        return [n for n in os.listdir() if n.startswith("slice") and n.endswith(".raw")]
    start = "pair" if path == "pair.hdr" else "raw_"
    ending = endings.get(path)
    return [n for n in os.listdir() if ending and n.startswith(start) and n.endswith(ending)]


def size_of(path):
    if os.path.isdir(path):
        return sum(os.path.getsize(os.path.join(path, n)) for n in os.listdir(path))
    return sum(os.path.getsize(n) for n in [path, *beside(path)])


def seconds(triptych, path):
    """Returns wall clock and processor seconds, including those of triptych-images."""
    begin, before = time.monotonic(), resource.getrusage(resource.RUSAGE_CHILDREN)
    run = subprocess.run([triptych, "render", path, "-o", "x.png"], capture_output=True)
    if run.returncode:
        sys.exit(run.stderr.decode())
    clock, after = time.monotonic() - begin, resource.getrusage(resource.RUSAGE_CHILDREN)
    return clock, after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def measure(triptych, path):
    first, again = [], []
    for _ in range(ROUNDS):
        shutil.rmtree("cache", ignore_errors=True)
        first.append(seconds(triptych, path))
        again.append(seconds(triptych, path))
    return [statistics.median(run[i] for run in runs) for runs in (first, again) for i in (0, 1)]


def measure_data_set(triptych, path):
    """Measures a data set that was bricked before."""
    subprocess.run([triptych, "brick", path, "-o", "x.trip", "-q"], check=True)
    runs = [seconds(triptych, "x.trip") for _ in range(ROUNDS)]
    return [statistics.median(run[i] for run in runs) for i in (0, 1)]


def main():
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    triptych = os.path.abspath(sys.argv[1])
    files = [os.path.abspath(f) for f in sys.argv[2:]]
    values = read_volume(files.pop(0)) if files else tooth()
    cloud = os.path.join(ROOT, "datasets", "wdas_cloud_sixteenth.vdb")
    folder = tempfile.mkdtemp(prefix="triptych-first-picture-")
    os.environ["XDG_CACHE_HOME"] = os.path.join(folder, "cache")
    os.chdir(folder)
    try:
        forms = write_forms(values) + [(os.path.basename(f), f) for f in [cloud] + files]
        z, y, x = values.shape
        print(f"{x} x {y} x {z}, {values.dtype}\n")
        print("| file | MB | first, s | processor s | again, s | processor s |")
        print("|---|---:|---:|---:|---:|---:|")
        for name, path in forms:
            times = " | ".join(f"{t:.2f}" for t in measure(triptych, path))
            print(f"| {name} | {size_of(path) / 1e6:.1f} | {times} |", flush=True)
        again = " | ".join(f"{t:.2f}" for t in measure_data_set(triptych, forms[0][1]))
        print(f"| data set of the first file | {size_of('x.trip') / 1e6:.1f} | | | {again} |")
    finally:
        shutil.rmtree(folder)


main()
