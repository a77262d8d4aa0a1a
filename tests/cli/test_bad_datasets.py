"""Tests of truncated, damaged, mixed and missing data sets. No damaged part is drawn, the program
never crashes, and `info --verify` finds every changed byte."""
import concurrent.futures
import os
import random
import shutil

import numpy

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
