"""Tests of truncated, damaged, mixed and missing data sets. No damaged part is drawn, the program
never crashes, and `info --verify` finds every changed byte."""
import concurrent.futures
import os
import random
import shutil
import struct

import numpy

import craft
import program

PLANES = "voxels", "normals", "halo"
FILES = ["index.trip", *(f"{axis}0.{plane}" for axis in "xyz" for plane in PLANES)]
VIEW = ("--size", "40x40", "--look", "20,15,10", "--eye", "80,-60,70")


class Damage(program.ProgramTest):
    """Damages copies of the data set a.trip."""

    VIEW = VIEW

    @classmethod
    def make_two(cls, *options):
        """Bricks two volumes into a.trip and b.trip. Draws the good picture of a.trip."""
        for seed, name in (1, "a"), (2, "b"):
            program.write_nrrd(f"{name}.nrrd", program.noise((20, 30, 40), seed=seed))
            run = program.call("brick", f"{name}.nrrd", "-o", f"{name}.trip", "-q",
                               "--range=100:255", *options)
            assert run.returncode == 0
        cls.good = cls.draw(cls, "a.trip")[1]

    def draw(self, path):
        """Draws a data set. Returns the finished process, and the picture or None."""
        output = f"{path}.exr"
        run = program.call("render", path, "-o", output, *self.VIEW, program=program.QUICK_PROGRAM)
        return run, program.read_exr(output) if run.returncode == 0 else None

    def check(self, name, change):
        """Changes a copy of the data set. Verifying must fail. Drawing must fail, or give the right
        picture if it does not read the change."""
        path = f"{name}.trip"
        shutil.copytree("a.trip", path)
        change(path)
        runs = [program.call("info", "--verify", path)]
        drawn, picture = self.draw(path)
        runs.append(drawn)
        about = f"{name}: {[(r.returncode, r.stderr) for r in runs]}"
        assert runs[0].returncode == 1 and program.LINE.fullmatch(runs[0].stderr), about
        if drawn.returncode:
            assert drawn.returncode == 1 and program.LINE.fullmatch(drawn.stderr), about
            assert not os.path.exists(f"{path}.exr"), about
        else:
            assert numpy.array_equal(picture, self.good), about
            os.remove(f"{path}.exr")
        run = program.call("info", path)
        assert run.returncode == 0 or program.LINE.fullmatch(run.stderr), run.stderr
        shutil.rmtree(path, ignore_errors=True)

    def check_all(self, changes):
        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            waiting = [
                pool.submit(self.check, f"{i:03d}", change) for i, change in enumerate(changes)
            ]
        faults = [str(w.exception()) for w in waiting if w.exception()]
        self.assertEqual(faults, [], "\n".join(faults))

    def hostile(self, change):
        """Changes the index of a copy, with valid checksums. Returns the path."""
        data = craft.Dataset("a.trip")
        change(data)
        shutil.rmtree("hostile.trip", ignore_errors=True)
        shutil.copytree("a.trip", "hostile.trip")
        data.write("hostile.trip")
        return "hostile.trip"


