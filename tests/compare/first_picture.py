#!/usr/bin/python3
"""Seconds from a file to its picture: `triptych render VOLUME -o x.png` for every kind of file, as a
table. "first" bricks into an empty cache, "again" finds it there; the middle one of ROUNDS runs,
with the files in the page cache. One volume in each form, written beside the others, and what there
is of others:

    tests/compare/first_picture.py build/release/triptych [VOLUME_XxYxZ_TYPE.raw] [FILE...]

Without a volume it is the included tooth.
"""
import bz2
import gzip
import os
import re
import shutil
import statistics
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
    """A raw file by its name, packed or not: the values as (z, y, x)."""
    name = re.search(r"_(\d+)x(\d+)x(\d+)_(\w+)\.raw(\.gz|\.bz2)?$", path)
    if not name:
        sys.exit(f"first_picture: {path} is not named like engine_256x256x128_uint8.raw")
    x, y, z = (int(n) for n in name.groups()[:3])
    opens = {None: open, ".gz": gzip.open, ".bz2": bz2.open}[name[5]]
    with opens(path, "rb") as f:
        values = numpy.frombuffer(f.read(), numpy.dtype(name[4].replace("float", "float32")))
    return values.reshape(z, y, x)


def tooth():
    values = numpy.fromfile(os.path.join(ROOT, "datasets", "tooth.raw"), ">u2")
    return values.astype("<u2").reshape(161, 94, 103)


def write_forms(values):
    """The same values in every form that can be written here."""
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
    forms = [
        ("raw", raw),
        ("raw, gzip", raw + ".gz"),
        ("raw, bzip2", raw + ".bz2"),
        ("NRRD", "attached.nrrd"),
        ("NRRD, gzip", "packed.nrrd"),
        ("NIfTI", "plain.nii"),
        ("NIfTI, gzip", "packed.nii.gz"),
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
    return forms + stacks + [("DICOM series", "dicom")]


def size_of(path):
    if os.path.isdir(path):
        return sum(os.path.getsize(os.path.join(path, n)) for n in os.listdir(path))
    return os.path.getsize(path)


def seconds(triptych, path):
    begin = time.monotonic()
    run = subprocess.run([triptych, "render", path, "-o", "x.png"], capture_output=True)
    if run.returncode:
        sys.exit(run.stderr.decode())
    return time.monotonic() - begin


def measure(triptych, path):
    first, again = [], []
    for _ in range(ROUNDS):
        shutil.rmtree("cache", ignore_errors=True)
        first.append(seconds(triptych, path))
        again.append(seconds(triptych, path))
    return statistics.median(first), statistics.median(again)


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
        print("| file | MB | first, s | again, s |\n|---|---:|---:|---:|")
        for name, path in forms:
            first, again = measure(triptych, path)
            print(f"| {name} | {size_of(path) / 1e6:.1f} | {first:.2f} | {again:.2f} |", flush=True)
    finally:
        shutil.rmtree(folder)


main()
