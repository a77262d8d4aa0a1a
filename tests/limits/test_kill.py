"""Tests kill -9 at random moments while a data set is made, and --resume. The data set is complete
with the same bytes, or absent."""
import os
import random
import shutil
import subprocess
import time

import limits


class Kill(limits.Test):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.random = random.Random(limits.option("seed", 1))
        cls.volume = cls.path("v.nrrd")
        limits.run("triptych-generate", "cloud", "--size", limits.option("size", 128), "--type",
                   "uint16", "-o", cls.volume)
        cls.work = cls.path("work")
        os.mkdir(cls.work)
        cls.name = os.path.join(cls.work, "d.trip")
        cls.arguments = ["brick", cls.volume, "-o", cls.name, "-q", "--range", "5000:",
                         "--memory", limits.option("memory", "40M")]

    def setUp(self):
        shutil.rmtree(self.work)
        os.mkdir(self.work)
        r = self.works("triptych", *self.arguments)
        self.seconds = r.seconds
        self.wanted = limits.folder_hashes(self.name)
        shutil.rmtree(self.name)

    def kill_at(self, seconds, *arguments):
        """Kills the program after `seconds`. Returns False if it had ended before."""
        child = subprocess.Popen([limits.program("triptych"), *self.arguments, *arguments],
                                 stdin=subprocess.DEVNULL, stderr=subprocess.PIPE)
        try:
            child.wait(seconds)
        except subprocess.TimeoutExpired:
            pass
        child.kill()
        said = child.communicate()[1]
        self.assertIn(child.returncode, (0, -9), said)
        return child.returncode != 0

    def leave_half_made(self, share, *arguments):
        """Kills the program at this fraction of its time, or earlier if it was already complete."""
        while not self.kill_at(share * self.seconds, *arguments) or os.path.exists(self.name):
            shutil.rmtree(self.name)
            share *= 0.7

    def check_absent_or_complete(self):
        if os.path.exists(self.name):
            self.assertEqual(limits.folder_hashes(self.name), self.wanted)

    def test_a_data_set_is_resumed_after_any_number_of_kills(self):
        moments = limits.rounds(100)
        killed = resumed = complete = 0
        while killed < moments:
            if self.kill_at(self.random.uniform(0, 1.1 * self.seconds), "--resume"):
                killed += 1
            self.check_absent_or_complete()
            if not os.path.exists(self.name) and self.random.random() < 0.4:
                self.works("triptych", *self.arguments, "--resume")
                self.check_absent_or_complete()
                self.assertEqual(os.listdir(self.work), ["d.trip"])
                resumed += 1
            if os.path.exists(self.name):
                complete += 1
                shutil.rmtree(self.name)
        self.note(f"killed {killed} times within {self.seconds:.2f} s, finished {complete} times, "
                  f"{resumed} of them undisturbed")

    def test_a_kill_during_replacement_leaves_one_data_set(self):
        """The old or the new data set remains, never a mixture."""
        other = self.path("old.trip")
        self.works("triptych", "brick", self.volume, "-o", other, "-q", "--range", "30000:")
        old = limits.folder_hashes(other)
        seen = set()
        for _ in range(limits.rounds(15)):
            if not os.path.exists(self.name):
                shutil.copytree(other, self.name)
            self.kill_at(self.random.uniform(0, 1.1 * self.seconds), "--force")
            now = limits.folder_hashes(self.name)
            self.assertIn(now, [old, self.wanted])
            if now == self.wanted:
                shutil.rmtree(self.name)
            seen.add(now == old)
        self.works("triptych", *self.arguments, "--force")
        self.assertEqual(os.listdir(self.work), ["d.trip"])

    def test_other_memory_and_threads_resume_with_the_same_bytes(self):
        for memory, threads in ("64M", 1), ("200M", 3), ("40M", 4):
            self.leave_half_made(0.7)
            self.works("triptych", *self.arguments, "--resume", "--memory", memory, "--threads",
                       threads)
            self.check_absent_or_complete()
            shutil.rmtree(self.name)

    def test_files_of_another_command_are_not_resumed(self):
        for change in ["--range", "20000:"], ["--tile", "32"], ["--normals=none"], ["--halo=0"]:
            self.leave_half_made(0.8, *change)
            r = limits.run("triptych", *self.arguments, "--resume")
            if r.status:  # the program refuses, and starts again only without --resume
                self.assertRefused(r)
                self.works("triptych", *self.arguments)
            self.check_absent_or_complete()
            shutil.rmtree(self.name)

    def test_a_changed_input_is_not_resumed(self):
        self.leave_half_made(0.8)
        changed = limits.read_bytes(self.volume)
        time.sleep(0.01)
        with open(self.volume, "r+b") as f:
            f.seek(len(changed) // 2)
            f.write(bytes([changed[len(changed) // 2] ^ 0x80]))
        # A data set names its volume relative to its own folder: both folders are siblings.
        os.makedirs(self.path("other"), exist_ok=True)
        fresh = os.path.join(self.path("other"), "fresh.trip")
        self.works("triptych", *self.arguments[:2], "-o", fresh, *self.arguments[4:])
        r = limits.run("triptych", *self.arguments, "--resume")
        if r.status:
            self.assertRefused(r)
            self.works("triptych", *self.arguments)
        self.assertEqual(limits.folder_hashes(self.name), limits.folder_hashes(fresh))


if __name__ == "__main__":
    limits.main()
