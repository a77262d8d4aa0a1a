"""Tests of `render VOLUME` and of the cache of bricked volumes. The cache finds volumes again, is
never stale, keeps its size limit, and is safe against any content of its folder."""
import fcntl
import json
import os
import shutil
import signal
import subprocess
import tempfile
import time
import unittest

import numpy

import program

ROOT = os.getuid() == 0
SIZE = ["--size", "40x40", "--renderer", "cpu"]


def tree(folder):
    """Returns every path in the folder, with the contents of files and the targets of links."""
    found = {}
    for base, folders, files in os.walk(folder):
        for name in folders:
            found[os.path.join(base, name)] = None
        for name in files:
            path = os.path.join(base, name)
            if os.path.islink(path):
                found[path] = os.readlink(path)
                continue
            with open(path, "rb") as f:
                found[path] = f.read()
    return found


class Cache(program.ProgramTest):
    def setUp(self):
        self.home = os.path.join(self.folder, "home")
        shutil.rmtree(self.home, ignore_errors=True)
        os.makedirs(self.home)
        os.environ["HOME"] = self.home
        os.environ["XDG_CACHE_HOME"] = os.path.join(self.home, "cache")
        os.environ.pop("TRIPTYCH_CACHE_SIZE", None)
        self.cache = os.path.join(self.home, "cache", "triptych")

    def entries(self):
        if not os.path.isdir(self.cache):
            return []
        return sorted(n for n in os.listdir(self.cache) if n.endswith(".trip"))

    def draw(self, volume, *options, bricked):
        """Draws a volume. Returns the picture, and checks whether the volume was bricked for it."""
        run = self.works("render", volume, "-o", "one.exr", *SIZE, *options)
        self.assertEqual("bricked into the cache" in run.stdout.decode(), bricked, run)
        return program.read_exr("one.exr")

    def two_steps(self, volume, *options, brick=()):
        self.brick(volume, "two.trip", *brick)
        return self.picture("two.trip", *SIZE, *options)

    def same(self, a, b):
        self.assertTrue(numpy.array_equal(a, b))

    def differ(self, a, b):
        self.assertFalse(numpy.array_equal(a, b))

    # Found again

    def test_one_step_equals_two_and_the_next_picture_is_cached(self):
        program.write_nrrd("ball.nrrd", program.ball((20, 24, 28)))
        wanted = self.two_steps("ball.nrrd")
        self.assertGreater(wanted[..., 3].max(), 0.5)
        self.same(self.draw("ball.nrrd", bricked=True), wanted)
        self.same(self.draw("ball.nrrd", bricked=False), wanted)
        self.same(self.draw("./ball.nrrd", bricked=False), wanted)
        self.assertEqual(len(self.entries()), 1)

    def test_a_copy_of_a_volume_is_found(self):
        program.write_nrrd("ball.nrrd", program.ball((20, 24, 28)))
        self.draw("ball.nrrd", bricked=True)
        shutil.copy("ball.nrrd", "copy.nrrd")
        self.draw("copy.nrrd", bricked=False)

    def test_raw_files_of_different_shapes_are_different_volumes(self):
        values = program.noise((8, 12, 16))
        program.write_raw("a_16x12x8_uint8.raw", values)
        program.write_raw("a_8x12x16_uint8.raw", values)
        self.differ(
            self.draw("a_16x12x8_uint8.raw", bricked=True),
            self.draw("a_8x12x16_uint8.raw", bricked=True),
        )

    def test_every_format_is_cached(self):
        values = program.ball((12, 14, 16))
        program.write_nifti("v.nii", values)
        program.write_nifti("v.nii.gz", values, packed=True)
        program.write_vol("v.vol", values)
        program.write_raw("v_16x14x12_uint8.raw", values)
        program.write_stack("stack", values, program.write_tiff, "tif")
        for z, image in enumerate(program.ball((12, 14, 16), dtype="u2")):
            os.makedirs("scan", exist_ok=True)
            program.write_dicom(f"scan/{z}.dcm", image, z)
        vdb = os.path.join(program.DATASETS, "densityAndHeat.vdb")
        for volume in (
            "v.nii",
            "v.nii.gz",
            "v.vol",
            "v_16x14x12_uint8.raw",
            "stack",
            "stack/slice-%04d.tif",
            "stack/*.tif",
            "scan",
            vdb,
        ):
            with self.subTest(volume):
                wanted = self.two_steps(volume)
                first = volume not in ("stack/slice-%04d.tif", "stack/*.tif")
                self.same(self.draw(volume, bricked=first), wanted)
                self.same(self.draw(volume, bricked=False), wanted)

    def test_options_make_separate_data_sets(self):
        vdb = os.path.join(program.DATASETS, "densityAndHeat.vdb")
        self.draw(vdb, bricked=True)
        heat = self.draw(vdb, "--grid", "heat", bricked=True)
        self.same(heat, self.two_steps(vdb, brick=("--grid", "heat")))
        wide = self.draw(vdb, "--spacing", "1,2,3", bricked=True)
        self.same(wide, self.two_steps(vdb, brick=("--spacing", "1,2,3")))
        self.assertEqual(len(self.entries()), 3)

    def test_a_transfer_function_shows_more_than_the_automatic_one(self):
        values = program.noise((16, 16, 16))
        program.write_nrrd("noise.nrrd", values)
        program.write("all.tf", b"0 1 0 0 0.1\n255 0 0 1 0.1\n")
        drawn = self.draw("noise.nrrd", "--tf", "all.tf", bricked=True)
        wanted = self.two_steps("noise.nrrd", "--tf", "all.tf", brick=["--keep-all"])
        self.assertLess(abs(drawn - wanted).max(), 1 / 255)  # only the rounding of normals differs
        self.assertGreater(abs(drawn - self.two_steps("noise.nrrd", "--tf", "all.tf")).max(), 0.1)
        self.same(self.draw("noise.nrrd", "--tf", "all.tf", bricked=False), drawn)
        program.write("all.tf", b"0 0 1 0 0.1\n255 0 0 1 0.1\n")
        self.differ(self.draw("noise.nrrd", "--tf", "all.tf", bricked=False), drawn)

    def test_the_default_data_set_serves_narrower_transfer_functions(self):
        values = program.ball((20, 20, 20))
        program.write_nrrd("ball.nrrd", values)
        self.draw("ball.nrrd", bricked=True)
        program.write("few.tf", b"150 1 0 0 0\n199 0 0 1 0.1\n200 0 0 1 0.1\n")
        drawn = self.draw("ball.nrrd", "--tf", "few.tf", bricked=False)
        self.same(drawn, self.two_steps("ball.nrrd", "--tf", "few.tf"))
        self.assertEqual(len(self.entries()), 1)

    def test_a_window_shows_more_than_the_automatic_function(self):
        values = program.noise((16, 16, 16))
        program.write_nrrd("noise.nrrd", values)
        window = ["--tf", "grey", "--window", "60", "--level", "40"]
        drawn = self.draw("noise.nrrd", *window, bricked=True)
        wanted = self.two_steps("noise.nrrd", *window, brick=["--keep-all"])
        self.assertLess(abs(drawn - wanted).max(), 1 / 255)
        self.same(self.draw("noise.nrrd", *window, bricked=False), drawn)
        run = self.works("render", "noise.nrrd", "-o", "x.png", *SIZE, *window)
        self.assertEqual(run.stderr, "")

    # Data sets of other transfer functions

    def fresh(self, volume, *options):
        """Draws with an empty cache of its own."""
        home = os.environ["XDG_CACHE_HOME"]
        with tempfile.TemporaryDirectory(prefix="trip-cache-") as os.environ["XDG_CACHE_HOME"]:
            drawn = self.draw(volume, *options, bricked=True)
        os.environ["XDG_CACHE_HOME"] = home
        return drawn

    def stamps(self):
        """Returns inode, size and time of every file of every data set."""
        return {path: (st.st_ino, st.st_size, st.st_mtime_ns)
                for entry in self.entries()
                for file in os.scandir(os.path.join(self.cache, entry))
                for path, st in [(file.path, file.stat())]}

    def served(self, volume, *options):
        """Draws a volume from a data set of another transfer function."""
        before = self.stamps()
        run = self.works("render", volume, "-o", "one.exr", *SIZE, *options)
        self.assertIn("found in the cache, in a data set made for another transfer function",
                      run.stdout.decode())
        self.assertEqual(self.stamps(), before)
        return program.read_exr("one.exr")

    def function(self, name, *points):
        lines = [" ".join(map(str, p)) for p in points]
        program.write(name, ("values data\n" + "\n".join(lines) + "\n").encode())

    def test_other_colours_are_drawn_from_the_same_data_set(self):
        program.write_nrrd("noise.nrrd", program.noise((20, 20, 20)))
        self.function("c.tf", (60, 1, 0, 0, 0), (100, 1, 0, 0, 0.1), (255, 1, 1, 0, 0.4))
        old = self.draw("noise.nrrd", "--tf", "c.tf", bricked=True)
        # Other colours and another opacity, visible for the same values
        self.function("c.tf", (60, 0, 1, 0, 0), (140, 0, 0, 1, 0.3), (255, 0, 1, 1, 0.2))
        new = self.served("noise.nrrd", "--tf", "c.tf")
        self.differ(new, old)
        self.same(new, self.fresh("noise.nrrd", "--tf", "c.tf"))
        self.assertEqual(len(self.entries()), 1)

    def test_two_functions_in_turn_brick_once_each(self):
        program.write_nrrd("noise.nrrd", program.noise((20, 20, 20)))
        self.function("low.tf", (0, 1, 0, 0, 0.1), (50, 1, 0, 0, 0))
        self.function("high.tf", (0, 0, 0, 0, 0), (30, 0, 0, 0, 0), (40, 0, 0, 1, 0.1))
        for bricked in True, False, False:
            for name in "low.tf", "high.tf":
                self.draw("noise.nrrd", "--tf", name, bricked=bricked)
        self.assertEqual(len(self.entries()), 2)

    def test_a_value_more_is_bricked(self):
        """The least visible value moves by one step of a float, and by one integer."""
        for kind, top, step in ("u1", 255, 1), ("f4", 1, 2 ** -23):
            values = program.noise((16, 16, 16), kind)
            program.write_nrrd(f"{kind}.nrrd", values)
            shown = sorted(set(values.ravel().tolist()))
            least = shown[len(shown) // 8]
            less = shown[len(shown) // 8 - 1]
            self.function("a.tf", (repr(least), 0, 0, 1, 0.1), (top, 1, 0, 0, 0.1))
            with open("a.tf", "r+") as f:  # nothing below the first point
                text = f.read().replace("data\n", f"data\n{least!r} 0 0 1 0\n")
                f.seek(0)
                f.write(text)
            with open("b.tf", "w") as f:
                f.write(text.replace(repr(least), repr(less)))
            self.draw(f"{kind}.nrrd", "--tf", "a.tf", bricked=True)
            self.draw(f"{kind}.nrrd", "--tf", "a.tf", bricked=False)
            wanted = self.fresh(f"{kind}.nrrd", "--tf", "b.tf")
            self.same(self.draw(f"{kind}.nrrd", "--tf", "b.tf", bricked=True), wanted)

    def test_the_smallest_data_set_that_serves_is_taken(self):
        program.write_nrrd("noise.nrrd", program.noise((24, 24, 24)))
        opaque = lambda least: [(least, 1, 1, 1, 0), (least, 1, 1, 1, 0.1)]
        for name, least in ("all.tf", 0), ("much.tf", 60), ("few.tf", 220):
            self.function(name, *opaque(least))
        made = []
        for name in "much.tf", "all.tf":
            self.draw("noise.nrrd", "--tf", name, bricked=True)
            made += [n for n in self.entries() if n not in made]
        made.sort(key=self.size_of)
        self.assertLess(self.size_of(made[0]), self.size_of(made[1]))
        for n in made:
            os.utime(os.path.join(self.cache, n), (1000, 1000))
        self.served("noise.nrrd", "--tf", "few.tf")
        used = [os.stat(os.path.join(self.cache, n)).st_mtime for n in made]
        self.assertGreater(used[0], 1000)
        self.assertEqual(used[1], 1000)

    def narrow_and_wide(self):
        """Yields volumes with a function that shows a part of the values, and one that shows more.
        The second data set has even codes, the third has codes that follow the kept values."""
        for name, least, more, top in (("tooth.nhdr", 620, 0, 1300), ("stent.nrrd", 0.45, 0.3, 1),
                                       ("wdas_cloud_sixteenth.vdb", 0.2, 0, 1)):
            volume = os.path.join(program.DATASETS, name)
            self.function("few.tf", (least, 1, 0.5, 0, 0), (top, 1, 1, 1, 0.9))
            self.function("more.tf", (more, 0, 0.5, 0, 0.01), (top, 1, 1, 1, 0.9))
            self.draw(volume, "--tf", "more.tf", bricked=True)
            yield volume, name != "wdas_cloud_sixteenth.vdb"

    @unittest.skipIf(program.SANITIZED, "compares pictures; other tests draw from the same data sets")
    def test_stored_voxels_alone_give_the_same_bits_from_more_values(self):
        """Splats and nearest voxels, and their gradients, read only shown voxels and their halo."""
        for volume, even in self.narrow_and_wide():
            for options in ["--classify", "pre"], ["--interpolation", "nearest"]:
                options += ["--tf", "few.tf"]
                if even:
                    self.same(self.served(volume, *options), self.fresh(volume, *options))

    @unittest.skipIf(program.SANITIZED, "compares pictures; other tests draw from the same data sets")
    def test_more_values_come_no_less_close_to_the_integral(self):
        """With interpolation, gradients and wide kernels at the border of the shown values read
        values that a data set of the function alone lacks. Codes that follow the kept values differ
        too."""
        for volume, even in self.narrow_and_wide():
            for kernel, bound in ("linear", 3 if even else 12), ("cubic", 7 if even else 14):
                options = ["--tf", "few.tf", "--interpolation", kernel, "--size", "160x160",
                           "--samples-per-sheet", "4", "--lod", "0", "--samples", "1"]
                own = self.fresh(volume, *options)
                drawn = self.served(volume, *options)
                truth = self.picture(volume, "--renderer", "integral", "--field", "source",
                                     "--samples", "1", *options[:6])
                apart = [255 * abs(picture - truth).mean() for picture in (own, drawn)]
                between = 255 * abs(own - drawn).max()
                print(f"{os.path.basename(volume)}, {kernel}: {apart[0]:.4f} of 255 with its own "
                      f"data set, {apart[1]:.4f} with more values, at most {between:.2f} between",
                      flush=True)
                self.assertLessEqual(apart[1], 1.02 * apart[0])
                self.assertLess(between, bound)

    def test_a_measured_error_needs_the_measured_data_set(self):
        program.write_nrrd("noise.nrrd", program.noise((20, 20, 20)))
        self.brick("noise.nrrd", "usual.trip")
        program.write_report("usual", "usual.trip")
        program.write_report("other", None)
        wide = ["--tf", "grey", "--window", "60", "--level", "40"]
        self.draw("noise.nrrd", *wide, bricked=True)
        self.served("noise.nrrd")
        run = program.call("render", "noise.nrrd", "-o", "x.png", "--size", "40x40", "--error", "255",
                           "--report", "other")
        self.assertEqual(run.returncode, 1)
        self.assertIn("the report measured another data set", run.stderr)
        run = self.works("render", "noise.nrrd", "-o", "x.png", "--size", "40x40", "--error", "255",
                         "--report", "usual")
        self.assertNotIn(b"bricked", run.stdout)  # the refused run has made the usual data set
        self.assertNotIn(b"another transfer function", run.stdout)
        self.assertEqual(len(self.entries()), 2)

    def test_ids_are_drawn_from_a_data_set_with_more_ids(self):
        """Ids beyond 2^24 are no floats, so that only the same function finds its data set."""
        cells = numpy.indices((12, 12, 12)).sum(0) // 6
        for first, exact in (70001, True), (2 ** 24 + 1, False):
            ids = numpy.array([0, first, first + 200001, first + 400001, first + 600001,
                               first + 800001],
                              "u4")
            program.write_nrrd("ids.nrrd", ids[cells])
            def shows(name, blue, *of):
                points = [(0, 0, 0, 0, 0)]
                for i in sorted(of):
                    points += [(ids[i] - 0.4, 0, 0, 0, 0), (ids[i] - 0.4, 1, 0, blue, 0.8),
                               (ids[i] + 0.4, 1, 0, blue, 0.8), (ids[i] + 0.4, 0, 0, 0, 0)]
                self.function(name, *points)
            shows("more.tf", 0, 1, 2, 4)
            shows("few.tf", 1, 2, 4)
            shutil.rmtree(self.cache, ignore_errors=True)
            more = self.draw("ids.nrrd", "--tf", "more.tf", bricked=True)
            self.same(self.draw("ids.nrrd", "--tf", "more.tf", bricked=False), more)
            wanted = self.fresh("ids.nrrd", "--tf", "few.tf")
            drawn = self.works("render", "ids.nrrd", "-o", "one.exr", *SIZE, "--tf", "few.tf")
            self.assertEqual(b"in a data set made for another" in drawn.stdout, exact)
            self.assertEqual(b"bricked" in drawn.stdout, not exact)
            self.same(program.read_exr("one.exr"), wanted)

    def test_a_data_set_with_all_values_serves_only_its_own_volume_and_options(self):
        values = program.noise((14, 14, 14), "i2")
        values[0, 0, :3] = -9999
        program.write_nrrd("v.nrrd", values)
        window = ["--tf", "grey", "--window", "60", "--level", "40"]
        self.draw("v.nrrd", *window, bricked=True)
        for options in [], ["--tf", "grey"], ["--tf", "mr"]:
            self.served("v.nrrd", *options)
        for options in ["--spacing", "1,2,3"], ["--fill", "none"], ["--axes", "LPS"]:
            self.draw("v.nrrd", "--tf", "grey", *options, bricked=True)
        program.write_nrrd("w.nrrd", program.noise((14, 14, 14), "i2", seed=3))
        self.draw("w.nrrd", "--tf", "grey", bricked=True)
        self.assertEqual(len(self.entries()), 5)

    def test_a_path_is_drawn_from_a_data_set_with_the_values_of_all_its_functions(self):
        program.write_nrrd("noise.nrrd", program.noise((20, 20, 20)))
        self.function("low.tf", (40, 1, 0, 0, 0.1), (90, 1, 0, 0, 0))
        self.function("high.tf", (80, 0, 0, 0, 0), (200, 0, 0, 1, 0.1))
        self.function("all.tf", (0, 0, 0, 1, 0.1))
        keys = [{"seconds": i, "eye": [10 + 9 * i, -50, 10], "look": [10, 10, 10], "up": [0, 0, 1], "fov": 30,
                 "function": name}
                for i, name in enumerate(("low.tf", "high.tf"))]
        with open("path.json", "w") as f:
            json.dump({"triptych_path": 1, "keys": keys}, f)
        self.draw("noise.nrrd", "--tf", "all.tf", bricked=True)
        run = self.works("render", "noise.nrrd", "-o", "p.png", *SIZE, "--path", "path.json")
        self.assertNotIn(b"bricked", run.stdout)
        self.assertEqual(len(self.entries()), 1)

    # Never stale

    def test_a_changed_file_is_bricked_again(self):
        """This holds if the file changes at once, keeps its size, and gets its old time back."""
        program.write_nrrd("v.nrrd", program.noise((12, 12, 12), seed=1))
        times = os.stat("v.nrrd")
        old = self.draw("v.nrrd", bricked=True)
        program.write_nrrd("v.nrrd", program.noise((12, 12, 12), seed=2))
        os.utime("v.nrrd", ns=(times.st_atime_ns, times.st_mtime_ns))
        new = self.draw("v.nrrd", bricked=True)
        self.differ(new, old)
        self.same(new, self.two_steps("v.nrrd"))
        program.write_nrrd("v.nrrd", program.noise((12, 12, 12), seed=1))
        self.same(self.draw("v.nrrd", bricked=False), old)

    def test_a_changed_file_with_a_stored_link_is_bricked_again(self):
        program.write_nrrd("v.nrrd", program.noise((12, 12, 12), seed=1))
        time.sleep(2.2)  # the program trusts times only when they are this old
        old = self.draw("v.nrrd", bricked=True)
        links = [n for n in os.listdir(self.cache) if n.endswith(".link")]
        self.assertEqual(len(links), 1)
        self.same(self.draw("v.nrrd", bricked=False), old)
        program.write_nrrd("v.nrrd", program.noise((12, 12, 12), seed=2))
        self.differ(self.draw("v.nrrd", bricked=True), old)

    def test_a_change_in_a_referenced_file_counts(self):
        values = [program.noise((12, 12, 12), seed=s) for s in (1, 2)]

        def detached(v):
            program.write("v.data", v.tobytes())

        def pair(v):
            program.write("p.img", v.tobytes())

        def stack(v):
            program.write_stack("s", v[:, :, :], program.write_png, "png")

        header = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 12 12 12\nencoding: raw\n"
        program.write("v.nhdr", (header + "data file: v.data\n").encode())
        program.write_nifti("p.nii", values[0])
        with open("p.nii", "rb") as f:
            head = bytearray(f.read(348))
        head[344:348] = b"ni1\0"
        head[108:112] = bytes(4)
        program.write("p.hdr", bytes(head))
        for volume, write in ("v.nhdr", detached), ("p.hdr", pair), ("p.img", pair), ("s", stack):
            with self.subTest(volume):
                shutil.rmtree(self.cache, ignore_errors=True)
                write(values[0])
                old = self.draw(volume, bricked=True)
                self.draw(volume, bricked=False)
                write(values[1])
                new = self.draw(volume, bricked=True)
                self.differ(new, old)
                self.same(new, self.two_steps(volume))
        os.remove("s/slice-0011.png")
        self.draw("s", bricked=True)

    # Several at once, interrupted, damaged

    def cloud(self):
        if not os.path.exists("cloud.nrrd"):
            subprocess.run(
                [program.GENERATE, "cloud", "--size", "192", "-o", "cloud.nrrd"], check=True
            )

    def test_concurrent_runs_brick_once(self):
        self.cloud()
        runs = [program.start("render", "cloud.nrrd", "-o", f"{i}.png", *SIZE) for i in range(3)]
        said = [r.communicate(timeout=120) for r in runs]
        self.assertEqual([r.returncode for r in runs], [0, 0, 0], said)
        self.assertEqual(sum(b"bricked into" in out for out, _ in said), 1)
        self.assertEqual(len(self.entries()), 1)
        pictures = tree(".")
        self.assertEqual(pictures["./0.png"], pictures["./1.png"])
        self.assertEqual(pictures["./0.png"], pictures["./2.png"])

    def stop_while_bricking(self, number):
        run = program.start("render", "cloud.nrrd", "-o", "x.png", *SIZE)
        for _ in range(2000):
            names = os.listdir(self.cache) if os.path.isdir(self.cache) else []
            if run.poll() is not None or any(n.endswith((".partial", ".spill")) for n in names):
                break
            time.sleep(0.002)
        run.send_signal(number)
        out, err = run.communicate(timeout=60)
        return run.returncode, err.decode()

    def test_interrupted_bricking_leaves_nothing(self):
        self.cloud()
        status, err = self.stop_while_bricking(signal.SIGINT)
        if status == 0:
            self.skipTest("it was done before it could be interrupted")
        self.assertEqual(status, 1, err)
        self.assertEqual(len(err.splitlines()), 1, err)
        self.assertEqual([n for n in os.listdir(self.cache) if not n.endswith(".link")], [])

    def test_the_next_run_cleans_up_after_a_killed_one(self):
        self.cloud()
        status, _ = self.stop_while_bricking(signal.SIGKILL)
        if status == 0:
            self.skipTest("it was done before it could be killed")
        self.assertEqual(self.entries(), [])
        self.assertIn(b"0 data sets", self.works("cache", "list").stdout)
        self.draw("cloud.nrrd", bricked=True)
        self.assertEqual(len([n for n in os.listdir(self.cache)
                              if not n.endswith((".link", ".quality"))]), 1)

    def test_clear_removes_files_of_a_killed_process(self):
        self.cloud()
        status, _ = self.stop_while_bricking(signal.SIGKILL)
        self.works("cache", "clear")
        self.assertEqual(os.listdir(self.cache), [])

    def pause_while_bricking(self, *options):
        """Starts a picture of the cloud, and stops the process while it makes the data set."""
        run = program.start("render", "cloud.nrrd", "-o", "x.png", *SIZE, *options)
        for _ in range(5000):
            names = os.listdir(self.cache) if os.path.isdir(self.cache) else []
            if run.poll() is not None or any(n.endswith(".partial") for n in names):
                break
            time.sleep(0.001)
        run.send_signal(signal.SIGSTOP)
        self.assertIsNone(run.poll())
        self.addCleanup(run.kill)
        return run

    def go_on(self, run):
        run.send_signal(signal.SIGCONT)
        out, err = run.communicate(timeout=120)
        self.assertEqual((run.returncode, err), (0, b""))
        return out.decode()

    def test_clear_leaves_a_data_set_in_the_making_alone(self):
        self.cloud()
        program.write_nrrd("v.nrrd", program.noise((12, 12, 12)))
        self.draw("v.nrrd", bricked=True)
        run = self.pause_while_bricking()
        for removed in b"removed 1 data set,", b"removed 0 data sets,":
            clear = self.fails(1, "cache", "clear", says="1 data set remains: 1 being made")
            self.assertIn(removed, clear.stdout)
        self.assertEqual(self.entries(), [])
        self.assertIn("bricked into the cache", self.go_on(run))
        self.draw("cloud.nrrd", bricked=False)
        self.assertEqual(len(self.entries()), 1)

    def test_clear_leaves_a_complete_data_set_until_its_maker_holds_it(self):
        program.write_nrrd("v.nrrd", program.noise((12, 12, 12)))
        self.draw("v.nrrd", bricked=True)
        (entry,) = self.entries()
        lock = os.open(os.path.join(self.cache, entry[:-5] + ".lock"), os.O_RDWR | os.O_CREAT, 0o600)
        fcntl.flock(lock, fcntl.LOCK_EX)
        self.fails(1, "cache", "clear", says="1 being made")
        self.assertEqual(self.entries(), [entry])
        os.close(lock)
        self.works("cache", "clear")
        self.assertEqual(os.listdir(self.cache), [])

    def test_bricking_succeeds_while_the_cache_is_cleared_again_and_again(self):
        program.write_nrrd("v.nrrd", program.noise((32, 32, 32)))
        for _ in range(10):
            run = program.start("render", "v.nrrd", "-o", "x.png", *SIZE)
            while run.poll() is None:
                clear = program.call("cache", "clear")
                self.assertRegex(clear.stderr, r"\A(triptych: cache: .* remains: 1 (in use|being made)\n)?\Z")
            self.assertEqual((run.returncode, run.stderr.read()), (0, b""))
            run.communicate()

    def test_a_data_set_that_is_drawn_is_neither_cleared_nor_evicted(self):
        self.cloud()
        self.draw("cloud.nrrd", bricked=True)
        (drawn,) = self.entries()
        run = program.start("render", "cloud.nrrd", "-o", "x.png", "--size", "1500x1500",
                            "--renderer", "reference")
        self.addCleanup(run.kill)
        def held():  # opened and locked
            folder = f"/proc/{run.pid}/fd"
            for fd in os.listdir(folder):
                try:
                    if drawn in os.readlink(os.path.join(folder, fd)):
                        with open(f"/proc/{run.pid}/fdinfo/{fd}", encoding="ascii") as info:
                            if "lock:" in info.read():
                                return True
                except FileNotFoundError:
                    pass  # closed since it was listed
            return False
        while run.poll() is None and not held():
            time.sleep(0.001)
        run.send_signal(signal.SIGSTOP)
        self.assertIsNone(run.poll())
        self.fails(1, "cache", "clear", says="1 data set remains: 1 in use")
        program.write_nrrd("v.nrrd", program.noise((12, 12, 12)))
        os.environ["TRIPTYCH_CACHE_SIZE"] = str(self.size_of(drawn) // 2)
        self.draw("v.nrrd", bricked=True)
        self.assertIn(drawn, self.entries())
        self.assertEqual(len(self.entries()), 2)
        run.send_signal(signal.SIGINT)
        run.send_signal(signal.SIGCONT)
        run.communicate(timeout=60)
        program.write_nrrd("w.nrrd", program.noise((12, 12, 12), seed=2))
        self.draw("w.nrrd", bricked=True)
        self.assertNotIn(drawn, self.entries())

    def test_two_functions_are_bricked_at_once(self):
        self.cloud()
        self.function("all.tf", (0, 1, 1, 1, 0.1))
        first = self.pause_while_bricking()
        self.draw("cloud.nrrd", "--tf", "all.tf", bricked=True)
        self.go_on(first)
        self.assertEqual(len(self.entries()), 2)

    def damage(self, name, change):
        path = os.path.join(self.cache, self.entries()[0], name)
        with open(path, "rb") as f:
            data = bytearray(f.read())
        program.write(path, bytes(change(data)))

    def test_a_damaged_data_set_is_replaced_with_a_warning(self):
        program.write_nrrd("v.nrrd", program.noise((12, 12, 12)))
        wanted = self.draw("v.nrrd", bricked=True)

        def flip(data):
            data[len(data) // 2] ^= 1
            return data

        changes = {
            "flipped": lambda: self.damage("index.trip", flip),
            "cut off": lambda: self.damage("index.trip", lambda d: d[:-1]),
            "empty": lambda: self.damage("x0.voxels", lambda d: b""),
            "missing": lambda: os.remove(os.path.join(self.cache, self.entries()[0], "z0.voxels")),
            "no index": lambda: os.remove(
                os.path.join(self.cache, self.entries()[0], "index.trip")
            ),
        }
        for name, change in changes.items():
            with self.subTest(name):
                change()
                run = self.works("render", "v.nrrd", "-o", "one.exr", *SIZE)
                self.assertIn("is damaged and will be made again", run.stderr)
                self.same(program.read_exr("one.exr"), wanted)
                self.same(self.draw("v.nrrd", bricked=False), wanted)

    def test_damage_found_while_drawing_removes_the_data_set(self):
        program.write_nrrd("v.nrrd", program.noise((12, 12, 12)))
        wanted = self.draw("v.nrrd", bricked=True)
        for list_name in "xyz":
            self.damage(f"{list_name}0.voxels", lambda d: bytes([d[0] ^ 255]) + d[1:])
        run = program.call("render", "v.nrrd", "-o", "one.exr", *SIZE)
        self.assertEqual(run.returncode, 1)
        self.assertIn("the same command makes it again", run.stderr)
        self.same(self.draw("v.nrrd", bricked=True), wanted)

    def test_too_little_memory_removes_no_data_set(self):
        self.cloud()
        for options in [], ["--tf", "grey"]:
            self.works("render", "cloud.nrrd", "-o", "x.png", *SIZE, *options)
        before = self.stamps()
        for memory in "1K", "100K", "1M", "4M":
            for options in [], ["--tf", "grey"]:
                program.call("render", "cloud.nrrd", "-o", "x.png", *SIZE, *options, "--memory", memory)
        self.assertEqual(self.stamps(), before)

    # Limited

    def size_of(self, name):
        folder = os.path.join(self.cache, name)
        return sum(os.path.getsize(os.path.join(folder, n)) for n in os.listdir(folder))

    def test_the_least_recently_used_data_set_makes_room(self):
        for i in range(4):
            program.write_nrrd(f"v{i}.nrrd", program.noise((14, 14, 14), seed=i))
        made = []
        for i in range(3):
            self.draw(f"v{i}.nrrd", bricked=True)
            made += [n for n in self.entries() if n not in made]
        for age, i in enumerate((0, 2, 1)):  # 1 was used least recently, then 2
            used = time.time() - 100 - 10 * age
            os.utime(os.path.join(self.cache, made[i]), (used, used))
        room = sum(self.size_of(n) for n in made)
        os.environ["TRIPTYCH_CACHE_SIZE"] = str(room + 1000)
        self.draw("v3.nrrd", bricked=True)
        self.assertNotIn(made[1], self.entries())
        self.assertIn(made[0], self.entries())
        self.assertLessEqual(sum(self.size_of(n) for n in self.entries()), room + 1000)
        self.draw("v0.nrrd", bricked=False)
        self.draw("v1.nrrd", bricked=True)

    def test_a_data_set_too_large_for_the_cache_is_refused(self):
        program.write_nrrd("v.nrrd", program.noise((40, 40, 40)))
        os.environ["TRIPTYCH_CACHE_SIZE"] = "4K"
        self.fails(1, "render", "v.nrrd", "-o", "x.png", says="TRIPTYCH_CACHE_SIZE")
        self.assertFalse(os.path.exists("x.png"))
        self.assertEqual(self.entries(), [])
        for size in "0", "x", "-1", "5Q":
            os.environ["TRIPTYCH_CACHE_SIZE"] = size
            self.fails(2, "render", "v.nrrd", "-o", "x.png", says="TRIPTYCH_CACHE_SIZE")

    def test_a_data_set_in_use_is_kept(self):
        program.write_nrrd("v.nrrd", program.noise((12, 12, 12)))
        self.draw("v.nrrd", bricked=True)
        name = self.entries()[0]
        held = os.open(os.path.join(self.cache, name), os.O_RDONLY)
        fcntl.flock(held, fcntl.LOCK_SH)
        self.fails(1, "cache", "clear", says="in use")
        self.assertEqual(self.entries(), [name])
        os.close(held)
        self.works("cache", "clear")
        self.assertEqual(os.listdir(self.cache), [])

    # The folder

    def test_a_missing_cache_folder_is_reported(self):
        program.write_nrrd("v.nrrd", program.noise((12, 12, 12)))
        del os.environ["XDG_CACHE_HOME"]
        for home in None, "", "relative":
            if home is None:
                os.environ.pop("HOME", None)
            else:
                os.environ["HOME"] = home
            self.leaves_nothing(1, "render", "v.nrrd", "-o", "x.png", says="XDG_CACHE_HOME")
        os.environ["HOME"] = "/proc"
        self.leaves_nothing(1, "render", "v.nrrd", "-o", "x.png", says="XDG_CACHE_HOME")
        os.environ["HOME"] = self.home
        os.environ["XDG_CACHE_HOME"] = "relative"  # a relative path is ignored
        self.works("render", "v.nrrd", "-o", "one.exr", *SIZE)
        self.cache = os.path.join(self.home, ".cache", "triptych")
        self.assertEqual(len(self.entries()), 1)
        self.assertFalse(os.path.exists("relative/triptych"))

    def test_a_read_only_home_is_reported(self):
        identity = {"user": 65534, "group": 65534, "extra_groups": []} if ROOT else {}
        try:
            able = program.call("--version", **identity).returncode == 0
        except PermissionError:
            able = False
        if not able:
            self.skipTest("another user cannot run the program where it lies")
        os.chmod(self.folder, 0o755)
        os.chmod(self.home, 0o555)
        os.mkdir("open")
        os.chmod("open", 0o777)
        program.write_nrrd("v.nrrd", program.noise((12, 12, 12)))
        self.fails(1, "render", "v.nrrd", "-o", "open/x.png", says="XDG_CACHE_HOME", **identity)

    def test_a_cache_folder_open_to_others_is_refused(self):
        program.write_nrrd("v.nrrd", program.noise((12, 12, 12)))
        self.draw("v.nrrd", bricked=True)
        self.assertEqual(os.stat(self.cache).st_mode & 0o777, 0o700)
        for mode in 0o720, 0o702, 0o777:
            os.chmod(self.cache, mode)
            for command in ("render", "v.nrrd", "-o", "x.png"), ("cache", "list"), ("cache", "clear"):
                self.fails(1, *command, says="chmod 700")
        os.chmod(self.cache, 0o700)
        if ROOT:
            os.chown(self.cache, 65534, 65534)
            self.fails(1, "render", "v.nrrd", "-o", "x.png", says="another user")
            self.fails(1, "cache", "clear", says="another user")
            os.chown(self.cache, 0, 0)
        self.assertEqual(len(self.entries()), 1)

    def test_a_link_to_a_folder_is_a_cache(self):
        program.write_nrrd("v.nrrd", program.noise((12, 12, 12)))
        os.makedirs(os.path.dirname(self.cache))
        other = os.path.join(self.home, "other disk")
        os.makedirs(other, mode=0o700)
        os.symlink("../other disk", self.cache)
        drawn = self.draw("v.nrrd", bricked=True)
        self.same(self.draw("v.nrrd", bricked=False), drawn)
        self.assertTrue(os.path.islink(self.cache))
        self.assertEqual(len([n for n in os.listdir(other) if n.endswith(".trip")]), 1)
        self.assertIn(b"1 data set,", self.works("cache", "list").stdout)
        self.works("cache", "clear")
        self.assertEqual(os.listdir(other), [])
        os.chmod(other, 0o777)  # the folder counts, not the link
        self.fails(1, "render", "v.nrrd", "-o", "x.png", says="chmod 700")
        os.environ["XDG_CACHE_HOME"] = os.path.join(self.home, "linked")
        os.makedirs(os.path.join(self.home, "linked to"))
        os.symlink("linked to", os.environ["XDG_CACHE_HOME"])
        self.draw("v.nrrd", bricked=True)

    def test_an_obstacle_in_place_of_the_cache_folder_is_named_with_a_remedy(self):
        program.write_nrrd("v.nrrd", program.noise((12, 12, 12)))
        home = os.path.dirname(self.cache)
        other = os.path.join(self.home, "file")
        program.write(other, b"precious")
        for target in None, "nowhere", "triptych", other:
            shutil.rmtree(home, ignore_errors=True)
            os.makedirs(home)
            if target:
                os.symlink(target, self.cache)
            else:
                program.write(self.cache, b"precious")
            says = "make that folder, or remove the link" if target else "is no folder; remove it"
            for command in ("render", "v.nrrd", "-o", "x.png"), ("cache", "list"), ("cache", "clear"):
                run = self.fails(1, *command, says=says)
                self.assertIn(self.cache, run.stderr)
            os.remove(self.cache)
            self.draw("v.nrrd", bricked=True)  # the remedy helps
        for name in other, os.path.join(self.home, "dangling"):
            if name != other:
                os.symlink("nowhere", name)
            os.environ["XDG_CACHE_HOME"] = name
            self.fails(1, "render", "v.nrrd", "-o", "x.png", says="set XDG_CACHE_HOME")
        with open(other, "rb") as f:
            self.assertEqual(f.read(), b"precious")

    def test_an_obstacle_in_place_of_an_entry_is_removed_or_named(self):
        """Links, files and empty folders are removed. Their targets and full folders stay."""
        program.write_nrrd("v.nrrd", program.noise((12, 12, 12)))
        wanted = self.draw("v.nrrd", bricked=True)
        (entry,) = self.entries()
        outside = os.path.join(self.home, "outside")
        for suffix in ".trip", ".trip.partial", ".trip.spill", ".trip.replaced", ".gone", ".lock":
            place = os.path.join(self.cache, entry[:-5] + suffix)
            for kind in "link", "dangling", "file", "pipe", "folder", "full":
                with self.subTest(suffix, kind=kind):
                    shutil.rmtree(self.cache)
                    os.makedirs(self.cache, mode=0o700)
                    os.makedirs(outside, exist_ok=True)
                    program.write(os.path.join(outside, "x0.voxels"), b"precious")
                    if kind in ("link", "dangling"):
                        os.symlink(outside if kind == "link" else "nowhere", place)
                    elif kind == "file":
                        program.write(place, b"file")
                    elif kind == "pipe":
                        os.mkfifo(place)
                    else:
                        os.makedirs(os.path.join(place, "deep") if kind == "full" else place)
                    run = program.call("render", "v.nrrd", "-o", "one.exr", *SIZE,
                                       program=program.QUICK_PROGRAM)
                    if run.returncode:
                        self.assertEqual((run.returncode, kind), (1, "full"), run.stderr)
                        self.assertTrue(program.LINE.fullmatch(run.stderr), run.stderr)
                        self.assertIn(place, run.stderr)
                        shutil.rmtree(place)
                        self.works("render", "v.nrrd", "-o", "one.exr", *SIZE)
                    self.same(program.read_exr("one.exr"), wanted)
                    self.assertIn(entry, self.entries())
                    self.assertEqual(os.listdir(outside), ["x0.voxels"])

    def test_foreign_files_in_the_cache_folder_do_no_harm(self):
        """Nothing outside the folder changes. Entries with foreign names stay."""
        program.write_nrrd("v.nrrd", program.noise((12, 12, 12)))
        wanted = self.draw("v.nrrd", bricked=True)
        entry = self.entries()[0]
        key = entry[:-5]
        outside = os.path.join(self.home, "outside")
        inside = lambda *names: os.path.join(self.cache, *names)
        other = lambda digit: digit * 32

        def hostile():
            shutil.rmtree(self.cache)
            shutil.rmtree(outside, ignore_errors=True)
            os.makedirs(os.path.join(outside, "index.trip"))
            program.write(os.path.join(outside, "x0.voxels"), b"precious")
            os.makedirs(self.cache, mode=0o700)
            os.symlink(outside, inside(entry))
            os.symlink(outside, inside(f"{key}.trip.partial"))
            os.symlink(outside, inside(f"{other('1')}.trip"))
            os.symlink(outside, inside(f"{other('1')}.gone"))
            os.mkfifo(inside(f"{other('2')}.trip"))
            os.mkfifo(inside(f"{other('2')}.lock"))
            program.write(inside(f"{other('3')}.trip"), b"file")
            os.makedirs(inside(f"{other('4')}.trip", "deep", "er"))
            os.makedirs(inside(f"{other('5')}.trip"))
            os.symlink(outside, inside(f"{other('5')}.trip", "link"))
            os.symlink("../../outside", inside(f"{other('6')}.link"))
            os.symlink(other("5") + "/../..", inside(f"{other('7')}.link"))
            program.write(inside(f"{other('8')}.link"), b"file")
            os.symlink(os.path.join(outside, "made"), inside(f"{other('9')}.lock"))
            os.makedirs(inside(f"{other('a')}.link"))
            program.write(inside("notes.txt"), b"mine")
            os.makedirs(inside("mine.trip"))

        hostile()
        before = tree(outside)
        for command in ("list",), ("list", "--json"), ("clear",), ("clear",), ("list",):
            run = program.call("cache", *command)
            self.assertIn(run.returncode, (0, 1), run)
            self.assertEqual(tree(outside), before)
        self.assertTrue(os.path.exists(inside("notes.txt")) and os.path.exists(inside("mine.trip")))
        hostile()
        for _ in range(2):
            run = program.call("render", "v.nrrd", "-o", "one.exr", *SIZE)
            self.assertIn(run.returncode, (0, 1), run)
            self.assertEqual(tree(outside), before)
            if run.returncode == 0:
                self.same(program.read_exr("one.exr"), wanted)

    # The command

    def test_cache_list_and_clear_work(self):
        run = self.works("cache", "list")
        self.assertIn(b"0 data sets", run.stdout)
        self.assertIn(b"removed 0 data sets", self.works("cache", "clear").stdout)
        self.assertFalse(os.path.exists(self.cache))
        for name in "first", "second":
            program.write_nrrd(f"{name}.nrrd", program.ball((12, 12, 12), radius=len(name) / 10))
            self.draw(f"{name}.nrrd", bricked=True)
        text = self.works("cache", "list").stdout.decode()
        self.assertIn("2 data sets", text)
        self.assertIn("first.nrrd", text)
        found = json.loads(self.works("cache", "list", "--json").stdout)
        self.assertEqual(found["folder"], self.cache)
        self.assertEqual({d["source"] for d in found["data_sets"]}, {"first.nrrd", "second.nrrd"})
        for d in found["data_sets"]:
            self.assertEqual(d["bytes"], self.size_of(os.path.basename(d["path"])))
            self.works("info", "--verify", d["path"])
        with open(os.path.join(found["data_sets"][0]["path"], "index.trip"), "r+b") as f:
            f.seek(8)  # a data set of an earlier version
            f.write(b"\2")
        run = self.works("cache", "list")
        self.assertIn(b"(damaged, or of another version)", run.stdout)
        self.assertEqual(run.stderr, "")
        self.assertIn(b"removed 2 data sets", self.works("cache", "clear").stdout)
        self.assertEqual(os.listdir(self.cache), [])
        for wrong in [], ["nonsense"], ["list", "clear"], ["clear", "--json"], ["list", "--x"]:
            self.fails(2, "cache", *wrong)

    def test_another_build_of_the_same_version_finds_a_data_set(self):
        program.write_nrrd("ball.nrrd", program.ball((20, 24, 28)))
        self.draw("ball.nrrd", bricked=True)
        shutil.copy(program.PROGRAM, "rebuilt")
        os.utime("rebuilt", (1, 1))
        with open("rebuilt", "ab") as f:
            f.write(b"more")
        run = subprocess.run(
            ["./rebuilt", "render", "ball.nrrd", "-o", "one.exr", *SIZE],
            capture_output=True,
            check=True,
        )
        self.assertNotIn(b"bricked", run.stdout)
        self.assertEqual(len(self.entries()), 1)

    def test_a_transfer_function_can_come_through_a_pipe(self):
        program.write_nrrd("ball.nrrd", program.ball((20, 24, 28)))
        text = b"values data\n20 1 0 0 0\n90 1 0.2 0 0.3\n200 0 0 1 0.6\n"
        pictures = []
        for bricked in True, False:
            out, into = os.pipe()
            os.write(into, text)
            os.close(into)
            run = self.works(
                *("render", "ball.nrrd", "-o", "one.exr", *SIZE, "--tf", f"/dev/fd/{out}"),
                pass_fds=[out],
            )
            os.close(out)
            self.assertEqual(b"bricked" in run.stdout, bricked)
            pictures.append(program.read_exr("one.exr"))
        program.write("f.tf", text)
        wanted = self.draw("ball.nrrd", "--tf", "f.tf", bricked=False)
        self.differ(self.draw("ball.nrrd", bricked=False), wanted)
        for picture in pictures:
            self.same(picture, wanted)
        out, into = os.pipe()
        os.write(into, b"nonsense\n")
        os.close(into)
        pipe = f"/dev/fd/{out}"
        self.fails(1, "render", "ball.nrrd", "-o", "x.png", "--tf", pipe, says=pipe, pass_fds=[out])
        os.close(out)

    # Messages

    def test_notes_are_printed_for_cached_volumes_too(self):
        vdb = os.path.join(program.DATASETS, "densityAndHeat.vdb")
        for bricked in True, False:
            run = self.works("render", vdb, "-o", "one.png", *SIZE)
            self.assertEqual(b"bricked" in run.stdout, bricked)
            self.assertRegex(run.stderr, r'\Atriptych: note: [^\n]*"density" is used[^\n]*\n\Z')
        run = self.works("render", vdb, "-o", "a.png", *SIZE, "--grid=heat")
        self.assertNotIn("is used", run.stderr)

    def test_an_impossible_output_is_reported_before_reading(self):
        program.write_nrrd("ball.nrrd", program.ball((20, 24, 28)))
        os.makedirs("folder.png", exist_ok=True)
        for wrong in (
            ["-o", "missing/x.png"],
            ["-o", "ball.nrrd/x.png"],
            ["-o", "folder.png"],
            ["-o", "x.png", "--stats", "missing/s.json"],
        ):
            self.leaves_nothing(1, "render", "ball.nrrd", *wrong, says=wrong[-1])
        self.assertEqual(self.entries(), [])

    def test_files_that_are_no_volumes_leave_nothing(self):
        program.write("unknown.dat", bytes(range(1, 30)) * 40)
        program.write("plain.raw", bytes(1000))
        self.leaves_nothing(1, "render", "unknown.dat", "-o", "x.png", says="triptych brick unknown.dat --size")
        self.leaves_nothing(2, "render", "plain.raw", "-o", "x.png", says="triptych brick plain.raw --size")
        self.leaves_nothing(1, "render", "missing.nii", "-o", "x.png", says="No such file")
        self.leaves_nothing(1, "render", "missing.trip", "-o", "x.png", says="No such file")
        self.assertEqual(self.entries(), [])

    def test_options_of_volumes_are_refused_for_data_sets(self):
        program.write_nrrd("v.nrrd", program.noise((12, 12, 12)))
        self.brick("v.nrrd", "v.trip")
        for option in (("--allow-gaps",), ("--grid", "a"), ("--level-set", "band"), ("--spacing", "1,1,1"),
                       ("--axes", "PIR"), ("--channel", "0"), ("--series", "1"), ("--time", "1")):
            self.fails(2, "render", "v.trip", "-o", "x.png", *option, says="is a data set")
        self.fails(2, "render", "v.nrrd", "-o", "x.png", "--grid", "a", says="nrrd; --grid requires OpenVDB or netCDF")
        self.fails(2, "render", "v.nrrd", "-o", "x.png", "--level-set", "band", says="nrrd; --level-set requires OpenVDB")


if __name__ == "__main__":
    program.main()
