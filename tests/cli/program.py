"""Support for the tests in this folder. Runs the program as a user does, writes volumes in every
format, and reads the pictures.

Debian's own Python runs these tests with NumPy. ctest passes the paths of the programs in the
environment."""
import json
import os
import re
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
import unittest
import zlib

SKIPPED = 77  # CTest's exit status for skipped tests

try:
    import numpy
except ImportError:
    print("skipped: python3-numpy is not installed")
    sys.exit(SKIPPED)

from exr import read_exr, read_exr_channels, read_linear_exr  # noqa: F401, for the tests

PROGRAM = os.environ["TRIP_PROGRAM"]
# The program with a stand-in for triptych-images (tests/quick), for tests that need only pixels.
QUICK_PROGRAM = os.environ["TRIP_QUICK_PROGRAM"]
GENERATE = os.environ["TRIP_GENERATE"]
DATASETS = os.path.join(os.environ["TRIP_SOURCE_DIR"], "datasets")
SANITIZED = bool(os.environ.get("TRIP_SANITIZE"))
# Mesa keeps its own shader cache, although each test has another XDG_CACHE_HOME.
os.environ.setdefault("MESA_SHADER_CACHE_DIR",
                      os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"))
SWITCHED_OFF = os.environ.get("TRIP_SWITCHED_OFF", "").split()  # for example "GL OPENVDB"
if "OPENVDB" in SWITCHED_OFF:
    sys.modules["pyopenvdb"] = None  # tests find it missing

_lacks = []  # parts that this machine cannot test


def __getattr__(name):
    """GL has the name of the renderer gl, for lists of renderers. It is empty if gl is switched off
    or no driver offers OpenGL 4.5. A program of tests/quick tells which
    drivers there are."""
    if name != "GL":
        raise AttributeError(name)
    global GL
    GL = () if "GL" in SWITCHED_OFF else ("gl",)
    driver = os.path.join(os.path.dirname(QUICK_PROGRAM), "opengl")
    if GL and subprocess.run([driver], stdout=subprocess.DEVNULL).returncode:
        GL = ()
        _lacks.append("OpenGL 4.5 by EGL")
    return GL


def need_gl():
    """Skips a test if gl is switched off, or cannot draw on this machine."""
    if not sys.modules[__name__].GL:
        raise unittest.SkipTest(f"this machine lacks {_lacks[0]}" if _lacks else "built without OpenGL")


LINE = re.compile(r"triptych: ([^:\n]+: [^\n]+: [^\n]+|[^:\n]+: interrupted)\n")


def start(*arguments, program=PROGRAM, **options):
    options.setdefault("stdin", subprocess.DEVNULL)
    options.setdefault("stdout", subprocess.PIPE)
    options.setdefault("stderr", subprocess.PIPE)
    return subprocess.Popen([program, *map(str, arguments)], **options)


def await_handler(process):
    """Waits until the program handles SIGINT, or has ended."""
    caught = 0
    while process.poll() is None and not caught >> (signal.SIGINT - 1) & 1:
        with open(f"/proc/{process.pid}/status", encoding="ascii") as status:
            (line,) = (l for l in status if l.startswith("SigCgt:"))
        caught = int(line.split()[1], 16)
        time.sleep(0.01)


def processor_seconds(process):
    """Returns the processor time of a process that was not waited for."""
    with open(f"/proc/{process.pid}/stat", encoding="ascii") as stat:
        fields = stat.read().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def skip_what_is_switched_off(arguments):
    if "OPENVDB" in SWITCHED_OFF and any(str(a).endswith(".vdb") for a in arguments):
        raise unittest.SkipTest("built without OpenVDB")


def call(*arguments, timeout=60, **options):
    """Runs the program and returns a CompletedProcess. A run beyond the timeout is an error. Skips
    the test if an argument needs OpenVDB and the build lacks it."""
    skip_what_is_switched_off(arguments)
    process = start(*arguments, **options)
    try:
        out, err = process.communicate(timeout=timeout)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        raise AssertionError(f"hangs: {arguments}")
    return subprocess.CompletedProcess(
        arguments, process.returncode, out, err.decode(errors="replace")
    )


class ProgramTest(unittest.TestCase):
    """Gives each class its own current folder and its own cache for bricked volumes."""

    @classmethod
    def setUpClass(cls):
        cache = tempfile.TemporaryDirectory(prefix="trip-cache-")
        cls.addClassCleanup(cache.cleanup)
        os.environ["XDG_CACHE_HOME"] = cache.name
        cls.folder = tempfile.mkdtemp(prefix="trip-cli-")
        os.chdir(cls.folder)

    @classmethod
    def tearDownClass(cls):
        os.chdir("/")
        shutil.rmtree(cls.folder)

    def works(self, *arguments, **options):
        if any(str(a).endswith(".exr") for a in arguments):
            options.setdefault("program", QUICK_PROGRAM)
        run = call(*arguments, **options)
        self.assertEqual(run.returncode, 0, f"{arguments}: {run.stderr}")
        return run

    def fails(self, status, *arguments, says="", **options):
        """Checks the exit status, and that stderr has one line in the project's form."""
        run = call(*arguments, **options)
        about = f"{arguments}: exit status {run.returncode}, stderr: {run.stderr!r}"
        self.assertEqual(run.returncode, status, about)
        self.assertTrue(LINE.fullmatch(run.stderr), about)
        self.assertIn(says, run.stderr)
        return run

    def leaves_nothing(self, status, *arguments, says="", **options):
        """Checks that the command fails and creates no file or folder."""
        before = set(os.listdir("."))
        run = self.fails(status, *arguments, says=says, **options)
        self.assertEqual(set(os.listdir(".")), before, arguments)
        return run

    def info(self, path):
        return json.loads(self.works("info", "--json", path).stdout)

    def brick(self, source, output, *options):
        """Bricks into a new folder. Returns the output of `info --json`."""
        shutil.rmtree(output, ignore_errors=True)
        self.works("brick", source, "-o", output, "-q", *options)
        return self.info(output)

    def stats(self, *arguments):
        """Draws a.exr. Returns its --stats."""
        return json.loads(self.works("render", *arguments, "-o", "a.exr", "--stats", "-").stdout)

    def picture(self, *arguments):
        """Draws a picture. Returns height x width x RGBA as floats, with premultiplied alpha."""
        self.works("render", *arguments, "-o", "picture.exr")
        return read_exr("picture.exr")


def splats_drawn(stats):
    """Returns the number of splats in a frame drawn with --count."""
    return sum(l["splats_drawn"] for l in stats["frames"][0]["counted"].values())


def main():
    """Runs the module's tests. Exits with 77 if a test or a part was skipped and none failed."""
    test = unittest.main(verbosity=2, exit=False).result
    for lack in _lacks:
        print(f"skipped in part: this machine lacks {lack}")
    skipped = test.skipped or _lacks
    sys.exit(SKIPPED if test.wasSuccessful() and skipped else not test.wasSuccessful())


# Pictures


# Volumes. Arrays have the shape (z, y, x), the order of the values in a file.

NRRD_TYPES = {
    "u1": "uint8",
    "i1": "int8",
    "u2": "uint16",
    "i2": "int16",
    "u4": "uint32",
    "i4": "int32",
    "f4": "float",
    "f8": "double",
}
NIFTI_TYPES = {"u1": 2, "i2": 4, "i4": 8, "f4": 16, "f8": 64, "i1": 256, "u2": 512, "u4": 768}


def write(path, data):
    with open(path, "wb") as f:
        f.write(data)


def write_raw(path, volume):
    write(path, volume.tobytes())


def write_report(folder, data_set, classify="post", levels_for="auto"):
    """Writes a report of one setting, like `triptych accuracy`. Its checksum is 0 if `data_set` is
    None."""
    checksum = 0
    if data_set:
        with open(os.path.join(data_set, "index.trip"), "rb") as f:
            (checksum,) = struct.unpack_from("<Q", f.read(24), 16)
    os.makedirs(folder, exist_ok=True)
    row = {"name": "one", "options": {"renderer": "cpu", "classify": classify}, "ms": 1,
           "error": 1}
    with open(os.path.join(folder, "accuracy.json"), "w", encoding="utf-8") as f:
        json.dump({"triptych_accuracy": 3, "checksum": f"{checksum:016x}",
                   "levels_for": levels_for, "shading": True, "rows": [row]}, f)


def write_nrrd(path, volume, spacing=(1, 1, 1), encoding="raw", endian="little", geometry=None):
    """Writes an NRRD file. `geometry` replaces the line of spacings."""
    data = volume.astype(volume.dtype.newbyteorder("<" if endian == "little" else ">")).tobytes()
    if encoding == "gzip":
        packer = zlib.compressobj(wbits=31)
        data = packer.compress(data) + packer.flush()
    z, y, x = volume.shape
    header = (
        f"NRRD0004\ntype: {NRRD_TYPES[volume.dtype.str[1:]]}\ndimension: 3\n"
        f"sizes: {x} {y} {z}\n"
        f"{geometry or f'spacings: {spacing[0]} {spacing[1]} {spacing[2]}'}\n"
        f"endian: {endian}\nencoding: {encoding}\n\n"
    )
    write(path, header.encode() + data)


def write_nifti(path, volume, affine=None, packed=False, slope=1, inter=0):
    affine = numpy.eye(4) if affine is None else affine
    z, y, x = volume.shape
    header = bytearray(352)
    struct.pack_into("<i", header, 0, 348)
    struct.pack_into("<8h", header, 40, 3, x, y, z, 1, 1, 1, 1)
    struct.pack_into(
        "<2h", header, 70, NIFTI_TYPES[volume.dtype.str[1:]], 8 * volume.dtype.itemsize
    )
    struct.pack_into("<8f", header, 76, 1, *numpy.linalg.norm(affine[:3, :3], axis=0), 0, 0, 0, 0)
    struct.pack_into("<3f", header, 108, 352, slope, inter)
    struct.pack_into("<2h", header, 252, 0, 1)
    struct.pack_into("<12f", header, 280, *affine[:3].ravel())
    header[344:348] = b"n+1\0"
    data = bytes(header) + volume.tobytes()
    if packed:
        packer = zlib.compressobj(wbits=31)
        data = packer.compress(data) + packer.flush()
    write(path, data)


def write_vol(path, volume, version=3):
    z, y, x = volume.shape
    header = (
        f"Center-X: 0\nCenter-Y: 0\nCenter-Z: 0\nX: {x}\nY: {y}\nZ: {z}\nVoxel-Size: 1\n"
        f"Alpha-Color: 0\nVoxel-Endian: 0\nInt-Endian: 0123\nVersion: {version}\n.\n"
    )
    data = volume.tobytes()
    write(path, header.encode() + (zlib.compress(data) if version == 3 else data))


def write_tiff(path, image):
    """Writes a grey TIFF with a single strip."""
    height, width = image.shape
    data = image.tobytes()
    tags = [
        (256, width),
        (257, height),
        (258, 8 * image.dtype.itemsize),
        (259, 1),
        (262, 1),
        (273, 8),
        (277, 1),
        (278, height),
        (279, len(data)),
    ]
    folder = b"".join(struct.pack("<HHII", tag, 4, 1, value) for tag, value in tags)
    write(
        path,
        struct.pack("<2sHI", b"II", 42, 8 + len(data))
        + data
        + struct.pack("<H", len(tags))
        + folder
        + struct.pack("<I", 0),
    )


def write_png(path, image):
    height, width = image.shape
    rows = b"".join(b"\0" + row.astype(">" + image.dtype.str[1:]).tobytes() for row in image)

    def chunk(name, data):
        return (
            struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
        )

    write(
        path,
        b"\x89PNG\r\n\x1a\n"
        + chunk(
            b"IHDR", struct.pack(">IIBBBBB", width, height, 8 * image.dtype.itemsize, 0, 0, 0, 0)
        )
        + chunk(b"IDAT", zlib.compress(rows))
        + chunk(b"IEND", b""),
    )


def write_exr(path, image):
    """Writes an OpenEXR file with one float channel, Y, not compressed."""
    rows, columns = image.shape
    window = struct.pack("<4i", 0, 0, columns - 1, rows - 1)
    attributes = [
        ("channels", "chlist", b"Y\0" + struct.pack("<iB3xii", 2, 0, 1, 1) + b"\0"),
        ("compression", "compression", b"\0"),
        ("dataWindow", "box2i", window),
        ("displayWindow", "box2i", window),
        ("lineOrder", "lineOrder", b"\0"),
        ("pixelAspectRatio", "float", struct.pack("<f", 1)),
        ("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0)),
        ("screenWindowWidth", "float", struct.pack("<f", 1)),
    ]
    head = struct.pack("<2I", 20000630, 2)
    for name, kind, value in attributes:
        head += f"{name}\0{kind}\0".encode() + struct.pack("<i", len(value)) + value
    head += b"\0"
    at, line = len(head) + 8 * rows, 8 + 4 * columns
    offsets = b"".join(struct.pack("<Q", at + line * y) for y in range(rows))
    lines = [struct.pack("<2i", y, 4 * columns) + image[y].astype("<f4").tobytes()
             for y in range(rows)]
    write(path, head + offsets + b"".join(lines))


def write_stack(folder, volume, write_image, extension):
    os.makedirs(folder, exist_ok=True)
    for z, image in enumerate(volume):
        write_image(os.path.join(folder, f"slice-{z:04d}.{extension}"), image)


def dicom_element(group, element, kind, value):
    value += b"" if len(value) % 2 == 0 else (b"\0" if kind == b"UI" else b" ")
    if kind in (b"OW", b"OB", b"SQ"):
        return struct.pack("<HH2sHI", group, element, kind, 0, len(value)) + value
    return struct.pack("<HH2sH", group, element, kind, len(value)) + value


def dicom_numbers(group, element, numbers):
    """Returns an element of decimal strings, each at most 16 characters long, as the DICOM standard
    demands."""
    text = "\\".join(f"{round(float(v), 9) + 0.0:.10g}" for v in numbers)
    return dicom_element(group, element, b"DS", text.encode())


def dicom_sequence(group, element, items):
    data = b"".join(struct.pack("<HHI", 0xFFFE, 0xE000, len(item)) + item for item in items)
    return dicom_element(group, element, b"SQ", data)


def dicom_geometry(group, place, rows, spacing):
    """Returns the elements with group 0x20 or 0x28 that give a slice's geometry."""
    if group == 0x20:
        return dicom_numbers(0x20, 0x0032, place) + dicom_numbers(0x20, 0x0037, rows)
    return dicom_numbers(0x28, 0x0030, spacing[1::-1])


def write_dicom(
    path,
    image,
    z,
    spacing=(1, 1, 1),
    place=None,
    rows=(1, 0, 0, 0, 1, 0),
    frames=(),
    modality="",
    inter=0,
):
    """Writes a DICOM file in explicit VR little endian with 16 bits per pixel.

    `place` is the position of the first pixel. `rows` holds the directions of rows and columns.
    `inter` is added to the values. With `frames`, `image` has three axes, `frames` holds the
    positions of its slices, and the file keeps its geometry in sequences."""
    e, columns = dicom_element, image.shape[-1]
    us = lambda value: struct.pack("<H", value)
    place = (0, 0, z * spacing[2]) if place is None else place
    sequences = frames_count = b""
    if len(frames):
        shared = dicom_sequence(
            0x28, 0x9110, [dicom_geometry(0x28, place, rows, spacing)]
        )
        shared = dicom_sequence(0x20, 0x9116, [dicom_numbers(0x20, 0x37, rows)]) + shared
        places = [dicom_sequence(0x20, 0x9113, [dicom_numbers(0x20, 0x32, p)]) for p in frames]
        sequences = dicom_sequence(0x5200, 0x9229, [shared])
        sequences += dicom_sequence(0x5200, 0x9230, places)
        frames_count = e(0x28, 0x0008, b"IS", str(len(frames)).encode())
    meta = (
        e(2, 0x0001, b"OB", b"\0\1")
        + e(2, 0x0002, b"UI", b"1.2.840.10008.5.1.4.1.1.2")
        + e(2, 0x0003, b"UI", f"1.2.3.{z + 1}".encode())
        + e(2, 0x0010, b"UI", b"1.2.840.10008.1.2.1")
        + e(2, 0x0012, b"UI", b"1.2.3")
    )
    data = (
        e(8, 0x0016, b"UI", b"1.2.840.10008.5.1.4.1.1.2")
        + e(8, 0x0018, b"UI", f"1.2.3.{z + 1}".encode())
        + (e(8, 0x0060, b"CS", modality.encode()) if modality else b"")
        + e(0x20, 0x000E, b"UI", b"1.2.3.4")
        + e(0x20, 0x0013, b"IS", str(z + 1).encode())
        + (b"" if sequences else dicom_geometry(0x20, place, rows, spacing))
        + e(0x28, 0x0002, b"US", us(1))
        + e(0x28, 0x0004, b"CS", b"MONOCHROME2")
        + frames_count
        + e(0x28, 0x0010, b"US", us(image.shape[-2]))
        + e(0x28, 0x0011, b"US", us(columns))
        + (b"" if sequences else dicom_geometry(0x28, place, rows, spacing))
        + e(0x28, 0x0100, b"US", us(16))
        + e(0x28, 0x0101, b"US", us(16))
        + e(0x28, 0x0102, b"US", us(15))
        + e(0x28, 0x0103, b"US", us(0))
        + (dicom_numbers(0x28, 0x1052, [inter]) + dicom_numbers(0x28, 0x1053, [1]) if inter else b"")
        + sequences
        + e(0x7FE0, 0x0010, b"OW", image.astype("<u2").tobytes())
    )
    write(path, bytes(128) + b"DICM" + e(2, 0, b"UL", struct.pack("<I", len(meta))) + meta + data)


def ball(shape, spacing=(1, 1, 1), dtype="u1", radius=0.8):
    """Returns a soft ball at the centre. `radius` is a fraction of half the shortest side in world
    space."""
    half = [(n - 1) / 2 * s for n, s in zip(shape[::-1], spacing)]
    z, y, x = numpy.meshgrid(
        *((numpy.arange(n) - (n - 1) / 2) * s for n, s in zip(shape, spacing[::-1])), indexing="ij"
    )
    inside = radius * min(half) - numpy.sqrt(x * x + y * y + z * z)
    top = 200 if dtype == "u1" else 1 if dtype[0] == "f" else 20000
    soft = numpy.clip(inside / max(spacing) + 0.5, 0, 1) * top
    return soft.astype(dtype) if dtype[0] == "f" else numpy.rint(soft).astype(dtype)


def noise(shape, dtype="u1", seed=1):
    """Returns smooth noise without any symmetry."""
    random = numpy.random.default_rng(seed)
    coarse = random.random([n // 4 + 2 for n in shape])
    for axis, n in enumerate(shape):
        at = numpy.arange(n) / 4
        low = at.astype(int)
        f = (at - low).reshape([-1 if a == axis else 1 for a in range(3)])
        coarse = numpy.take(coarse, low, axis) * (1 - f) + numpy.take(coarse, low + 1, axis) * f
    top = 255 if dtype == "u1" else 1 if dtype[0] == "f" else 30000
    values = coarse * top
    return values.astype(dtype) if dtype[0] == "f" else numpy.rint(values).astype(dtype)
