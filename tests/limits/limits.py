"""Support for the tests in this folder. They run the programs as a user does, and check the files
that the programs leave. It uses Python's standard library only.

    test_x.py --program PATH... [--set NAME=VALUE]... [arguments of unittest]
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

FAILED = {1, 2}  # exit statuses of failures and of wrong usage
SKIPPED = 77  # CTest's exit status for skipped tests
HANGS_SECONDS = 300
DATASETS = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "datasets")

_paths = {}
options = {}  # options of the command line, by name


def program(name):
    """Returns the path of a program. `quick` is triptych with a stand-in for triptych-images
    (tests/quick), for tests that need only pixels."""
    return options["quick"] if name == "quick" else _paths[name]


def use_programs(*paths):
    for path in paths:
        _paths[os.path.basename(path)] = os.path.abspath(path)


class Outcome:
    def __init__(self, status, out, err, peak_bytes, seconds):
        self.status, self.out, self.err = status, out, err
        self.peak_bytes = peak_bytes  # maximum resident size, from the kernel
        self.seconds = seconds


def run(name, *arguments, **popen):
    """Runs a program to its end. Skips the test if an argument needs OpenVDB and the build lacks
    it."""
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


def need_gl():
    """Skips a test if gl is switched off, or no driver offers OpenGL 4.5. A program of tests/quick
    tells which drivers there are."""
    if "GL" in options.get("switched_off", "").split():
        raise unittest.SkipTest("built without OpenGL")
    driver = os.path.join(os.path.dirname(options["quick"]), "opengl")
    if subprocess.run([driver], stdout=subprocess.DEVNULL).returncode:
        raise unittest.SkipTest("this machine lacks OpenGL 4.5 by EGL")


def read_bytes(path):
    with open(path, "rb") as f:
        return f.read()


def picture_hash(path):
    """Returns the hash of a file without the date that the format's library writes."""
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
    """Works in a folder of its own below the current one, because /tmp may be in memory."""

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
        """Checks that the program succeeds silently, or with one line of warning that contains
        `warns`."""
        r = run(name, *arguments, **popen)
        self.assertEqual((r.status, r.err.count("\n")), (0, 1 if warns else 0),
                         f"{name} {arguments}: {r.err}")
        self.assertIn(warns, r.err)
        return r

    def fails(self, name, *arguments, says="", **popen):
        """Checks that the program fails with one error line that contains every text of `says`."""
        r = run(name, *arguments, **popen)
        self.assertRefused(r, says)
        return r

    def assertRefused(self, r, says=""):
        self.assertIn(r.status, FAILED, r.err)
        self.assertRegex(r.err, r"\Atriptych: [^\n]+\n\Z")
        for text in [says] if isinstance(says, str) else says:
            self.assertIn(text, r.err)

    def draw(self, data, *arguments, renderer="cpu", size="160x120", **popen):
        """Draws a picture. Returns its hash."""
        path = self.path("picture.exr")
        if os.path.exists(path):
            os.remove(path)
        self.works("quick", "render", data, "-o", path, "--size", size, "--renderer", renderer,
                   *arguments, **popen)
        return picture_hash(path)

    def stats(self, data, *arguments, renderer="cpu", size="160x120"):
        """Returns the --stats of a frame, and the hash of its picture."""
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
    """Drops the files of a data set from the page cache."""
    for name in os.listdir(folder):
        f = os.open(os.path.join(folder, name), os.O_RDONLY)
        os.fsync(f)
        os.posix_fadvise(f, 0, 0, os.POSIX_FADV_DONTNEED)
        os.close(f)


def refuse_io_uring():
    """Makes the kernel refuse to set up rings, like the filters of containers. For preexec_fn."""

    class Program(ctypes.Structure):
        _fields_ = [("length", ctypes.c_ushort), ("code", ctypes.c_void_p)]

    def instruction(code, jt, jf, k):
        return code.to_bytes(2, sys.byteorder) + bytes([jt, jf]) + k.to_bytes(4, sys.byteorder)

    io_uring_setup, eperm = 425, 1
    code = (instruction(0x20, 0, 0, 0) +  # load the number of the system call
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
    """Returns how often to try something random. TRIP_LIMITS_ROUNDS multiplies the number, for long
    runs."""
    return count * int(os.environ.get("TRIP_LIMITS_ROUNDS", 1))


def option(name, default):
    """Returns the value of --set, converted to the type of the default."""
    return type(default)(options.get(name, default))


def main():
    """Runs the module's tests. Exits with 77 if a test was skipped and none failed."""
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
