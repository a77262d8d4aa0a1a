"""Ctrl-C while a large picture is planned, drawn, merged or written: the program ends soon, with one
line, and leaves nothing. How soon is printed; the limit is a generous one, since machines may be
busy."""
import os
import signal
import time

import program

SIZE = "4096x4096"
LIMIT_S = 15


class Interrupt(program.ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        program.write_nrrd("a.nrrd", program.noise((48, 48, 48)))
        assert program.call("brick", "a.nrrd", "-o", "a.trip", "-q").returncode == 0

    def await_handler(self, process):
        """Until the program has said what a signal does to it."""
        caught = 0
        while process.poll() is None and not caught >> (signal.SIGINT - 1) & 1:
            with open(f"/proc/{process.pid}/status", encoding="ascii") as status:
                (line,) = (l for l in status if l.startswith("SigCgt:"))
            caught = int(line.split()[1], 16)
            time.sleep(0.01)

    def interrupt(self, renderer, seconds, *options):
        """Seconds from the signal to the end; None where it had ended before."""
        before = set(os.listdir("."))
        process = program.start(
            "render", "a.trip", "-o", "p.png", f"--size={SIZE}", f"--renderer={renderer}", *options
        )
        self.await_handler(process)
        try:
            process.wait(seconds)
        except program.subprocess.TimeoutExpired:
            pass
        else:
            process.communicate()
            if os.path.exists("p.png"):
                os.remove("p.png")
            return None
        started = time.monotonic()
        process.send_signal(signal.SIGINT)
        try:
            _, err = process.communicate(timeout=LIMIT_S)
        except program.subprocess.TimeoutExpired:
            process.kill()
            process.communicate()
            self.fail(f"{renderer}, after {seconds} s: does not end")
        took = time.monotonic() - started
        err = err.decode()
        if process.returncode == 0:  # the picture was there already
            os.remove("p.png")
            return None
        self.assertEqual(process.returncode, 1, err)
        self.assertTrue(program.LINE.fullmatch(err), err)
        self.assertIn("interrupted", err)
        self.assertEqual(set(os.listdir(".")), before)
        return took

    def check(self, renderer, *options):
        draws = program.call(
            "render", "a.trip", "-o", "a.png", "--size=8x8", f"--renderer={renderer}"
        )
        if draws.returncode and renderer == "gl":
            self.skipTest("this machine has no OpenGL 4.5 by EGL")
        times = [self.interrupt(renderer, s, *options) for s in (0.2, 1, 3)]
        print(
            f"{renderer}: ended "
            + ", ".join("before" if t is None else f"{t:.2f} s" for t in times)
            + " after the signal",
            flush=True,
        )

    def test_the_processors_renderer(self):
        self.check("cpu")

    def test_the_reference(self):
        self.check("reference")

    def test_opengl(self):
        self.check("gl")


if __name__ == "__main__":
    program.main()
