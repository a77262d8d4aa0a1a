"""Tests damaged, exchanged, missing and unreadable files. The program prints an error that names
the file and the offset, or draws the same picture. It never draws another picture, and never
crashes."""
import os
import random
import re
import shutil
import subprocess

import limits

SIZE = "48x40"
FLIPS = 20  # test_broken.c tries many more, without a process for each


class Faults(limits.Test):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.random = random.Random(limits.option("seed", 1))
        function = cls.path("upper.tf")  # this transfer function hides values, so that there is a halo
        with open(function, "w") as f:
            f.write("0 0 0 0 0\n100 0 0 0 0\n101 1 1 1 0.5\n255 1 1 1 0.5\n")
        for name, field in ("a", "shells"), ("b", "marschner-lobb"):
            volume = cls.path(name + ".nrrd")
            limits.run("triptych-generate", field, "--size", "56x44x60", "-o", volume)
            limits.run("triptych", "brick", volume, "-o", cls.path(name + ".trip"), "-q",
                       "--tf", function)
        cls.good = cls.path("a.trip")

    def setUp(self):
        self.data = self.path("damaged.trip")
        shutil.rmtree(self.data, ignore_errors=True)
        shutil.copytree(self.good, self.data)
        self.wanted = self.draw(self.good, size=SIZE)
        self.renders = 0

    def random_file(self):
        return self.random.choice(sorted(os.listdir(self.data)))

    def restore(self, name):
        shutil.copyfile(os.path.join(self.good, name), os.path.join(self.data, name))

    def judge(self, name, what, renderer="cpu", must_fail=False):
        """Checks that drawing fails with an error that names the file, or gives the same
        picture."""
        path = self.path("o.exr")
        engine = self.random.choice(["io_uring", "pread", "null"])
        r = limits.run("quick", "render", self.data, "-o", path, "--size", SIZE, "--renderer",
                       renderer, "--engine", engine)
        self.renders += 1
        if r.status == 0 and not must_fail:
            self.assertEqual(limits.picture_hash(path), self.wanted, what)
            os.remove(path)
            return 0
        self.assertRefused(r)
        self.assertIn(os.path.join(self.data, name), r.err, what)
        self.assertFalse(os.path.exists(path), what)
        return 1

    def verify(self, name, what):
        """Checks that `info --verify` fails and names the file."""
        r = self.fails("triptych", "info", "--verify", self.data)
        self.assertIn(os.path.join(self.data, name), r.err, what)
        return r

    def test_flipped_bits_are_found_or_do_not_matter(self):
        found = 0
        count = limits.rounds(FLIPS)
        for _ in range(count):
            name = self.random_file()
            path = os.path.join(self.data, name)
            data = bytearray(limits.read_bytes(path))
            at = self.random.randrange(min(len(data), self.random.choice([1024, len(data)])))
            data[at] ^= 1 << self.random.randrange(8)
            with open(path, "wb") as f:
                f.write(data)
            found += self.judge(name, f"{name} byte {at}")
            place = re.search(r"byte (\d+)", self.verify(name, f"{name} byte {at}").err)
            if name != "index.trip":  # the message names the start of the page
                self.assertTrue(int(place[1]) <= at < int(place[1]) + 65536, (name, at, place[1]))
            self.restore(name)
        self.note(f"{count} bytes flipped: {found} errors, {count - found} same pictures")

    def test_overwritten_and_moved_parts_are_found(self):
        for i in range(limits.rounds(FLIPS) // 5):
            name = self.random_file()
            path = os.path.join(self.data, name)
            data = bytearray(limits.read_bytes(path))
            length = min(len(data), self.random.choice([8, 512, 4096, 16384]))
            at = self.random.randrange(len(data) - length + 1) // 8 * 8
            source = self.random.randrange(len(data) - length + 1) // 8 * 8
            part = [bytes(length), self.random.randbytes(length), data[source:source + length]][i % 3]
            if data[at:at + length] == part:
                continue
            data[at:at + length] = part
            with open(path, "wb") as f:
                f.write(data)
            self.judge(name, f"{name} {length} bytes from {at}")
            self.verify(name, f"{name} {length} bytes from {at}")
            self.restore(name)

    def test_files_of_wrong_length_are_found(self):
        for name in sorted(os.listdir(self.data)):
            path = os.path.join(self.data, name)
            size = os.path.getsize(path)
            lengths = {0, size - 1, size + 4096}  # test_broken.c tries more lengths
            lengths |= {self.random.randrange(size) for _ in range(limits.rounds(1))}
            for length in sorted(lengths):
                os.truncate(path, length)
                self.judge(name, f"{name} cut to {length} bytes", must_fail=True)
                self.restore(name)

    def test_files_of_another_data_set_are_found(self):
        other = self.path("b.trip")
        for name in sorted(os.listdir(self.data)):
            # test_broken.c tries all files of the same data set.
            mine = self.random.choice(sorted(n for n in os.listdir(self.good) if n != name))
            for source in os.path.join(other, name), os.path.join(self.good, mine):
                shutil.copyfile(source, os.path.join(self.data, name))
                if name == "index.trip":  # the planes do not match this index
                    self.fails("triptych", "info", "--verify", self.data, says=self.data)
                    self.judge("", f"{source} as {name}", must_fail=True)
                else:
                    self.verify(name, f"{source} as {name}")
                    self.judge(name, f"{source} as {name}")
                self.restore(name)

    def test_missing_and_irregular_files_are_refused(self):
        def folder(path):
            os.mkdir(path)

        def pipe(path):
            os.mkfifo(path)

        def dangling(path):
            os.symlink("nowhere", path)

        def loop(path):
            os.symlink(path, path)

        for name in sorted(os.listdir(self.data)):
            path = os.path.join(self.data, name)
            for make in None, folder, pipe, dangling, loop:
                os.remove(path)
                if make:
                    make(path)
                self.judge(name, f"{name} {make}", must_fail=True)
                if make is folder:
                    os.rmdir(path)
                elif make:
                    os.remove(path)
                self.restore(name)

    def test_unreadable_files_are_refused(self):
        """Root can read everything, so that the test runs as another user."""
        as_user = {}
        if os.geteuid() == 0:
            as_user = {"user": 65534, "group": 65534, "extra_groups": []}
            os.chmod(self.folder, 0o777)
        try:
            subprocess.run([limits.program("triptych"), "--version"], check=True,
                           stdout=subprocess.DEVNULL, **as_user)
        except OSError as e:
            self.skipTest(f"the program cannot be run by another user here: {e}")
        path = self.path("o.png")
        for name in sorted(os.listdir(self.data)):
            os.chmod(os.path.join(self.data, name), 0)
            self.fails("triptych", "render", self.data, "-o", path, says=[name, "ermission"], **as_user)
            os.chmod(os.path.join(self.data, name), 0o644)
        os.chmod(self.data, 0)
        self.fails("triptych", "render", self.data, "-o", path, says="ermission", **as_user)
        os.chmod(self.data, 0o755)
        os.chmod(self.folder, 0o555)
        self.fails("triptych", "render", self.data, "-o", path, says="ermission", **as_user)
        self.fails("triptych", "brick", self.path("a.nrrd"), "-o", self.path("n.trip"),
                   says="ermission", **as_user)
        os.chmod(self.folder, 0o755)


if __name__ == "__main__":
    limits.main()
