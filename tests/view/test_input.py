"""Tests that `triptych view` keeps input that comes while a picture takes long: clicks, keys, wheel
steps and drags that begin and end within one picture. The X server sends the events, as it does for
people. The viewer is stopped meanwhile, which stands for a slow picture. The same events in a
script, one picture each, give the right result."""
import ctypes
import glob
import json
import os
import shlex
import signal
import time

import numpy

import test_view
from test_view import PANEL, program

LEFT = 1
# All controls are in sight without scrolling.
WIDTH, HEIGHT = 700, 980


class Display:
    """A client of the X server that plays the pointer and the keyboard (XTest)."""

    def __init__(self, name):
        self.x, self.test = ctypes.CDLL("libX11.so.6"), ctypes.CDLL("libXtst.so.6")
        self.x.XOpenDisplay.restype = ctypes.c_void_p
        self.x.XDefaultRootWindow.restype = ctypes.c_ulong
        self.x.XStringToKeysym.restype = ctypes.c_ulong
        self.display = ctypes.c_void_p(self.x.XOpenDisplay(name.encode()))
        assert self.display.value
        self.root = ctypes.c_ulong(self.x.XDefaultRootWindow(self.display))

    def window(self):
        """Returns the viewer's window, the only one without a parent but the root."""
        root, parent = ctypes.c_ulong(), ctypes.c_ulong()
        children, count = ctypes.POINTER(ctypes.c_ulong)(), ctypes.c_uint()
        self.x.XQueryTree(self.display, self.root, ctypes.byref(root), ctypes.byref(parent),
                          ctypes.byref(children), ctypes.byref(count))
        for i in range(count.value):
            size = [ctypes.c_uint() for _ in range(4)]
            place = [ctypes.c_int() for _ in range(2)]
            self.x.XGetGeometry(self.display, ctypes.c_ulong(children[i]), ctypes.byref(root),
                                *map(ctypes.byref, place + size))
            if (size[0].value, size[1].value) == (WIDTH, HEIGHT):
                return ctypes.c_ulong(children[i])
        raise AssertionError("no window of the viewer")

    def move(self, x, y):
        self.x.XWarpPointer(self.display, ctypes.c_ulong(0), self.window(), 0, 0, 0, 0, int(x), int(y))

    def button(self, number, down):
        self.test.XTestFakeButtonEvent(self.display, number, down, ctypes.c_ulong(0))

    def click(self, number=LEFT):
        self.button(number, 1)
        self.button(number, 0)

    def key(self, name):
        """GLFW takes a second press of a key within 20 ms for a repeat of the first."""
        self.flush()
        time.sleep(0.04)
        code = self.x.XKeysymToKeycode(self.display,
                                       ctypes.c_ulong(self.x.XStringToKeysym(name.encode())))
        for down in 1, 0:
            self.test.XTestFakeKeyEvent(self.display, code, down, ctypes.c_ulong(0))

    def flush(self):
        self.x.XSync(self.display, 0)