class FileTests:
    """Tests of each file of FILES."""

    def test_files_of_wrong_length_are_found(self):
        changes = []
        for name in self.FILES:
            size = os.path.getsize(f"a.trip/{name}")
            for length in sorted({0, 1023, size // 2, size - 1, size + 1}):
                changes.append(lambda path, n=name, l=length: os.truncate(f"{path}/{n}", l))
        self.check_all(changes)

    def test_damaged_bytes_are_found(self):
        chance = random.Random(5)
        changes = []
        for name in self.FILES:
            size = os.path.getsize(f"a.trip/{name}")
            places = [chance.randrange(size) for _ in range(3)]
            if name == "index.trip":
                places += [chance.randrange(300) for _ in range(15)]
            for place in places:

                def change(path, n=name, p=place, bit=1 << chance.randrange(8)):
                    with open(f"{path}/{n}", "r+b") as f:
                        f.seek(p)
                        byte = f.read(1)[0]
                        f.seek(p)
                        f.write(bytes([byte ^ bit]))

                changes.append(change)
        self.check_all(changes)

    def test_missing_and_exchanged_files_are_found(self):
        changes = []
        for name in self.FILES:

            def swap(path, n=name):
                shutil.copy(f"b.trip/{n}", f"{path}/{n}")

            def folder(path, n=name):
                os.remove(f"{path}/{n}")
                os.mkdir(f"{path}/{n}")

            def dangling(path, n=name):
                os.remove(f"{path}/{n}")
                os.symlink("nowhere", f"{path}/{n}")

            changes += [lambda path, n=name: os.remove(f"{path}/{n}"), swap, folder, dangling]
        changes.append(lambda path: os.replace(f"{path}/{self.FILES[-3]}", f"{path}/{self.FILES[-1]}"))
        self.check_all(changes)


class BadDatasets(FileTests, Damage):
    FILES = FILES

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.make_two("--normals=stored")
        assert sorted(os.listdir("a.trip")) == sorted(FILES)

    def test_numbers_that_no_grid_has_are_refused_with_valid_checksums(self):
        def set_step(value):
            return lambda d: d.put("<3d", 208, *[value] * 3)

        def set_map(column, value):
            def change(d):
                for at in [72, *(d.list_at(n) + 40 for n in range(d.lists))]:
                    d.put("<d", at + 8 * column, value)
            return change

        def set_size(voxels):
            def change(d):
                for axis in range(3):
                    d.put("<Q", 48 + 8 * axis, voxels)
                    for number in range(d.lists):
                        d.put("<Q", d.list_at(number) + 16 + 8 * axis, voxels)
            return change

        self.assertEqual(craft.Dataset("a.trip").number("<I", 284), 3)  # bytes of a normal
        for change, says in (
            *((set_step(v), "the gradient step is too large") for v in (1e6, 1e19, 1e38, 1e308)),
            *((set_map(3, v), "too far from the origin") for v in (1.2e15, -1e30, 1e300)),
            *((set_map(0, v), "too small or too large") for v in (1e-300, 1e-33, 1e33, 1e150)),
            *((set_size(v), "grid size outside 1 to 16777216") for v in (2**24 + 1, 2**31 - 1)),
        ):
            path = self.hostile(change)
            self.fails(1, "info", path, says=says)
            for renderer in "reference", "cpu", "integral", *program.GL:
                self.fails(1, "render", path, "-o", "no.exr", "--renderer", renderer, *VIEW,
                           says=says, program=program.QUICK_PROGRAM)
        self.assertFalse(os.path.exists("no.exr"))

    def test_random_hostile_numbers_give_a_picture_or_a_line(self):
        """Numbers of the header change under valid checksums. A picture is finite."""
        chance = random.Random(int(os.environ.get("TRIP_SEED", 7)))
        reals = 0, -1, 5e-324, 1e-300, 1e-40, 1e-12, 1e12, 1e20, 1e38, 1e40, 1e150, 1e300
        renderers = "cpu", "reference", "integral", *program.GL
        for number in range(24 * int(os.environ.get("TRIP_LONGER", 1))):
            where = chance.choice((168, 176, 184, 192, 208, 216, 224, 232, 344, 352, "map", "scale"))
            value = chance.choice(reals)

            def change(d):
                maps = [72, *(d.list_at(n) + 40 for n in range(d.lists))]
                column = chance.randrange(12)
                if where == "map":
                    for at in maps:
                        d.put("<d", at + 8 * column, value)
                elif where == "scale":
                    for at in maps:
                        row = struct.unpack_from("<12d", d.index, at)
                        d.put("<12d", at, *(x * abs(value) for x in row))
                else:
                    d.put("<d", where, value)

            path, renderer = self.hostile(change), chance.choice(renderers)
            run = program.call("render", path, "-o", "h.exr", "--renderer", renderer, "--size",
                               "16x16", "--no-shading" if chance.random() < 0.3 else "--roll=5",
                               program=program.QUICK_PROGRAM)
            about = (number, where, value, renderer, run.returncode, run.stderr)
            self.assertIn(run.returncode, (0, 1, 2), about)
            if run.returncode:
                self.assertTrue(program.LINE.fullmatch(run.stderr.splitlines(True)[-1]), about)
                self.assertNotIn("not a finite number", run.stderr, about)
            else:
                picture = program.read_linear_exr("h.exr")
                self.assertTrue(numpy.isfinite(picture).all(), about)
                self.assertTrue(picture[..., 3].max() > 0 or "warning" in run.stderr, about)

    def test_other_paths_are_refused(self):
        os.mkdir("empty.trip")
        os.mkdir("zeros.trip")
        for name in FILES:
            program.write(f"zeros.trip/{name}", bytes(4096))
        program.write("file.trip", b"TRIPTYCH" + bytes(2000))
        for path in (
            "empty.trip",
            "zeros.trip",
            "file.trip",
            "missing.trip",
            "a.trip/index.trip",
            ".",
            "/",
            "/dev/null",
            "a.trip/x0.voxels",
            "a.nrrd",
            "a.nrrd/x.trip",
            "y" * 4090,
        ):
            drawable = path in (".", "a.nrrd")  # a folder of pictures and a volume
            self.fails(1 if path.endswith(".trip") else 2, "info", "--verify", "--json", path)
            if not drawable:
                self.fails(1, "info", path)
            if not drawable:
                self.fails(1, "render", path, "-o", "no.png")
        self.assertFalse(os.path.exists("no.png"))

    def test_a_slash_after_the_name_is_ignored(self):
        self.assertEqual(self.info("a.trip/")["kept"], self.info("a.trip")["kept"])
        self.assertTrue(numpy.array_equal(self.picture("./a.trip/", *VIEW), self.good))


class BadDeviations(FileTests, Damage):
    """The deviations of coarse values. The view draws level 1 alone."""

    FILES = ["x1.values", *(f"{axis}1.deviations" for axis in "xyz")]
    VIEW = (*VIEW, "--lod=100", "--ortho=50")

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.make_two("--levels=1")

    @staticmethod
    def put_maxima(data, byte):
        """Changes the maximum deviation of every brick."""
        for number, names in enumerate(data.names):
            for brick in data.bricks(number) if 2 in names else ():
                data.put("<B", brick + 22, byte)

    @classmethod
    def fill(cls, data, byte):
        cls.put_maxima(data, byte)
        for name, plane in data.planes.items():
            if name.endswith(".deviations"):
                plane[:] = bytes([byte]) * len(plane)

    @classmethod
    def old(cls, data):
        """Makes a data set of version 6, which has no deviations."""
        cls.put_maxima(data, 0)
        data.put("<I", 8, 6)
        data.put("<I", 276, data.number("<I", 276) & 3)
        for number, names in enumerate(data.names):
            at = data.list_at(number)
            if 2 in names:
                del data.planes[names.pop(2)]
                data.put("<I", at + 12, 1)
                data.put("<Q", at + 200 + 16, 0)
                data.put("<Q", at + 232 + 16, 0)

    def test_the_view_draws_the_level(self):
        run = self.works("render", "a.trip", "-o", "a.png", "--explain", *self.VIEW)
        self.assertIn(b"1 values read", run.stdout)

    def test_every_deviation_is_valid(self):
        for byte in 0, 1, 128, 255:
            path = self.hostile(lambda data, b=byte: self.fill(data, b))
            self.works("info", "--verify", path)
            for renderer in "cpu", "reference", *program.GL:
                picture = self.picture(path, *self.VIEW, "--renderer", renderer)
                self.assertTrue(numpy.isfinite(picture).all())
                self.assertGreater(picture[..., 3].max(), 0)

    def test_deviations_above_the_maximum_are_found(self):
        self.fails(1, "info", "--verify", self.hostile(lambda data: self.put_maxima(data, 0)),
                   says="a deviation is larger than the maximum of its brick")

    def test_lists_with_other_deviations_are_found(self):
        def change(data):
            self.put_maxima(data, 255)
            data.planes["y1.deviations"][7] ^= 1

        self.fails(1, "info", "--verify", self.hostile(change),
                   says="the lists of values along x and y at level 1 differ in their records")

    def test_numbers_that_deviations_cannot_have_are_refused(self):
        data = craft.Dataset("a.trip")
        (number,) = (n for n, names in enumerate(data.names) if names.get(2) == "z1.deviations")
        at, bytes_ = data.list_at(number), len(data.planes["z1.deviations"])
        for change, says in (
            (lambda d: d.put("<Q", at + 200 + 16, bytes_ - 1), "planes do not match its records"),
            (lambda d: d.put("<Q", at + 200 + 16, bytes_ + 1), "planes do not match its records"),
            (lambda d: d.put("<Q", at + 200 + 16, 2**64 - 1), "planes do not match its records"),
            (lambda d: d.put("<I", at + 12, 1), "does not have the planes of its kind"),
            (lambda d: d.put("<I", 276, 1), "does not have the planes of its kind"),
            (lambda d: d.put("<I", 8, 6), "unknown planes"),
            (lambda d: d.put("<I", 276, 13), "unknown planes"),
        ):
            path = self.hostile(change)
            self.fails(1, "info", path, says=says)
            self.fails(1, "render", path, "-o", "no.exr", *self.VIEW, says=says)
        self.assertFalse(os.path.exists("no.exr"))

    def test_data_sets_of_version_6_draw_as_if_all_deviations_were_0(self):
        zero, path = self.hostile(lambda data: self.fill(data, 0)), self.hostile(self.old)
        for axis in "xyz":
            os.remove(f"{path}/{axis}1.deviations")
        self.works("info", "--verify", path)
        self.assertEqual(self.info(path)["format_version"], 6)
        # a blurred function is looked up in a table, and a plain one can have a closed form
        for renderer in "cpu", *program.GL:
            view = *self.VIEW, "--renderer", renderer
            old, none, some = (self.picture(of, *view) for of in (path, zero, "a.trip"))
            self.assertLess(255 * abs(old - none).max(), 0.5)
            self.assertGreater(255 * abs(old - some).max(), 2)
            for of, blurs in (path, False), ("a.trip", True):
                run = self.works("render", of, "-o", "a.png", "--explain", *view)
                self.assertEqual(b"deviations of coarse values blur" in run.stdout, blurs)


if __name__ == "__main__":
    program.main()
