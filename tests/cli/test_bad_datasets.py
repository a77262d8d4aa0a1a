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


class BadDatasets(program.ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        program.write_nrrd("a.nrrd", program.noise((20, 30, 40)))
        program.write_nrrd("b.nrrd", program.noise((20, 30, 40), seed=2))
        for name in "a", "b":
            assert (
                program.call(
                    "brick", f"{name}.nrrd", "-o", f"{name}.trip", "-q", "--range=100:255",
                    "--normals=stored"
                ).returncode
                == 0
            )
        assert sorted(os.listdir("a.trip")) == sorted(FILES)
        cls.good = cls.draw(cls, "a.trip")[1]

    def draw(self, path):
        """Draws a data set. Returns the finished process, and the picture or None."""
        output = f"{path}.exr"
        run = program.call("render", path, "-o", output, *VIEW, program=program.QUICK_PROGRAM)
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

    def test_files_of_wrong_length_are_found(self):
        changes = []
        for name in FILES:
            size = os.path.getsize(f"a.trip/{name}")
            for length in sorted({0, 1023, size // 2, size - 1, size + 1}):
                changes.append(lambda path, n=name, l=length: os.truncate(f"{path}/{n}", l))
        self.check_all(changes)

    def test_damaged_bytes_are_found(self):
        chance = random.Random(5)
        changes = []
        for name in FILES:
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
        for name in FILES:

            def swap(path, n=name):
                shutil.copy(f"b.trip/{n}", f"{path}/{n}")

            def folder(path, n=name):
                os.remove(f"{path}/{n}")
                os.mkdir(f"{path}/{n}")

            def dangling(path, n=name):
                os.remove(f"{path}/{n}")
                os.symlink("nowhere", f"{path}/{n}")

            changes += [lambda path, n=name: os.remove(f"{path}/{n}"), swap, folder, dangling]
        changes.append(lambda path: os.replace(f"{path}/x0.voxels", f"{path}/y0.voxels"))
        self.check_all(changes)

    def hostile(self, change):
        """Changes the index of a copy, with valid checksums. Returns the path."""
        data = craft.Dataset("a.trip")
        change(data)
        shutil.rmtree("hostile.trip", ignore_errors=True)
        shutil.copytree("a.trip", "hostile.trip")
        data.write("hostile.trip")
        return "hostile.trip"

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


if __name__ == "__main__":
    program.main()
