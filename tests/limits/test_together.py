"""Tests two processes on one data set: drawing while it is replaced, and making it at the same
time."""
import os
import shutil
import subprocess
import threading

import limits


class Together(limits.Test):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.volume = cls.path("v.nrrd")
        limits.run("triptych-generate", "shells", "--size", "96", "-o", cls.volume)

    def start(self, *arguments):
        return subprocess.Popen([limits.program("quick"), *map(str, arguments)],
                                stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                                stderr=subprocess.PIPE, text=True)

    def test_many_processes_draw_the_same_data_set(self):
        data = self.brick(self.volume, "one.trip")
        wanted = self.draw(data, size="100x100")
        for _ in range(5):
            paths = [self.path(f"p{i}.exr") for i in range(4)]
            children = [self.start("render", data, "-o", p, "--size", "100x100", "--renderer", "cpu",
                                   "--engine", ["io_uring", "pread", "null", "auto"][i])
                        for i, p in enumerate(paths)]
            for child, path in zip(children, paths):
                self.assertEqual((child.communicate()[1], child.returncode), ("", 0))
                self.assertEqual(limits.picture_hash(path), wanted)

    def test_drawing_during_replacement_shows_the_old_or_the_new(self):
        data = self.brick(self.volume, "replaced.trip", "--tf", "preset:fog")
        other = self.brick(self.volume, "other.trip", "--tf", "preset:vessels", "--tile", 32)
        wanted = {self.draw(data, size="60x60"), self.draw(other, size="60x60")}
        self.assertEqual(len(wanted), 2)
        stop = threading.Event()
        said = []

        def replace():
            for i in range(1000):
                if stop.is_set():
                    return
                tf, tile = (("fog", 64), ("vessels", 32))[(i + 1) % 2]
                r = limits.run("triptych", "brick", self.volume, "-o", data, "-q", "--force", "--tf",
                               f"preset:{tf}", "--tile", tile)
                if r.status or r.err:
                    said.append(r.err)

        thread = threading.Thread(target=replace)
        thread.start()
        seen = set()
        failures = 0
        path = self.path("r.exr")
        for _ in range(limits.rounds(30)):
            r = limits.run("quick", "render", data, "-o", path, "--size", "60x60", "--renderer",
                           "cpu")
            if r.status == 0:
                seen.add(limits.picture_hash(path))
            else:  # the data set was opened at the moment of replacement
                self.assertRefused(r, "replaced.trip")
                failures += 1
        stop.set()
        thread.join()
        self.assertEqual(said, [])
        self.assertLessEqual(seen, wanted)
        self.note(f"{failures} of {limits.rounds(30)} runs met the moment of replacement")
        self.works("triptych", "info", "--verify", data)

    def test_two_processes_make_the_same_data_set(self):
        """One process makes it, or both do one after the other. The result is complete."""
        name = self.path("made.trip")
        wanted = limits.folder_hashes(self.brick(self.volume, "wanted.trip"))
        for arguments in [], ["--force"], ["--resume"]:
            for _ in range(5):
                children = [self.start("brick", self.volume, "-o", name, "-q", *arguments)
                            for _ in range(2)]
                said = [child.communicate()[1] for child in children]
                codes = [child.returncode for child in children]
                self.assertIn(0, codes, said)
                for code, text in zip(codes, said):
                    self.assertRegex(text, r"\Atriptych: [^\n]+\n\Z" if code else r"\A\Z")
                self.assertEqual(limits.folder_hashes(name), wanted, said)
                left = [n for n in os.listdir(self.folder) if n.startswith("made.")]
                self.assertEqual(left, ["made.trip"], said)
                shutil.rmtree(name)


if __name__ == "__main__":
    limits.main()
