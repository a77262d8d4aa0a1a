"""Tests that a frame does not read data that it does not need, and counts it. The picture is the
same, bit for bit."""
import json
import re

import limits


def bytes_read(stats):
    return sum(axis["bytes_read"] for axis in stats["frames"][0]["lists"].values())


class Hidden(limits.Test):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.tf = cls.path("solid.tf")
        with open(cls.tf, "w") as f:
            f.write("# value r g b opacity\n0 0.3 0.5 0.9 0.9\n255 1 0.8 0.4 0.999\n")

    def test_at_least_half_of_an_opaque_scene_is_not_read(self):
        n = limits.option("size", 192)
        volume = self.generate("dense.nrrd", "marschner-lobb", n)
        data = self.brick(volume, "dense.trip", "--keep-all", "--tf", self.tf)
        view = ["--tf", self.tf]
        if n <= 256:  # a close view, because edges and the ring are most of the reads of a small volume
            view += ["--fov", 60, "--look", f"{n / 2},{n / 2},{n / 2}", "--eye",
                     f"{n / 2},{-n / 3},{n / 2}"]
        lit = self.brick(volume, "lit.trip", "--keep-all", "--tf", self.tf, "--normals", "stored")
        # `post` draws several sheets at once, so that it has read more before pixels are opaque.
        # Computed normals also read the bricks beside the visible ones.
        for classify, data, most in ("pre", lit, 0.5), ("pre", data, 0.7), ("post", data, 0.65):
            look = [*view, "--classify", classify]
            drawn, wanted = self.stats(data, *look, "--occluded", "draw", size="512x512")
            skipped, picture = self.stats(data, *look, "--occluded", "skip", size="512x512")
            self.assertEqual(picture, wanted)
            share = bytes_read(skipped) / bytes_read(drawn)
            self.note(f"{classify}: {limits.text_bytes(bytes_read(drawn))} without, "
                      f"{limits.text_bytes(bytes_read(skipped))} with skipping: {100 * share:.0f} %")
            self.assertLessEqual(share, most)
            self.assertGreater(skipped["frames"][0]["bytes_skipped"], 0)
            self.assertGreater(skipped["frames"][0]["runs_skipped"], 0)
            self.assertEqual(drawn["frames"][0]["bytes_skipped"], 0)
        r = self.works("triptych", "render", data, "-o", self.path("p.png"), "--size", "512x512",
                       "--explain", "--occluded", "skip", *look)
        self.assertRegex(r.out, r"occluded +[\d.]+ [kMG]?B in \d+ runs not read")

    def test_a_higher_early_termination_reads_less(self):
        volume = self.generate("haze.nrrd", "marschner-lobb", 192)
        haze = self.path("haze.tf")
        with open(haze, "w") as f:
            f.write("0 0.3 0.5 0.9 0.05\n255 1 0.8 0.4 0.15\n")
        data = self.brick(volume, "haze.trip", "--keep-all", "--tf", haze)
        for classify in "pre", "post":
            read = []
            for saturation in "0", None, "0.03125", "0.1":
                look = ["--tf", haze, "--classify", classify, "--fov", 60, "--look", "96,96,96",
                        "--eye", "96,-64,96"]
                look += ["--early-termination", saturation] if saturation else []
                wanted = self.stats(data, *look, "--occluded", "draw", size="256x256")[1]
                runs = [self.stats(data, *look, "--occluded", "skip", size="256x256") for _ in range(3)]
                self.assertEqual([picture for _, picture in runs], 3 * [wanted])
                # A reader that is far ahead of the renderer skips less.
                stats = min((stats for stats, _ in runs), key=bytes_read)
                picture = self.stats(data, *look, "--occluded", "skip", "--threads", 1, "--memory",
                                     "48M", size="256x256")[1]
                self.assertEqual(picture, wanted)
                read.append(bytes_read(stats))
                usual = 1 / 8192 if classify == "pre" else 1 / 512
                self.assertEqual(stats["early_termination"], float(saturation or usual))
            self.note(f"{classify}: {', '.join(map(limits.text_bytes, read))} with 0, the default, "
                      "1/32, 0.1")
            self.assertEqual(read[0], max(read))
            self.assertLess(read[3], 0.8 * read[0])

    def explained(self, data, *arguments):
        r = self.works("triptych", "render", data, "-o", self.path("p.png"), "--size", "160x120",
                       "--explain", "--occluded", "draw", *arguments)
        left_out = [0, 0, 0]
        for found in re.finditer(r"left out: (\d+) transparent, (\d+) out of view, (\d+) without",
                                 r.out):
            left_out = [a + int(b) for a, b in zip(left_out, found.groups())]
        return r.out, left_out

    def test_transparent_bricks_and_bricks_out_of_view_are_not_read(self):
        volume = self.generate("cloud.nrrd", "cloud", 96)
        data = self.brick(volume, "cloud.trip", "--keep-all", "--tile", 16, "--tf", self.tf)
        faint = self.path("faint.tf")
        with open(faint, "w") as f:
            f.write("0 0 0 0 0\n130 0 0 0 0\n131 1 1 1 0.5\n255 1 1 1 0.5\n")
        everything = bytes_read(self.stats(data, "--tf", self.tf, "--h", "0.99", "--occluded",
                                           "draw")[0])
        for arguments, which in [(["--tf", faint, "--h", "0.99"], 0),
                                 (["--tf", self.tf, "--h", "0.99", "--fov", "60",
                                   "--eye", "48,60,48", "--look", "48,96,48"], 1)]:
            left_out = self.explained(data, *arguments)[1]
            self.assertGreater(left_out[which], 0)
            stats = self.stats(data, *arguments, "--occluded", "draw")[0]
            self.assertLess(bytes_read(stats), everything)
            counted = stats["frames"][0]["lists"].values()
            name = ["bricks_transparent", "bricks_outside"][which]
            self.assertEqual(sum(axis[name] for axis in counted), left_out[which])

    def test_normals_are_read_only_for_shading(self):
        volume = self.generate("lobes.nrrd", "marschner-lobb", 64)
        data = self.brick(volume, "lobes.trip", "--keep-all", "--normals", "stored")
        pre = "--classify", "pre"
        shaded = self.stats(data, "--occluded", "draw", *pre)[0]
        plain = self.stats(data, "--no-shading", "--occluded", "draw", *pre)[0]
        splats = sum(axis["splats_read"] for axis in plain["frames"][0]["lists"].values())
        normals = json.loads(self.works("triptych", "info", data, "--json").out)["normal_bytes"] * splats
        # The reader reads whole pages, some of them twice at the ends of slots.
        self.assertGreaterEqual(bytes_read(shaded) - bytes_read(plain), normals)
        self.assertLess(bytes_read(shaded) - bytes_read(plain), 1.25 * normals)
        self.assertEqual(shaded["frames"][0]["bytes_of_planes_left_out"], 0)
        self.assertEqual(plain["frames"][0]["bytes_of_planes_left_out"], normals)
        self.assertIn("normal planes are read", self.explained(data, *pre)[0])
        said = re.search(r"normal planes are not read, ([\d.]+) MB",
                         self.explained(data, "--no-shading", *pre)[0])
        self.assertAlmostEqual(float(said[1]), 1e-6 * normals, delta=0.01)
        # `post` computes gradients from values, so that it reads the same data with and without
        # shading.
        of_as_much = "--h", "0.85", "--occluded", "draw"
        lit, flat = (self.stats(data, *of_as_much, *more)[0]["frames"][0]
                     for more in ((), ("--no-shading",)))
        self.assertEqual(lit["lists"], flat["lists"])
        self.assertGreaterEqual(lit["bytes_of_planes_left_out"], normals)

    def test_cached_bricks_are_not_read_again_in_a_sequence(self):
        data = self.brick(self.generate("turned.nrrd", "marschner-lobb", 144), "turned.trip",
                          "--keep-all", "--normals", "stored")
        of_post = "--samples-per-sheet", 2, "--samples", 1, "--lod", 0
        for classify, numbers in ("pre", ()), ("post", of_post):
            frames = {}
            for memory in "24M", "1G":
                r = self.works("triptych", "render", data, "-o", self.path("t.exr"), "--orbit", 4,
                               "--size", "100x80", "--renderer", "cpu", "--occluded", "draw",
                               "--classify", classify, *numbers, "--memory", memory, "--stats", "-")
                frames[memory] = json.loads(r.out)["frames"]
            read = {memory: [sum(axis["bytes_read"] for axis in frame["lists"].values())
                             for frame in drawn] for memory, drawn in frames.items()}
            self.note(f"{classify}: bytes read by each frame: {read}")
            # Smaller slots read more pages twice.
            self.assertAlmostEqual(read["1G"][0], read["24M"][0], delta=0.01 * read["24M"][0])
            if classify == "pre":  # without normals, all bricks fit into either memory
                self.assertLess(sum(read["1G"]), 0.7 * sum(read["24M"]))
            # later frames look from behind and use the lists of the first two
            self.assertEqual(read["1G"][2:], [0, 0])
            for frame in frames["1G"][2:]:
                self.assertGreater(frame["bytes_cached"], 0)


if __name__ == "__main__":
    limits.main()
