"""Tests output on a terminal: progress with rate and time left, and Ctrl-C, which stops the program
cleanly."""
import os
import pty
import re
import signal
import subprocess
import threading

import limits

# An error line replaces the rest of the progress line.
END = r"\x1b\[K\r\n(\r\x1b\[K)?\Z"


class Terminal(limits.Test):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.volume = cls.path("v.nrrd")
        limits.run("triptych-generate", "marschner-lobb", "--size", "128", "-o", cls.volume)
        cls.data = cls.path("d.trip")
        limits.run("triptych", "brick", cls.volume, "-o", cls.data, "-q", "--keep-all", "--tf",
                   "preset:xray")
        cls.picture = cls.path("p.exr")
        cls.work = cls.path("work")
        os.mkdir(cls.work)

    def on_terminal(self, arguments, until=None, keys=b""):
        """Runs the program on a terminal. Types `keys` once `until` is visible. Returns the exit
        status and all output."""
        child, terminal = pty.fork()
        if child == 0:
            os.execv(limits.program("triptych"), ["triptych", *map(str, arguments)])
        watch = threading.Timer(limits.HANGS_SECONDS, os.kill, [child, signal.SIGKILL])
        watch.start()
        shown = b""
        typed = until is None
        while True:
            try:
                more = os.read(terminal, 65536)
            except OSError:  # end of the terminal
                break
            if not more:
                break
            shown += more
            if not typed and re.search(until, shown):
                os.write(terminal, keys)
                typed = True
        status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        watch.cancel()
        os.close(terminal)
        self.assertTrue(typed, shown)
        return status, shown.decode()

    def slow_frame(self):
        """Returns options of a frame that takes many seconds, with every ray near the centres of
        splats."""
        return ["render", self.data, "-o", self.picture, "--renderer", "reference", "--size",
                "1500x1500", "--kernel-radius", "3", "--tf", "preset:xray"]

    def test_a_long_frame_shows_progress_and_ctrl_c_ends_it(self):
        line = rb"splat +\d+ %  [\d.]+ million splats/s  \d+:\d\d left"
        status, shown = self.on_terminal(self.slow_frame(), line, b"\x03")
        self.assertEqual(status, 1, shown)
        self.assertRegex(shown, r"triptych: render: [^\n]*interrupted" + END)
        self.assertEqual([n for n in os.listdir(self.folder) if n.startswith("p.")], [])

    def test_a_turntable_counts_its_pictures(self):
        turn = ["render", self.data, "-o", self.path("turn.png"), "--orbit", "40", "--size", "400"]
        status, shown = self.on_terminal(turn)
        self.assertEqual(status, 0, shown)
        self.assertRegex(shown, r"\r\x1b\[K\d+ of 40, \d+:\d\d left")
        self.assertRegex(shown, r"turn-000\.png to \S+turn-039\.png: 40 pictures of 400 x 400, [^\n]*\n\Z")
        status, shown = self.on_terminal([*turn, "-q"])
        self.assertEqual((status, shown), (0, ""))
        status, shown = self.on_terminal([*turn, "--orbit", "4000"], rb"[1-9]\d* of 4000", b"\x03")
        self.assertEqual(status, 1, shown)
        self.assertRegex(shown, r"turn\.png: the first [1-9]\d* of 4000 pictures are written")

    def test_a_second_ctrl_c_ends_the_program_at_once(self):
        status, shown = self.on_terminal(self.slow_frame(), rb"splat", b"\x03\x03")
        self.assertIn(status, (1, -signal.SIGINT), shown)
        self.assertFalse(os.path.exists(self.picture))

    def test_sigterm_ends_the_program_like_ctrl_c(self):
        child = subprocess.Popen([limits.program("triptych"), *self.slow_frame()],
                                 stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                 stderr=subprocess.PIPE, text=True)
        try:
            child.wait(1)
            self.fail("the frame is not long enough")
        except subprocess.TimeoutExpired:
            child.terminate()
        out, err = child.communicate()
        self.assertEqual((child.returncode, out), (1, ""))
        self.assertRegex(err, r"\Atriptych: render: [^\n]*interrupted\n\Z")
        self.assertFalse(os.path.exists(self.picture))

    def test_a_pipe_gets_no_progress(self):
        r = self.works("triptych", "render", self.data, "-o", self.picture, "--renderer",
                       "reference", "--size", "300x300")
        self.assertEqual(r.out.count("\n"), 1)
        os.remove(self.picture)

    def check_bench(self, table, *more):
        tiny = self.brick(self.generate(f"{table}.nrrd", "marschner-lobb", 12), f"{table}.trip",
                          "--keep-all")
        arguments = ["bench", table, tiny, "--size", "40x40", "--repeat", 1, *more]
        r = limits.run("triptych", *arguments)
        self.assertEqual((r.status, r.err), (0, ""))  # no progress in a pipe
        status, shown = self.on_terminal(arguments)
        self.assertEqual(status, 0, shown)
        self.assertRegex(shown, rf"\r\x1b\[K{table}  \d+:\d\d[^|]*\r[^|]*\r\x1b\[K[^\r]*bench")
        self.assert_counts_to_its_end(arguments, shown)

    def test_every_bench_shows_progress(self):
        for table in "orders", "stream":
            self.check_bench(table, "--renderer", "cpu")
        self.check_bench("renderers", "--renderer", "cpu,reference", "--views", 2)

    def test_the_bench_of_gl_shows_progress(self):
        limits.need_gl()
        self.check_bench("submit")

    def assert_counts_to_its_end(self, arguments, shown):
        steps = [tuple(map(int, pair)) for pair in re.findall(r"step (\d+) of (\d+)", shown)]
        self.assertTrue(all(step <= end for step, end in steps), (arguments, steps))
        self.assertEqual(*steps[-1], arguments)

    def test_the_counter_of_every_table_ends_at_its_end(self):
        """Some levels, methods and counts are left out."""
        tiny = self.brick(self.generate("few.nrrd", "marschner-lobb", 12), "few.trip", "--keep-all")
        coarse = self.brick(self.generate("coarse.nrrd", "shells", 150), "coarse.trip", "--levels-for", "both")
        small = ["--size", "40x40"]
        for table, data, *more in (["orders", tiny, *small, "--repeat", 1, "--renderer", "reference"],
                                   ["renderers", tiny, *small, "--views", 2, "--classify", "pre"],
                                   ["renderers", tiny, *small, "--views", 1, "--classify", "pre", "--no-counts"],
                                   ["popping", tiny, *small], ["ewa", tiny, *small, "--repeat", 1],
                                   ["popping", tiny, *small, "--renderer", "reference", "--classify", "pre"],
                                   ["variants", tiny, *small], ["levels", coarse, "--views", 1],
                                   ["levels", coarse, "--views", 2, "--classify", "pre"],
                                   ["flight", tiny, "--seconds", 0.3]):
            arguments = ["bench", table, data, *more]
            status, shown = self.on_terminal(arguments)
            self.assertEqual(status, 0, shown)
            self.assert_counts_to_its_end(arguments, shown)
        arguments = ["bench", "--views", 1, "--size", "40x40"]
        status, shown = self.on_terminal(arguments)
        self.assertEqual(status, 0, shown)
        self.assert_counts_to_its_end(arguments, shown)

    def test_ctrl_c_ends_a_bench_and_leaves_nothing(self):
        temporary = self.path("temporary")
        os.mkdir(temporary)
        os.environ["TMPDIR"] = temporary
        try:
            status, shown = self.on_terminal(
                ["bench", "--renderer", "reference", "--size", "300x300", "--views", 50],
                rb"step \d+ of \d+: frame of reference", b"\x03")
        finally:
            del os.environ["TMPDIR"]
        self.assertEqual(status, 1, shown)
        self.assertRegex(shown, r"triptych: [^\n]*interrupted")
        self.assertEqual(os.listdir(temporary), [])

    def interrupt_brick(self, until):
        name = os.path.join(self.work, "i.trip")
        status, shown = self.on_terminal(["brick", self.volume, "-o", name, "--keep-all",
                                          "--threads", 1], until, b"\x03")
        if status == 0:  # brick was done before
            return False
        self.assertEqual(status, 1, shown)
        self.assertRegex(shown, r"triptych: [^\n]*interrupted[^\n]*" + END)
        self.assertFalse(os.path.exists(name))
        self.works("triptych", "brick", self.volume, "-o", name, "--keep-all", "-q", "--resume")
        return True

    def test_resume_finishes_after_ctrl_c(self):
        name = os.path.join(self.work, "i.trip")
        # A data set names its volume relative to its own folder, so both have the same place.
        self.works("triptych", "brick", self.volume, "-o", name, "--keep-all", "-q")
        wanted = limits.folder_hashes(name)
        subprocess.run(["rm", "-r", name], check=True)
        for stage in rb"scan", rb"read", rb"merge":
            if self.interrupt_brick(stage):
                self.assertEqual(limits.folder_hashes(name), wanted)
                self.assertEqual(os.listdir(self.work), ["i.trip"])
            for left in os.listdir(self.work):
                subprocess.run(["rm", "-r", os.path.join(self.work, left)], check=True)


if __name__ == "__main__":
    limits.main()
