"""Tests brick, render and the viewer's drawing in a memory cgroup much smaller than the volume,
page cache included. They finish, and their resident memory stays below --memory plus 64 MiB.
large.py does this at full size."""
import json
import os
import unittest

import limits
from bounded import Bounded
from memory_group import Group

MIB = 2**20


class Memory(limits.Test):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        if limits.option("sanitizer", ""):
            raise unittest.SkipTest("a sanitizer's own memory would be counted")
        cls.limit = limits.option("limit", 96) * MIB
        cls.memory = limits.option("memory", 48) * MIB
        try:
            Group(cls.limit).remove()
        except OSError as e:
            raise unittest.SkipTest(f"no memory cgroup can be made here: {e}")

    def test_a_volume_of_four_times_the_limit_works(self):
        bounded = Bounded(self.folder, self.limit, self.memory, self.note)
        volume = bounded.generate(4 * self.limit)
        self.assertGreaterEqual(os.path.getsize(volume), 4 * self.limit)
        bounded.brick(volume)
        bounded.render("cpu", "256x256")
        bounded.render("cpu", "256x256", "--orbit", 3)
        # `post` of this renderer holds the whole volume
        bounded.render("reference", "256x256", "--classify", "pre")
        bounded.flight("--seconds", 2, "--size", "256x256")

    def test_the_default_memory_is_a_quarter_of_the_limit(self):
        data = self.path("small.trip")
        volume = self.generate("small.nrrd", "cloud", 64)
        limit = 400 * MIB
        with Group(limit) as group:
            made = self.works("triptych", "brick", volume, "-o", data, "--json", "--threads", 1,
                              preexec_fn=group.enter)
            drawn = self.works("triptych", "render", data, "-o", self.path("p.png"), "--stats", "-",
                               preexec_fn=group.enter)
        self.assertEqual(json.loads(made.out)["memory_bytes"], limit // 4)
        self.assertEqual(json.loads(drawn.out)["memory_limit_bytes"], limit // 4)

    def test_generating_a_long_volume_takes_little_memory(self):
        """The volume has 94 MiB of floats. The generator holds whole slices, or one cube of a
        VDB."""
        for name, limit in ("v.raw", 48 * MIB), ("v.vdb", 72 * MIB):
            r = self.works("triptych-generate", "marschner-lobb", "--size", "64x64x6000", "--type",
                           "float", "-o", self.path(name))
            self.assertGreater(os.path.getsize(self.path(name)), 48 * MIB)  # the VDB is compressed
            self.note(f"{name}: at most {limits.text_bytes(r.peak_bytes)} resident")
            self.assertLess(r.peak_bytes, limit)
            os.remove(self.path(name))


if __name__ == "__main__":
    limits.main()
