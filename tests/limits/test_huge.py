"""Tests a terabyte of voxels in a sparse file. It is read within the memory limit, and refused if
the disk cannot hold the result. Also tests slices that take most of the memory."""
import json
import os
import shutil

import limits

MIB = 2**20
SLACK = 64 * MIB  # the program itself, with code, stacks and libraries


class Huge(limits.Test):
    def holes(self, name, size):
        path = self.path(name)
        with open(path, "wb") as f:
            try:
                f.truncate(size)
            except OSError as e:
                self.skipTest(f"no file of that size can be made here: {e}")
        return path

    def assertPromise(self, r, memory):
        if not limits.option("sanitizer", ""):
            self.assertLess(r.peak_bytes, memory + SLACK)

    def test_a_terabyte_is_estimated_in_little_memory(self):
        voxels, memory = 2**40, 256 * MIB
        arguments = ["brick", self.holes("v.raw", voxels), "--size", "4096,4096,65536", "--type",
                     "uint8", "-o", self.path("d.trip"), "--memory", memory]
        for envelope in ["--keep-all"], ["--range", "0:0"]:
            r = self.works("triptych", *arguments, *envelope, "--dry-run", "--json")
            self.assertPromise(r, memory)
            e = json.loads(r.out)
            self.assertEqual((e["voxels"], e["kept"]), (voxels, voxels))
            # Each of three lists has a code of 1 byte per voxel, and a bit in the mask of a full
            # square. Coarse levels have a seventh of the voxels, and a deviation of 1 byte for each.
            fine, coarse = 3 * (1 + 1 / 8), 3 * (1 + 1 / 8 + 1) / 7
            self.assertGreaterEqual(e["bytes"], (fine + coarse) * voxels)
            self.assertLess(e["bytes"], 1.12 * (fine + coarse) * voxels)
            self.assertGreater(e["temporary_bytes"], e["bytes"] / 2)
            self.assertGreater(e["seconds"], 0)
            if shutil.disk_usage(self.folder).free > e["bytes"]:
                self.skipTest("this disk can hold the result")
            self.assertPromise(self.fails("triptych", *arguments, *envelope,
                                          says=["d.trip", "needs", "disk"]), memory)
            self.assertEqual(os.listdir(self.folder), ["v.raw"])
        r = self.works("triptych", *arguments, "--range", "1:255", "--dry-run", "--json")
        self.assertEqual(json.loads(r.out)["kept"], 0)

    def test_the_memory_named_in_the_error_holds_large_slices(self):
        """The memory named in the error line also suffices for a first pass that finds the range of
        values."""
        volume = self.holes("large.raw", 1024 * 1024 * 6 * 4)
        data = self.path("l.trip")
        arguments = ["brick", volume, "--size", "1024,1024,6", "--type", "float", "-o", data,
                     "--threads", 2]
        for envelope in [], ["--keep-all"], ["--range", "0:0"]:
            r = self.fails("triptych", *arguments, *envelope, "--memory", "20M", says="--memory")
            enough = int(r.err.split("--memory ")[1].split("M")[0])
            self.note(f"slices of 4 MiB need {enough} MiB")
            self.works("triptych", *arguments, *envelope, "--memory", f"{enough}M", "--dry-run")
            r = self.works("triptych", *arguments, *envelope, "--memory", f"{enough}M",
                           warns="only the outline is visible")
            self.assertPromise(r, enough * MIB)
            shutil.rmtree(data)
        os.remove(volume)


if __name__ == "__main__":
    limits.main()
