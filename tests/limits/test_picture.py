"""Tests that the picture is the same, bit for bit, for any memory, engine, tile size, number of
threads and cache. The C test test_same_picture.c tries many more combinations without a process for
each."""
import json
import os
import random

import limits

TILES = [16, 32, 64, 128]


class Picture(limits.Test):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.random = random.Random(1)

    def combinations(self, renderer, count):
        """Yields each option alone, then random combinations."""
        memory = ["64M", "100M", "1G", "100G"]
        engines = ["io_uring", "pread", "null"]
        threads = [1, 2, 3, 8]
        yield from (["--memory", m] for m in memory)
        yield from (["--engine", e] for e in engines)
        yield from (["--threads", n] for n in threads)
        occluded = ["skip", "draw"] if renderer == "cpu" else []
        yield from (["--occluded", h] for h in occluded)
        for _ in range(count):
            choice = ["--memory", self.random.choice(memory), "--engine",
                      self.random.choice(engines), "--threads", self.random.choice(threads)]
            yield choice + (["--occluded", self.random.choice(occluded)] if occluded else [])

    def check(self, sets, renderer, view, count):
        size = "90x70"
        wanted = self.draw(sets[0], *view, renderer=renderer, size=size)
        for data in sets[1:]:
            self.assertEqual(self.draw(data, *view, renderer=renderer, size=size), wanted, data)
        for arguments in self.combinations(renderer, count):
            data = self.random.choice(sets)
            if self.random.random() < 0.5:
                limits.forget_pages(data)
            self.assertEqual(self.draw(data, *view, *arguments, renderer=renderer, size=size),
                             wanted, f"{renderer} {data} {view} {arguments}")

    def check_volume(self, volume, name, view, *brick):
        sets = [self.brick(volume, f"{name}{n}.trip", "--tile", n, *brick) for n in TILES]
        slabs = self.brick(volume, f"{name}-slabs.trip", "--slab-sheets", 3, *brick)
        for renderer, count in ("cpu", limits.rounds(4)), ("reference", limits.rounds(1)):
            self.check(sets + [slabs], renderer, view, count)

    def test_a_scan_gives_the_same_picture(self):
        self.check_volume(os.path.join(limits.DATASETS, "tooth.nhdr"), "tooth", [])

    def test_an_eye_inside_the_volume_gives_the_same_picture(self):
        view = ["--h", "0.3", "--fov", "75", "--eye", "60,50,55", "--look", "30,40,50"]
        volume = self.generate("shells.nrrd", "shells", "80x70x90", "--type", "uint16")
        self.check_volume(volume, "shells", view, "--tf", "preset:bone", "--keep-all")

    def test_later_frames_from_a_cache_are_the_same(self):
        data = self.brick(self.generate("cloud.nrrd", "cloud", "80"), "cloud.trip")
        wanted = None
        for engine in "io_uring", "pread", "null":
            for memory in "64M", "4G":
                self.works("triptych", "render", data, "-o", self.path("o.exr"), "--orbit", 5,
                           "--size", "100x80", "--renderer", "cpu", "--engine", engine, "--memory",
                           memory)
                hashes = [limits.picture_hash(self.path(f"o-{i:03}.exr")) for i in range(5)]
                wanted = wanted or hashes
                self.assertEqual(hashes, wanted, f"{engine} {memory}")

    def test_reads_into_gl_memory_and_copies_give_the_same_picture(self):
        limits.need_gl()
        data = self.brick(os.path.join(limits.DATASETS, "tooth.nhdr"), "gl.trip")
        picture = self.path("gl.exr")
        arguments = ["triptych", "render", data, "-o", picture, "--size", "48x48", "--renderer",
                     "gl", "--memory", "128M"]
        rings, hashes = [], []
        for slots in "mapped", "copy":
            env = {**os.environ, "TRIPTYCH_GL_SLOTS": slots}
            stats = json.loads(self.works(*arguments, "--stats", "-", env=env).out)
            rings.append(stats["ring"].split(":")[0])
            hashes.append(limits.picture_hash(picture))
            explained = self.works(*arguments, "--explain", env=env).out
            self.assertIn(f"ring        {rings[-1]}: ", explained)
        self.note(f"reads into GL memory: {rings[0]}")
        self.assertIn(rings[0], ["mapped", "copied"])
        self.assertEqual(rings[1], "copied")
        self.assertEqual(hashes[0], hashes[1])
        stats = json.loads(self.works(*arguments, "--stats", "-", "--submit", "indexed").out)
        self.assertEqual(stats["ring"].split(":")[0], "not used")
        self.assertEqual(sum(x["bytes_read"] for x in stats["frames"][0]["lists"].values()), 0)
        self.fails(*arguments, env={**os.environ, "TRIPTYCH_GL_SLOTS": "some"},
                   says=["TRIPTYCH_GL_SLOTS", "use mapped or copy"])

    def test_refused_io_uring_falls_back_to_pread(self):
        data = self.brick(os.path.join(limits.DATASETS, "tooth.nhdr"), "refused.trip")
        refused = {"preexec_fn": limits.refuse_io_uring}
        try:
            limits.run("triptych", "--version", **refused)
        except Exception as e:  # an error in preexec_fn
            self.skipTest(f"system call filters are not allowed here: {e}")
        self.assertEqual(self.draw(data, **refused), self.draw(data))
        r = self.works("triptych", "render", data, "-o", self.path("p.exr"), "--size", "32x32",
                       "--stats", "-", **refused)
        self.assertIn('"engine":\t"pread', r.out)
        self.fails("triptych", "render", data, "-o", self.path("q.exr"), "--engine", "io_uring",
                   says=["io_uring", "another engine"], **refused)
        self.assertFalse(os.path.exists(self.path("q.exr")))


if __name__ == "__main__":
    limits.main()
