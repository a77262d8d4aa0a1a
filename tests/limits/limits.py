"""What the tests of limits share: they run the real programs as a user does and judge what these
leave behind. Python's standard library only.

    test_x.py --program PATH... [--set NAME=VALUE]... [unittest's own arguments]
"""
import ctypes
import hashlib
import json
import os
import shutil
import subprocess
import sys
import tempfile
import threading
import time
import unittest

FAILED = {1, 2}  # exit statuses of what is refused or cannot be done
SKIPPED = 77  # CTest's
HANGS_SECONDS = 300
DATASETS = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "datasets")

_paths = {}
options = {}  # of the command line, by name


def program(name):
    """`quick` is triptych that writes OpenEXR files by what stands in for triptych-images (tests/quick):
    for pictures whose pixels are all that counts."""
    return options["quick"] if name == "quick" else _paths[name]


def use_programs(*paths):
    for path in paths:
        _paths[os.path.basename(path)] = os.path.abspath(path)


class Outcome:
    def __init__(self, status, out, err, peak_bytes, seconds):
        self.status, self.out, self.err = status, out, err
        self.peak_bytes = peak_bytes  # resident, as the kernel reports
        self.seconds = seconds


def run(name, *arguments, **popen):
    """Runs a program to its end. What takes OpenVDB is skipped where that is switched off."""
    vdb = any(str(a).endswith(".vdb") for a in arguments)
    if vdb and "OPENVDB" in options.get("switched_off", "").split():
        raise unittest.SkipTest("built without OpenVDB")
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        start = time.monotonic()
        child = subprocess.Popen([program(name), *map(str, arguments)], stdin=subprocess.DEVNULL,
                                 stdout=out, stderr=err, **popen)
        watch = threading.Timer(option("patience", HANGS_SECONDS), child.kill)
        watch.start()
        _, status, usage = os.wait4(child.pid, 0)
        watch.cancel()
        child.returncode = os.waitstatus_to_exitcode(status)
        seconds = time.monotonic() - start
        out.seek(0)
        err.seek(0)
        return Outcome(child.returncode, out.read().decode(errors="replace"),
                       err.read().decode(errors="replace"), usage.ru_maxrss * 1024, seconds)


def read_bytes(path):
    with open(path, "rb") as f:
        return f.read()


def picture_hash(path):
    """Of the file, but for the date that the format's library puts into it."""
    data = bytearray(read_bytes(path))
    at = data.find(b"capDate\0string\0")
    if at >= 0:
        first = at + len(b"capDate\0string\0") + 4
        data[first:first + 19] = bytes(19)
    return hashlib.sha256(data).hexdigest()


def folder_hashes(folder):
    return {name: hashlib.sha256(read_bytes(os.path.join(folder, name))).hexdigest()
            for name in sorted(os.listdir(folder))}


def folder_bytes(folder):
    return sum(os.path.getsize(os.path.join(folder, name)) for name in os.listdir(folder))


def text_bytes(n):
    return f"{n / 2**20:.1f} MiB"


class Test(unittest.TestCase):
    """Works in a folder of its own below the current one, since /tmp may be memory."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="limits-", dir=os.getcwd())

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder, ignore_errors=True)

    @classmethod
    def path(cls, *names):
        return os.path.join(cls.folder, *names)

    def note(self, text):
        print(f"    {text}", flush=True)

    def works(self, name, *arguments, warns="", **popen):
        """Ends well and silently, or with one line of warning that holds `warns`."""
        r = run(name, *arguments, **popen)
        self.assertEqual((r.status, r.err.count("\n")), (0, 1 if warns else 0),
                         f"{name} {arguments}: {r.err}")
        self.assertIn(warns, r.err)
        return r

    def fails(self, name, *arguments, says="", **popen):
        """Ends with one line of error that holds every text of `says`."""
        r = run(name, *arguments, **popen)
        self.assertRefused(r, says)
        return r

    def assertRefused(self, r, says=""):
        self.assertIn(r.status, FAILED, r.err)
        self.assertRegex(r.err, r"\Atriptych: [^\n]+\n\Z")
        for text in [says] if isinstance(says, str) else says:
            self.assertIn(text, r.err)

    def draw(self, data, *arguments, renderer="cpu", size="160x120", **popen):
        """The picture's hash."""
        path = self.path("picture.exr")
        if os.path.exists(path):
            os.remove(path)
        self.works("quick", "render", data, "-o", path, "--size", size, "--renderer", renderer,
                   *arguments, **popen)
        return picture_hash(path)

    def stats(self, data, *arguments, renderer="cpu", size="160x120"):
        """--stats of a frame, and the picture's hash."""
        path = self.path("picture.exr")
        r = self.works("quick", "render", data, "-o", path, "--size", size, "--renderer",
                       renderer, "--stats", "-", *arguments)
        return json.loads(r.out), picture_hash(path)

    def generate(self, name, field, size, *arguments):
        self.works("triptych-generate", field, "--size", size, "-o", self.path(name), *arguments)
        return self.path(name)

    def brick(self, volume, name, *arguments, **popen):
        self.works("triptych", "brick", volume, "-o", self.path(name), "-q", *arguments, **popen)
        return self.path(name)


def forget_pages(folder):
    """Drops a data set's files from the page cache."""
    for name in os.listdir(folder):
        f = os.open(os.path.join(folder, name), os.O_RDONLY)
        os.fsync(f)
        os.posix_fadvise(f, 0, 0, os.POSIX_FADV_DONTNEED)
        os.close(f)


def refuse_io_uring():
    """For preexec_fn: the kernel refuses to set up rings, as containers' filters do."""

    class Program(ctypes.Structure):
        _fields_ = [("length", ctypes.c_ushort), ("code", ctypes.c_void_p)]

    def instruction(code, jt, jf, k):
        return code.to_bytes(2, sys.byteorder) + bytes([jt, jf]) + k.to_bytes(4, sys.byteorder)

    io_uring_setup, eperm = 425, 1
    code = (instruction(0x20, 0, 0, 0) +  # load the number of the call
            instruction(0x15, 0, 1, io_uring_setup) +
            instruction(0x06, 0, 0, 0x00050000 | eperm) + instruction(0x06, 0, 0, 0x7FFF0000))
    buffer = ctypes.create_string_buffer(code, len(code))
    filters = Program(4, ctypes.cast(buffer, ctypes.c_void_p))
    libc = ctypes.CDLL(None, use_errno=True)
    no_new_privileges, seccomp, mode_filter = 38, 22, 2
    if libc.prctl(no_new_privileges, 1, 0, 0, 0) or \
            libc.prctl(seccomp, mode_filter, ctypes.byref(filters), 0, 0):
        raise OSError(ctypes.get_errno(), "seccomp")


def rounds(count):
    """How often something random is tried: more by the environment, for a night."""
    return count * int(os.environ.get("TRIP_LIMITS_ROUNDS", 1))


def option(name, default):
    """What --set gave, of the default's type."""
    return type(default)(options.get(name, default))


def main():
    """Runs the module's tests; 77 when one of them was skipped and none failed."""
    rest = []
    arguments = iter(sys.argv[1:])
    for argument in arguments:
        if argument == "--program":
            use_programs(next(arguments))
        elif argument == "--set":
            name, value = next(arguments).split("=")
            options[name] = value
        else:
            rest.append(argument)
    test = unittest.main(argv=[sys.argv[0], "-v", *rest], exit=False).result
    sys.exit(SKIPPED if test.wasSuccessful() and test.skipped else not test.wasSuccessful())
