"""Tests of output that other scripts read: the keys of `info --json` and `render --stats`. Also
tests how many splats each method draws, on which the tables of the papers rely."""
import os
import random

import numpy

import program

INFO_KEYS = {
    "format_version",
    "dims",
    "spacing",
    "index_to_world",
    "value_min",
    "value_max",
    "voxels",
    "kept",
    "bytes",
}
STATS_KEYS = {"renderer", "device", "method", "size", "peak_rss_bytes", "frames"}
FRAME_KEYS = {"ms", "read_ms", "draw_ms", "merge_ms", "lists"}
LIST_KEYS = {"splats_read", "bytes_read"}
COUNTED_KEYS = {"splats_read", "splats_projected", "splats_drawn"}


class Drawn(program.ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.kept = {}
        sources = {
            "tooth": ["tooth.nhdr", "--range=900:1300"],
            "heat": ["densityAndHeat.vdb", "--grid", "heat"],
        }
        for name, (source, *options) in sources.items():
            path = os.path.join(program.DATASETS, source)
            cls.kept[name] = cls.brick(cls(), path, f"{name}.trip", *options)["kept"]
        values = program.noise((9, 40, 70))
        program.write_nifti(
            "sheared.nii",
            values,
            numpy.array([[0, 0.5, 0.2, 3], [-2, 0.3, 0, 5], [0, 0, 4, -7], [0, 0, 0, 1]]),
        )
        cls.kept["sheared"] = cls.brick(cls(), "sheared.nii", "sheared.trip")["kept"]

    def middle(self, name):
        """Returns the centre of the grid in world space, half its diagonal, and index_to_world."""
        info = self.info(f"{name}.trip")
        matrix = numpy.array(info["index_to_world"])
        dims = numpy.array(info["dims"])
        corners = [
            matrix[:, :3] @ ((dims - 1) * [a, b, c]) + matrix[:, 3]
            for a in (0, 1)
            for b in (0, 1)
            for c in (0, 1)
        ]
        centre = numpy.mean(corners, axis=0)
        return centre, max(numpy.linalg.norm(c - centre) for c in corners), matrix

    def view_from(self, name, direction, *options):
        """Returns the options of a perspective view that contains the whole grid."""
        centre, radius, _ = self.middle(name)
        eye = centre + numpy.array(direction) / numpy.linalg.norm(direction) * radius * 4.5
        return [
            f"{name}.trip",
            "--eye",
            ",".join(map(str, eye)),
            "--look",
            ",".join(map(str, centre)),
            "--fov",
            "30",
            "--size",
            "150x150",
            "--up",
            "0.31,0.2,0.9",
        ] + list(options)

    def drawn(self, *arguments):
        return program.splats_drawn(self.stats(*arguments, "--count"))

    def test_info_has_the_fixed_keys(self):
        for name in self.kept:
            info = self.info(f"{name}.trip")
            self.assertLessEqual(INFO_KEYS, info.keys())
            self.assertEqual(info["format_version"], 7)
            self.assertEqual([len(info["dims"]), len(info["spacing"])], [3, 3])
            self.assertEqual(numpy.array(info["index_to_world"]).shape, (3, 4))
            files = (os.path.join(f"{name}.trip", f) for f in os.listdir(f"{name}.trip"))
            self.assertEqual(info["bytes"], sum(map(os.path.getsize, files)))

    def test_stats_have_the_fixed_keys(self):
        for renderer in "reference", "cpu", "auto":
            for method in "merge", "clip", "axis":
                stats = self.stats(
                    "heat.trip", "--renderer", renderer, "--method", method, "--size", "50x40",
                    "--count",
                )
                self.assertLessEqual(STATS_KEYS, stats.keys())
                self.assertEqual(stats["size"], [50, 40])
                self.assertEqual(stats["method"], method)
                self.assertGreater(stats["peak_rss_bytes"], 1 << 20)
                for frame in stats["frames"]:
                    self.assertLessEqual(FRAME_KEYS, frame.keys())
                    self.assertEqual(set(frame["lists"]), {"x", "y", "z"})
                    for counts in frame["lists"].values():
                        self.assertLessEqual(LIST_KEYS, counts.keys())
                        self.assertEqual(counts["bytes_read"] > 0, counts["splats_read"] > 0)
                    self.assertEqual(set(frame["counted"]), {"x", "y", "z"})
                    for counts in frame["counted"].values():
                        self.assertEqual(COUNTED_KEYS, counts.keys())
                        self.assertLessEqual(counts["splats_drawn"], counts["splats_projected"])
                        self.assertLessEqual(counts["splats_projected"], counts["splats_read"])

    def test_only_interpolation_reads_the_halo(self):
        seen, renderers = [], ("cpu", "reference", *program.GL)
        for halo in "0", "1":
            made = self.brick(os.path.join(program.DATASETS, "tooth.nhdr"), "h.trip", "--force",
                              "--halo", halo, "--levels-for", "pre")
            self.assertEqual(made["halo"] > 0, halo == "1")
            for renderer in renderers:
                view = ("h.trip", "--renderer", renderer, "--size", "90x90")
                usual = self.stats(*view)["classify"]
                self.assertEqual(usual, "post" if halo == "1" else "pre")
                stats = self.stats(*view, "--classify", "pre")
                lists = [(l["splats_read"], l["bytes_read"])
                         for l in stats["frames"][0]["lists"].values()]
                with open("a.exr", "rb") as picture:
                    seen.append((halo, renderer, lists, picture.read()))
        for without, with_halo in zip(seen[: len(renderers)], seen[len(renderers) :]):
            self.assertEqual(without[1:], with_halo[1:])

    def test_stats_have_a_frame_for_each_image_of_an_orbit(self):
        stats = self.stats("heat.trip", "--orbit", "5", "--size", "30x30")
        self.assertEqual(len(stats["frames"]), 5)

    def test_with_h_0_a_full_view_draws_every_voxel_three_times(self):
        """The eye is beyond a corner. Elsewhere rays go both ways along an axis, and splats count
        twice."""
        directions = random.Random(3)
        for name, kept in self.kept.items():
            for renderer in "cpu", "reference":
                matrix, dims = (numpy.array(self.info(f"{name}.trip")[key])
                                for key in ("index_to_world", "dims"))
                corner = [directions.choice((-1, 1)) * directions.uniform(0.6, 1) * d for d in dims]
                view = self.view_from(name, matrix[:, :3] @ corner, "--h", "0", "--renderer",
                                      renderer)
                self.assertEqual(self.drawn(*view), 3 * kept, view)

    def test_a_parallel_view_along_an_axis_draws_every_voxel_once(self):
        for name, kept in self.kept.items():
            centre, radius, matrix = self.middle(name)
            for axis in range(3):
                along = matrix[:, axis] / numpy.linalg.norm(matrix[:, axis]) * radius * 3
                for method in ("merge", "clip", "axis")[: 3 if name == "heat" else 1]:
                    view = [
                        f"{name}.trip",
                        "--ortho",
                        str(2.5 * radius),
                        "--size",
                        "120x120",
                        "--eye",
                        ",".join(map(str, centre - along)),
                        "--look",
                        ",".join(map(str, centre)),
                        "--up",
                        "0.3,0.4,0.5",
                        "--method",
                        method,
                    ]
                    view += ["--h", "0"] if method == "merge" else []
                    stats = self.stats(*view, "--count", "--occluded", "draw")
                    self.assertEqual(program.splats_drawn(stats), kept, view)
                    read = [c["splats_read"] for c in stats["frames"][0]["lists"].values()]
                    self.assertEqual([n for n in read if n], [kept], view)

    def test_fewer_splats_are_drawn_with_larger_h_clip_and_axis(self):
        for name, kept in self.kept.items():
            for direction in (1, 0.9, 0.8), (-1, 0.5, 0.1):
                view = self.view_from(name, direction)
                counts = [self.drawn(*view, "--h", h) for h in (0, 0.5, 0.85, 0.99)]
                counts.append(self.drawn(*view, "--method", "clip"))
                counts.append(self.drawn(*view, "--method", "axis"))
                self.assertEqual(counts, sorted(counts, reverse=True), view)
                self.assertEqual(counts[-1], kept)
                self.assertLess(counts[2], counts[0])
                self.assertLessEqual(counts[-2], 3 * kept)

    def test_all_renderers_count_alike(self):
        view = self.view_from("sheared", (1, 2, 3), "--h", "0.7")
        lists = [
            self.stats(*view, "--renderer", r, "--count")["frames"][0]["counted"]
            for r in ("cpu", "reference")
        ]
        for axis in "xyz":
            self.assertEqual(lists[0][axis]["splats_drawn"], lists[1][axis]["splats_drawn"])

    def test_a_full_queue_does_not_drop_the_last_sheet_of_a_list(self):
        """Walls of fog fill a large picture, so that the queue of `gl` is full at the end of a
        list."""
        fog = numpy.full((24, 24, 24), 1, "u1")
        for end in 0, -1:
            fog[end] = fog[:, end] = fog[:, :, end] = 2
        program.write_nrrd("walls.nrrd", fog)
        program.write("walls.tf", b"values data\nunit voxel\n0 .2 .4 1 .005\n1.5 .2 .4 1 .005\n"
                                  b"1.5 1 .3 .1 .9\n2 1 .3 .1 .9\n")
        self.brick("walls.nrrd", "walls.trip", "--tf=walls.tf", "--keep-all", "--levels=0")
        view = ["--eye=-6,-9,-7", "--look=12,12,12", "--up=0,0,1", "--fov=60", "--size=512x512"]
        look = ["--classify=pre", "--compositing=sheet", "--no-shading"]
        expected = self.picture("walls.trip", *view, *look, "--renderer=cpu")
        for gl in program.GL:
            drawn = self.picture("walls.trip", *view, *look, f"--renderer={gl}")
            self.assertLess(255 * abs(drawn - expected).max(), 1)

    def test_only_bricks_in_the_view_are_read(self):
        """One view looks past the volume, another at a small part of it."""
        centre, radius, _ = self.middle("tooth")
        away = [
            "tooth.trip",
            "--eye",
            ",".join(map(str, centre + 3 * radius)),
            "--look",
            ",".join(map(str, centre + 9 * radius)),
            "--size",
            "50x50",
        ]
        stats = self.stats(*away)
        self.assertFalse(any(c["bytes_read"] for c in stats["frames"][0]["lists"].values()))
        close = [
            "tooth.trip",
            "--eye",
            ",".join(map(str, centre + [0, 0, 3 * radius])),
            "--look",
            ",".join(map(str, centre)),
            "--up",
            "0,1,0",
            "--fov",
            "3",
            "--size",
            "50x50",
        ]
        lists = self.stats(*close)["frames"][0]["lists"]
        self.assertLess(lists["z"]["splats_read"], 0.7 * self.kept["tooth"])
        self.assertEqual(lists["x"]["splats_read"] + lists["y"]["splats_read"], 0)

    def test_a_bound_below_the_coarsest_level_is_reported(self):
        for classify in "pre", "post":
            draw = ["render", "tooth.trip", "-o", "x.png", "--size=20x20", f"--classify={classify}"]
            held = self.works(*draw, "--max-bytes=1G")
            self.assertEqual("", held.stderr)
            beyond = self.works(*draw, "--max-bytes=1")
            self.assertRegex(beyond.stderr, "^triptych: warning: tooth.trip: the coarsest level reads up to .* of codes and normals")


if __name__ == "__main__":
    program.main()
