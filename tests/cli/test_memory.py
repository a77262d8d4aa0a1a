"""Tests that --memory is a limit. Bricking a larger raw volume, and drawing the data set, stay
within this limit plus the program's own size."""
import glob
import os
import unittest

import numpy

import program

MIB = 1 << 20
PROGRAM_BYTES = 56 * MIB  # the program, its libraries, and the stacks of its threads


def peak_rss(*arguments):
    """Runs the program, which must succeed. Returns its maximum resident size in bytes."""
    process = program.start(*arguments)
    err = process.stderr.read().decode()
    process.stdout.read()
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    process.stdout.close()
    process.stderr.close()
    assert process.returncode == 0, err
    return usage.ru_maxrss * 1024


@unittest.skipIf(program.SANITIZED, "sanitizers take memory of their own")
class Memory(program.ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        slice_ = numpy.random.default_rng(1).integers(0, 256, (512, 512), "u1")
        slice_[slice_ < 246] = 0
        with open("large.raw", "wb") as f:
            for z in range(512):
                f.write(numpy.roll(slice_, (z, 7 * z), (0, 1)).tobytes())
        cls.raw = ("brick", "large.raw", "--size", "512,512,512", "-q", "--force")

    def test_a_volume_of_128_mib_is_bricked_and_drawn_in_64_mib(self):
        self.assertEqual(os.path.getsize("large.raw"), 128 * MIB)
        for envelope in [], ["--range=250:255", "--normals=none"]:
            rss = peak_rss(*self.raw, "-o", "a.trip", "--memory", "64M", *envelope)
            self.assertLess(rss, 64 * MIB + PROGRAM_BYTES, envelope)
        for output in "a.png", "a.exr":
            rss = peak_rss("render", "a.trip", "-o", output, "--memory", "64M", "--size", "300x300")
            self.assertLess(rss, 64 * MIB + PROGRAM_BYTES)

    @unittest.skipIf(glob.glob("/dev/dri/*") or os.path.exists("/dev/nvidiactl"), "draws by OpenGL")
    def test_choosing_a_renderer_without_a_gpu_takes_no_memory(self):
        program.write_nrrd("small.nrrd", program.noise((30, 40, 50)))
        self.works("brick", "small.nrrd", "-o", "drawn.trip", "-q")
        draw = ["render", "drawn.trip", "-o", "a.png", "--memory=32M", "--size=300x300"]
        self.assertLess(peak_rss(*draw), 32 * MIB + PROGRAM_BYTES)

    def test_a_small_volume_takes_little_memory(self):
        program.write_nrrd("small.nrrd", program.noise((30, 40, 50)))
        self.assertLess(peak_rss("brick", "small.nrrd", "-o", "small.trip", "-q"), 120 * MIB)


if __name__ == "__main__":
    program.main()
