"""Tests a disk that fills up while a data set is made. There is one error line, and nothing
remains."""
import os
import subprocess

import limits


class DiskFull(limits.Test):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.volume = cls.path("v.nrrd")
        limits.run("triptych-generate", "marschner-lobb", "--size", "96", "-o", cls.volume)
        cls.disk = cls.path("disk")
        os.mkdir(cls.disk)

    def run_on_disk(self, mebibytes, commands):
        """Runs shell commands in a mount namespace in which `disk` has this size."""
        script = (f"mount -t tmpfs -o size={mebibytes}m none '{self.disk}' && cd '{self.disk}' "
                  f"|| exit 1\n{commands}")
        return subprocess.run(["unshare", "--mount", "--map-root-user", "sh", "-c", script],
                              stdin=subprocess.DEVNULL, capture_output=True, text=True)

    def setUp(self):
        try:
            r = self.run_on_disk(1, "true")
        except FileNotFoundError:
            self.skipTest("unshare (util-linux) is missing")
        if r.returncode:
            self.skipTest(f"a small disk cannot be mounted here: {r.stderr.strip()}")

    def brick(self, mebibytes, *arguments):
        """Runs brick on the small disk. Returns its exit status, its stderr, and the names of the
        remaining files."""
        command = " ".join([f"'{limits.program('triptych')}' brick '{self.volume}' -o d.trip -q",
                            *(arguments or ["--keep-all"])])
        r = self.run_on_disk(mebibytes, f"{command}; echo status $?; ls -A")
        status, *left = r.stdout.split("\n", 1)
        return int(status.split()[1]), r.stderr, left[0].split()

    def test_bricking_on_a_small_disk_leaves_no_data_set(self):
        for mebibytes, *arguments in (
                # with normals the data set has 96^3 * 3 * 4 bytes and masks, which is 10.3 MiB
                *([mebibytes, "--keep-all", "--normals=compact"]
                  for mebibytes in (1, 2, 4, 6, 8, 9, 10)),
                [1], [2],
                # this range makes a halo
                [1, "--range=100:160"], [2, "--range=100:160", "--normals=compact"]):
            with self.subTest(mebibytes=mebibytes, arguments=arguments):
                status, said, left = self.brick(mebibytes, *arguments)
                self.assertIn(status, limits.FAILED, said)
                self.assertRegex(said, r"\Atriptych: [^\n]+\n\Z")
                self.assertRegex(said, r"[Nn]o space|disk|free")
                self.assertNotIn("d.trip", left)

    def test_bricking_with_enough_room_works(self):
        status, said, left = self.brick(64)
        self.assertEqual((status, said, left), (0, "", ["d.trip"]))

    def test_a_disk_that_others_fill_leaves_no_data_set(self):
        """The disk fills up only after brick has checked the free space."""
        brick = (f"'{limits.program('triptych')}' brick '{self.volume}' -o d.trip --keep-all -q "
                 "--memory 40M")
        fill = "head -c 200M /dev/zero >fill 2>/dev/null"
        for delay in "0", "0.05", "0.1", "0.2":
            r = self.run_on_disk(64, f"{brick} & (sleep {delay}; {fill}); wait $!; echo status $?; "
                                     f"rm fill; ls -A; '{limits.program('triptych')}' info "
                                     "--verify d.trip")
            if "status 0" in r.stdout:
                self.assertIn("d.trip\n", r.stdout)
                self.assertEqual(r.stderr, "")
            else:
                self.assertRegex(r.stderr, r"\Atriptych: [^\n]+\ntriptych: [^\n]*d\.trip[^\n]*\n\Z")
                self.assertNotIn("d.trip\n", r.stdout.replace("d.trip.partial", ""))

    def test_a_picture_that_does_not_fit_leaves_nothing(self):
        r = self.run_on_disk(64, f"'{limits.program('triptych')}' brick '{self.volume}' -o d.trip "
                                 "-q --keep-all && (head -c 200M /dev/zero >fill 2>/dev/null; "
                                 f"'{limits.program('triptych')}' render d.trip -o p.exr; "
                                 "echo status $?; ls -A)")
        self.assertRegex(r.stdout, r"\Astatus [12]\nd\.trip\nfill\n\Z")
        self.assertRegex(r.stderr, r"\Atriptych: [^\n]*p\.exr[^\n]*\n\Z")


if __name__ == "__main__":
    limits.main()
