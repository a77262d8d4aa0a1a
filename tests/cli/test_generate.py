"""Tests of triptych-generate. Its files hold the values that the test computes from the formulas of
the fields. Output that cannot be written leaves one line and no file."""
import os
import signal
import subprocess
import time
import unittest

import numpy

import program

try:
    import pyopenvdb
except ImportError:
    pyopenvdb = None


def positions(dims):
    """Returns x, y and z of the voxels as arrays [z, y, x]. The longest side spans -1 to 1."""
    step = 2 / (max(dims) - 1)
    axes = [(numpy.arange(n) - (n - 1) / 2) * step for n in dims]
    z, y, x = numpy.meshgrid(*axes[::-1], indexing="ij")
    return x, y, z


def marschner_lobb(dims, detail):
    x, y, z = positions(dims)
    rho = numpy.cos(2 * numpy.pi * 6 * detail * numpy.cos(numpy.pi * numpy.hypot(x, y) / 2))
    return (1 - numpy.sin(numpy.pi * z / 2) + 0.25 * (1 + rho)) / (2 * (1 + 0.25))


def shells(dims, detail):
    x, y, z = positions(dims)
    r2 = x * x + y * y + z * z
    waves = 0.5 + 0.5 * numpy.cos(8 * numpy.pi * detail * numpy.sqrt(r2))
    return numpy.where(r2 < 1, waves * (1 - r2) ** 2, 0)


def filaments(dims, detail):
    x, y, z = (4 * numpy.pi * detail * a for a in positions(dims))
    sin, cos = numpy.sin, numpy.cos
    gyroid = sin(x) * cos(y) + sin(y) * cos(z) + sin(z) * cos(x)
    schwarz = cos(x) + cos(y) + cos(z)
    return numpy.maximum(0, 1 - (gyroid**2 + schwarz**2) / 0.02) ** 2


FIELDS = {"marschner-lobb": marschner_lobb, "shells": shells, "filaments": filaments}


def generate(field, dims, path, *arguments):
    program.skip_what_is_switched_off([path])
    size = "x".join(map(str, dims))
    return subprocess.run(
        [program.GENERATE, field, "--size", size, "-o", path, *map(str, arguments)],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
    )


def read_raw(path, dims, scalar):
    return numpy.fromfile(path, scalar).reshape(dims[::-1])


def read_vdb(path, dims):
    grid = pyopenvdb.read(path, "density")
    values = numpy.zeros(dims, "f4")
    grid.copyToArray(values)
    return values.transpose(2, 1, 0), grid


class Generate(program.ProgramTest):
    def made(self, field, dims, path, *arguments):
        r = generate(field, dims, path, *arguments)
        self.assertEqual((r.returncode, r.stderr), (0, ""))

    def test_files_hold_the_values_of_the_formulas(self):
        dims = 61, 40, 53
        for field, formula in FIELDS.items():
            for detail in 1, 2.5:
                wanted = formula(dims, detail)
                for name, scalar, top in ("uint8", "u1", 255), ("uint16", "<u2", 65535):
                    self.made(field, dims, "v.raw", "--type", name, "--detail", detail)
                    codes = read_raw("v.raw", dims, scalar)
                    self.assertLess(abs(codes - wanted * top).max(), 0.5 + 1e-6, field)
                self.made(field, dims, "v.raw", "--type", "float", "--detail", detail)
                self.assertLess(abs(read_raw("v.raw", dims, "<f4") - wanted).max(), 1e-6, field)

    def test_the_header_describes_the_data(self):
        dims = 20, 10, 30
        self.made("cloud", dims, "v.raw", "--type", "uint16")
        self.made("cloud", dims, "v.nrrd", "--type", "uint16")
        with open("v.nrrd", "rb") as f:
            head, data = f.read().split(b"\n\n", 1)
        for line in b"type: uint16", b"sizes: 20 10 30", b"endian: little", b"encoding: raw":
            self.assertIn(line, head.split(b"\n"))
        with open("v.raw", "rb") as f:
            self.assertEqual(f.read(), data)

    @unittest.skipUnless(pyopenvdb, "python3-openvdb is not installed")
    def test_openvdb_reads_the_same_values(self):
        """The sides are not multiples of the cubes of 128 and the nodes of 4096 voxels."""
        for field in "shells", "cloud", "filaments":
            for dims in (60, 60, 60), (130, 70, 257), (10, 4110, 9):
                self.made(field, dims, "v.raw", "--type", "float", "--detail", 1)
                self.made(field, dims, "v.vdb", "--detail", 1)
                values, grid = read_vdb("v.vdb", dims)
                wanted = read_raw("v.raw", dims, "<f4")
                self.assertTrue((values == wanted).all(), (field, dims))
                self.assertEqual(grid.activeVoxelCount(), numpy.count_nonzero(wanted))
                self.assertEqual(grid.gridClass, "fog volume")

    def test_the_number_of_threads_does_not_change_files(self):
        for name in "a.raw", "a.vdb":
            contents = set()
            for threads in 1, 3, 8:
                self.made("cloud", (90, 80, 70), name, "--threads", threads)
                with open(name, "rb") as f:  # a VDB file begins with a random identifier
                    contents.add(f.read()[64:])
            self.assertEqual(len(contents), 1, name)

    def test_output_that_cannot_be_written_leaves_nothing(self):
        os.mkdir("folder.raw")
        for name, status in ("nowhere/v.vdb", 1), ("nowhere/v.raw", 1), ("v.xyz", 2):
            r = generate("shells", (20, 20, 20), name)
            self.assertEqual(r.returncode, status)
            self.assertRegex(r.stderr, r"\Atriptych: [^\n]+\n\Z")
            self.assertIn(name, r.stderr)
        before = set(os.listdir("."))
        for name in "i.raw", "i.nrrd", "i.vdb":
            program.skip_what_is_switched_off([name])
            process = subprocess.Popen(
                [program.GENERATE, "cloud", "--size", "1500", "-o", name],
                stderr=subprocess.PIPE,
                text=True,
            )
            program.await_handler(process)
            while process.poll() is None and program.processor_seconds(process) < 0.3:
                time.sleep(0.01)
            process.send_signal(signal.SIGINT)
            said = process.communicate()[1]
            self.assertEqual(process.returncode, 1)
            self.assertRegex(said, r"\Atriptych: [^\n]*interrupted\n\Z")
            self.assertEqual(set(os.listdir(".")), before)

    def test_a_full_disk_leaves_one_line(self):
        for name in "v.raw", "v.vdb":
            program.skip_what_is_switched_off([name])
            script = (
                'mkdir -p disk && mount -t tmpfs -o size=1m none disk && "$0" shells '
                f"--size 128 --type float -o disk/{name}; echo status $? && ls -A disk"
            )
            r = subprocess.run(
                ["unshare", "--mount", "--map-root-user", "sh", "-c", script, program.GENERATE],
                capture_output=True,
                text=True,
            )
            if "disk/" not in r.stderr:
                self.skipTest(f"a small disk cannot be mounted here: {r.stderr.strip()}")
            self.assertEqual(r.stdout, "status 1\n")
            self.assertRegex(r.stderr, r"\Atriptych: [^\n]*No space left on device[^\n]*\n\Z")


if __name__ == "__main__":
    program.main()
