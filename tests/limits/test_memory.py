"""In a memory cgroup much smaller than the volume, page cache included, brick and render finish, and
what they hold stays under the promise and 64 MiB.

By hand: test_memory.py ... --set limit=512 --set memory=256 --set volume=8192 --set keep=FOLDER
         --set patience=3600
"""
import json
import os
import unittest

import limits

MIB = 2**20
SLACK = 64 * MIB  # the program itself: code, stacks, libraries


class Group:
    """A memory cgroup below this process's own, version 1 or 2."""

    def __init__(self, limit_bytes):
        self.limit_bytes = limit_bytes
        parent, names = own_group()
        self.folder = os.path.join(parent, f"triptych-{os.getpid()}")
        self.names = names
        os.mkdir(self.folder)
        try:
            self.write(names["limit"], limit_bytes)
        except OSError:
            self.remove()
            raise
        try:
            self.write(names["swap"], names["swap_bytes"](limit_bytes))
        except OSError:
            pass  # no swap is accounted here

    def write(self, name, value):
        with open(os.path.join(self.folder, name), "w") as f:
            f.write(str(value))

    def read(self, name):
        with open(os.path.join(self.folder, name)) as f:
            return int(f.read())

    def enter(self):
        """For preexec_fn."""
        self.write("cgroup.procs", os.getpid())

    def peak_bytes(self):
        """With the page cache, of all that ran in it."""
        return self.read(self.names["peak"])

    def remove(self):
        os.rmdir(self.folder)


def own_group():
    """The folder of this process's memory cgroup and what its files are called."""
    v1 = {"limit": "memory.limit_in_bytes", "peak": "memory.max_usage_in_bytes",
          "swap": "memory.memsw.limit_in_bytes", "swap_bytes": lambda n: n}
    v2 = {"limit": "memory.max", "peak": "memory.peak", "swap": "memory.swap.max",
          "swap_bytes": lambda n: 0}
    with open("/proc/self/cgroup") as f:
        lines = dict(line.strip().split(":", 2)[1:] for line in f)
    for controllers, group in lines.items():
        if "memory" in controllers.split(","):
            return "/sys/fs/cgroup/memory" + mounted_part("/sys/fs/cgroup/memory", group), v1
    return "/sys/fs/cgroup" + mounted_part("/sys/fs/cgroup", lines.get("", "/")), v2


def mounted_part(mount, group):
    """In a container the mount may show the group itself as its root."""
    return group if os.path.isdir(mount + group) else ""


class Memory(limits.Test):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        if limits.option("sanitizer", ""):
            raise unittest.SkipTest("a sanitizer's own memory would be counted")
        cls.limit = limits.option("limit", 96) * MIB
        cls.memory = limits.option("memory", 48) * MIB
        cls.volume_bytes = limits.option("volume", 768) * MIB
        try:
            cls.group = Group(cls.limit)
        except OSError as e:
            raise unittest.SkipTest(f"no memory cgroup can be made here: {e}")

    @classmethod
    def tearDownClass(cls):
        cls.group.remove()
        super().tearDownClass()

    def make_volume(self):
        """Of floats; the value below which nine tenths of it lie."""
        n = 2
        while n**3 * 4 < self.volume_bytes:
            n += 1
        keep = limits.option("keep", "")
        path = os.path.join(keep, f"{n}.nrrd") if keep else self.path("v.nrrd")
        if not os.path.exists(path):
            self.works("triptych-generate", "shells", "--size", n, "--type", "float", "-o", path)
        return path

    def judge(self, what, r):
        self.assertEqual((r.status, r.err), (0, ""), what)
        promise = self.memory + SLACK
        self.tell(f"{what}: {r.seconds:.1f} s, at most {limits.text_bytes(r.peak_bytes)} resident; "
                  f"promised {limits.text_bytes(self.memory)} + {limits.text_bytes(SLACK)}; group "
                  f"with page cache {limits.text_bytes(self.group.peak_bytes())} of "
                  f"{limits.text_bytes(self.limit)}")
        self.assertLessEqual(r.peak_bytes, promise, what)

    def test_a_volume_of_eight_times_the_limit_and_more(self):
        volume = self.make_volume()
        size = os.path.getsize(volume)
        self.assertGreaterEqual(size, 8 * self.limit)
        data = self.path("d.trip")
        r = limits.run("triptych", "brick", volume, "-o", data, "--json", "--memory", self.memory,
                       "--range", limits.option("range", "0.18:"), preexec_fn=self.group.enter)
        self.judge("brick", r)
        made = json.loads(r.out)
        self.tell(f"volume of {limits.text_bytes(size)}, kept {made['kept'] / made['voxels']:.3f}, "
                  f"data set of {limits.text_bytes(limits.folder_bytes(data))}")
        self.assertGreaterEqual(made["kept"], 0.1 * made["voxels"])
        for renderer in "cpu", "reference":
            for arguments in [], ["--orbit", 3]:
                if renderer == "reference" and arguments:
                    continue
                limits.forget_pages(data)
                r = limits.run("triptych", "render", data, "-o", self.path("p.exr"), "--renderer",
                               renderer, "--size", limits.option("pixels", "256x256"), "--memory",
                               self.memory, *arguments, preexec_fn=self.group.enter)
                self.judge(f"render {renderer} {' '.join(map(str, arguments))}", r)

    def test_the_default_is_a_quarter_of_the_limit(self):
        path = self.path("small.trip")
        volume = self.generate("small.nrrd", "cloud", 32)
        r = limits.run("triptych", "brick", volume, "-o", path, "--json", "--threads", 1,
                       preexec_fn=self.group.enter)
        if r.status == 0:
            self.assertEqual(json.loads(r.out)["memory_bytes"], self.limit // 4)
        else:
            self.assertRefused(r, "--memory")


if __name__ == "__main__":
    limits.main()