class Input(program.ProgramTest):
    view, status = test_view.View.view, test_view.View.status

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.screen = test_view.Screen()
        cls.addClassCleanup(cls.screen.close)
        cls.display = Display(cls.screen.environment["DISPLAY"])
        # The volume has no symmetry, so that no two views look the same.
        program.write_nrrd("noise.nrrd", program.noise((24, 20, 28)))
        run = program.call("brick", "noise.nrrd", "-o", "noise.trip", "--keep-all")
        assert run.returncode == 0, run.stderr

    def place(self, label):
        """Returns the position of a control of the panel."""
        self.view(f"wait\nclick 0.5 {label}\nstatus place.json\n", "noise.trip", size=f"{WIDTH}x{HEIGHT}")
        return [int(at) for at in self.status("place.json")["pointer"]]

    def has_written(self, name):
        try:
            return bool(self.status(name))
        except (FileNotFoundError, json.JSONDecodeError):
            return False

    def live(self, act):
        """Stops the viewer, acts on the display, and lets the viewer go on. Returns the statistics and the
        window before and after."""
        script = "wait\nmove 20 20\nscreenshot before.exr\nstatus before.json\nsleep 2000\nwait\n" \
                 "screenshot after.exr\nstatus after.json\n"
        with open("script", "w") as f:
            f.write(script)
        for name in glob.glob("*.json"):
            os.remove(name)
        viewer = program.start("view", "noise.trip", f"--size={WIDTH}x{HEIGHT}", "--threads=2", "--fresh",
                               "--script=script", env=self.screen.environment)
        while viewer.poll() is None and not self.has_written("before.json"):
            time.sleep(0.01)
        viewer.send_signal(signal.SIGSTOP)
        act(self.display)
        self.display.flush()
        time.sleep(0.2)
        viewer.send_signal(signal.SIGCONT)
        _, err = viewer.communicate(timeout=60)
        self.assertEqual(viewer.returncode, 0, err)
        return [(self.status(f"{name}.json"), program.read_exr(f"{name}.exr")[:, : WIDTH - PANEL])
                for name in ("before", "after")]

    def scripted(self, script):
        """Plays the events one by one. Returns the statistics and the window."""
        self.view(f"wait\nmove 20 20\n{script}wait\nscreenshot right.exr\nstatus right.json\n", "noise.trip",
                  size=f"{WIDTH}x{HEIGHT}")
        return self.status("right.json"), program.read_exr("right.exr")[:, : WIDTH - PANEL]

    def test_a_click_on_a_control_counts(self):
        x, y = self.place("Axes")
        (_, before), (_, after) = self.live(lambda d: (d.move(x, y), d.click()))
        self.assertTrue((before != after).any())
        _, right = self.scripted("click 0.5 Axes\n")
        numpy.testing.assert_array_equal(after, right)

    def test_each_of_several_clicks_counts(self):
        """Two clicks on one control undo each other. Clicks on two controls change both."""
        axes, box = self.place("Axes"), self.place("Box")

        def click(d):
            for _ in range(2):
                d.move(*axes)
                d.click()
            for _ in range(3):
                d.move(*box)
                d.click()
        (_, before), (_, after) = self.live(click)
        self.assertTrue((before != after).any())
        _, right = self.scripted("click 0.5 Box\n")
        numpy.testing.assert_array_equal(after, right)

    def test_a_slider_takes_a_click(self):
        x, y = self.place("Opacity")
        (before, _), (after, _) = self.live(lambda d: (d.move(x + 30, y), d.click()))
        self.assertNotIn("--opacity-scale", before["camera"])
        right, _ = self.scripted(f"move {x + 30} {y}\npress left\nrelease left\n")
        self.assertIn("--opacity-scale", right["camera"])
        self.assertEqual(after["camera"], right["camera"])

    def test_each_key_press_counts(self):
        for presses in 1, 2, 3:
            (_, before), (_, after) = self.live(lambda d: [d.key("b") for _ in range(presses)])
            self.assertEqual((before != after).any(), presses % 2 == 1, presses)

    def test_a_tapped_key_flies(self):
        (before, _), (after, _) = self.live(lambda d: d.key("w"))
        self.assertNotEqual(before["camera"], after["camera"])

    def test_each_wheel_step_counts(self):
        def turn(d):
            d.move(100, 120)
            for _ in range(3):
                d.click(4)
        (before, _), (after, _) = self.live(turn)
        right, _ = self.scripted("move 100 120\nwheel 3\n")
        self.assertNotEqual(before["camera"], after["camera"])
        self.same_camera(after["camera"], right["camera"])

    def test_a_whole_drag_counts(self):
        def drag(d):
            d.move(100, 100)
            d.button(LEFT, 1)
            d.move(160, 130)
            d.button(LEFT, 0)
            d.move(300, 300)
        (before, _), (after, _) = self.live(drag)
        right, _ = self.scripted("drag left 100 100 160 130 1\n")
        self.assertNotEqual(before["camera"], after["camera"])
        self.same_camera(after["camera"], right["camera"])

    def test_a_drag_that_ends_on_the_panel_clicks_no_control(self):
        x, y = self.place("Axes")

        def drag(d):
            d.move(100, 100)
            d.button(LEFT, 1)
            d.move(x, y)
            d.button(LEFT, 0)
        (_, _), (after, window) = self.live(drag)
        right, scripted = self.scripted(f"drag left 100 100 {x} {y} 1\n")
        self.same_camera(after["camera"], right["camera"])
        numpy.testing.assert_allclose(window, scripted, atol=1 / 255)

    def test_text_follows_the_click_into_its_field(self):
        """In the picture, the key q ends the viewer, and b shows the box."""
        x, y = self.place("File")

        def write(d):
            d.move(x, y)
            d.click()
            for name in "bqb":
                d.key(name)
        (_, before), (after, window) = self.live(write)
        self.assertTrue(after["exact"])
        numpy.testing.assert_array_equal(before, window)

    def same_camera(self, a, b):
        a, b = shlex.split(a), shlex.split(b)
        self.assertEqual(len(a), len(b))
        for one, other in zip(a, b):
            if one != other:
                numpy.testing.assert_allclose(numpy.array(one.split(","), float),
                                              numpy.array(other.split(","), float), rtol=1e-9, atol=1e-9)


if __name__ == "__main__":
    program.main()
