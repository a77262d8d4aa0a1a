"""Tests Ctrl-C while a large picture is planned, drawn, merged or written, and while a volume is
bricked. The program ends soon with one line, and leaves nothing. Machines may be busy, so that the
tests measure processor time after the signal. Their limit is ten times the goal."""
import os
import signal
import time

import program

SIZE = "4096x4096"
LIMIT_S = 5 * (4 if program.SANITIZED else 1)  # seconds of processor time
HANGS_S = 60


class Ended:
    """A process that was waited for, with its total processor time."""

    def __init__(self, process, seconds):
        limit = time.monotonic() + seconds
        self.pid = 0
        while not self.pid and time.monotonic() < limit:
            self.pid, status, self.usage = os.wait4(process.pid, os.WNOHANG)
            time.sleep(0 if self.pid else 0.01)
        if self.pid:
            process.returncode = os.waitstatus_to_exitcode(status)
            self.processor_seconds = self.usage.ru_utime + self.usage.ru_stime


class Interrupt(program.ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        program.write_nrrd("a.nrrd", program.noise((48, 48, 48)))
        assert program.call("brick", "a.nrrd", "-o", "a.trip", "-q").returncode == 0

    def interrupt(self, made, seconds, *arguments):
        """Interrupts a run after `seconds`. Returns the processor time from the signal to the end,
        or None if the run had ended before."""
        before = set(os.listdir("."))
        process = program.start(*arguments)
        program.await_handler(process)
        try:
            process.wait(seconds)
        except program.subprocess.TimeoutExpired:
            pass
        else:
            process.communicate()
            self.remove(made)
            return None
        taken = program.processor_seconds(process)
        process.send_signal(signal.SIGINT)
        ended = Ended(process, HANGS_S)
        if not ended.pid:
            process.kill()
            process.communicate()
            self.fail(f"{arguments}, after {seconds} s: does not end")
        took = ended.processor_seconds - taken
        err = process.communicate()[1].decode()
        if process.returncode == 0:  # the work was already done
            self.remove(made)
            return None
        self.assertEqual(process.returncode, 1, err)
        self.assertTrue(program.LINE.fullmatch(err), err)
        self.assertIn("interrupted", err)
        self.assertEqual(set(os.listdir(".")), before)
        self.assertLess(took, LIMIT_S, f"{arguments}, after {seconds} s")
        return took

    def remove(self, made):
        if os.path.isdir(made):
            program.shutil.rmtree(made)
        elif os.path.exists(made):
            os.remove(made)

    def times(self, about, made, delays, *arguments):
        times = [self.interrupt(made, s, *arguments) for s in delays]
        print(
            f"{about}: ended "
            + ", ".join("before" if t is None else f"{t:.2f} s" for t in times)
            + " of processors after the signal",
            flush=True,
        )

    def check(self, renderer, size=SIZE):
        self.works("render", "a.trip", "-o", "a.png", "--size=8x8", f"--renderer={renderer}")
        draw = ["render", "a.trip", "-o", "p.png", f"--size={size}", f"--renderer={renderer}"]
        self.times(f"{renderer}, {size}", "p.png", (0.2, 1, 3), *draw)

    def test_cpu_can_be_interrupted(self):
        self.check("cpu")

    def test_reference_can_be_interrupted(self):
        self.check("reference")

    def test_integral_can_be_interrupted(self):
        self.check("integral")

    def test_gl_can_be_interrupted(self):
        program.need_gl()
        self.check("gl")
        self.check("gl", "8192x8192")

    def test_bricking_beyond_memory_can_be_interrupted(self):
        program.write_nrrd("b.nrrd", program.noise((160, 256, 256), "u2"), encoding="gzip")
        brick = ["brick", "b.nrrd", "-o", "b.trip", "--keep-all", "--memory=64M"]
        self.times("brick", "b.trip", (0.2, 0.6, 1.2, 2, 3.5), *brick)
        os.remove("b.nrrd")


if __name__ == "__main__":
    program.main()
