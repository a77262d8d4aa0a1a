"""Tests of `triptych view` on a virtual screen (Xvfb), driven by scripts. They check the effect of
each control, the faults that the viewer survives, and that its picture at rest equals the picture
of `triptych render`."""
import glob
import json
import os
import shlex
import shutil
import subprocess
import sys
import tempfile
import unittest
import unittest.mock

sys.path.insert(0, os.path.join(os.environ["TRIP_SOURCE_DIR"], "tests", "cli"))
import numpy

import program
import test_gaussians as gaussians

ROUNDS = int(os.environ.get("TRIP_LIMITS_ROUNDS", "1"))
WIDTH, HEIGHT, PANEL = 700, 340, 330


def skip_what_is_missing():
    if "VIEW" in program.SWITCHED_OFF:
        print("skipped: built without the viewer")
    elif not shutil.which("Xvfb"):
        print("skipped: Xvfb is not installed")
    else:
        return
    sys.exit(program.SKIPPED)


class Screen:
    """A virtual screen. Xvfb chooses its number."""

    def __init__(self):
        read, write = os.pipe()
        self.process = subprocess.Popen(
            ["Xvfb", "-displayfd", str(write), "-screen", "0", "1400x1000x24", "-nolisten", "tcp"],
            pass_fds=[write], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL)
        os.close(write)
        with os.fdopen(read) as pipe:
            number = pipe.readline().strip()
        if not number:
            print("skipped: Xvfb does not start")
            sys.exit(program.SKIPPED)
        self.environment = dict(os.environ, DISPLAY=f":{number}", LIBGL_ALWAYS_SOFTWARE="1",
                                XDG_STATE_HOME=os.path.abspath("state"))
        self.environment.pop("WAYLAND_DISPLAY", None)

    def close(self):
        self.process.terminate()
        self.process.wait()


class View(program.ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.screen = Screen()
        # The volume has no symmetry, so that no two views look the same.
        volume = program.noise((24, 20, 28))
        program.write_nrrd("noise.nrrd", volume)
        program.write_nrrd("ball.nrrd", program.ball((24, 24, 24)))
        for name in "noise", "ball":
            run = program.call("brick", f"{name}.nrrd", "-o", f"{name}.trip", "--keep-all")
            assert run.returncode == 0, run.stderr
        program.write_nrrd("heat.nrrd", program.noise((12, 20, 14)))
        run = program.call("brick", "heat.nrrd", "-o", "heat.trip", "--keep-all")
        assert run.returncode == 0, run.stderr
        gaussians.write_scene("scene.ply", gaussians.many(800, degree=2), 2)
        run = program.call("brick", "scene.ply", "-o", "scene.trip", "-q")
        assert run.returncode == 0, run.stderr

    @classmethod
    def tearDownClass(cls):
        cls.screen.close()
        super().tearDownClass()

    def view(self, script, *arguments, status=0, fresh=True, size=f"{WIDTH}x{HEIGHT}"):
        """Plays the script and returns the lines on stderr."""
        with open("script", "w") as f:
            f.write(script)
        fresh = ["--fresh"] if fresh else []
        run = program.call("view", *arguments, f"--size={size}", "--threads=2", *fresh,
                           "--script=script", env=self.screen.environment, timeout=240,
                           program=program.QUICK_PROGRAM)
        self.assertEqual(run.returncode, status, run.stderr)
        return run.stderr

    def pictures(self, script, names, *arguments, **options):
        self.view(script, *arguments, **options)
        return [program.read_exr(f"{name}.exr") for name in names]

    def status(self, name="status.json"):
        with open(name) as f:
            return json.load(f)

    def test_the_picture_at_rest_equals_render(self):
        for settings in [], ["--classify=pre"]:
            self.view("wait\ndrag left 100 100 160 130 5\nwheel 2\nwait\npicture seen.exr\n"
                      "status status.json\n", "noise.trip", *settings)
            camera = shlex.split(self.status()["camera"])
            self.works("render", "noise.trip", *camera, *settings, "--background=0,0,0", "-o",
                       "drawn.exr")
            with open("seen.exr", "rb") as seen, open("drawn.exr", "rb") as drawn:
                self.assertEqual(seen.read(), drawn.read())

    GLOWS = ["noise.trip", "--effects=emission,cueing", "--emission=heat.trip",
             "--temperature=500:3000"]

    def test_emission_equals_render(self):
        for renderer in "cpu", *program.GL:
            self.view("wait\npicture seen.exr\nstatus status.json\n", *self.GLOWS,
                      f"--renderer={renderer}")
            camera = shlex.split(self.status()["camera"])
            self.assertEqual(camera[camera.index("--effects") :],
                             ["--effects", "cueing,emission", "--temperature", "500:3000",
                              "--emission", "heat.trip"])
            self.works("render", "noise.trip", *camera, "--background=0,0,0", "-o", "drawn.exr",
                       f"--renderer={renderer}")
            with open("seen.exr", "rb") as seen, open("drawn.exr", "rb") as drawn:
                self.assertEqual(seen.read(), drawn.read())

    def test_emission_has_controls_and_belongs_to_one_data_set(self):
        shutil.rmtree("state", ignore_errors=True)
        script = ("wait\npicture 0.exr\nclick 0.5 Emission\nwait\npicture 1.exr\n"
                  "click 0.5 Emission\nclick 0.9 Maximum temperature\nwait\npicture 2.exr\n"
                  "click 0.1 Minimum temperature\nwait\npicture 3.exr\n"
                  f"drop {os.path.abspath('ball.trip')}\nwait\npicture 4.exr\n")
        hot, cold, hotter, warmer, ball = self.pictures(script, range(5), *self.GLOWS, fresh=False)
        for a, b in (hot, cold), (cold, hotter), (hotter, warmer):
            self.assertTrue((a != b).any())
        self.view("wait\npicture cold.exr\n", "noise.trip", "--effects=cueing")
        numpy.testing.assert_array_equal(program.read_exr("cold.exr"), cold)
        self.view("wait\npicture ball.exr\n", "ball.trip", "--effects=cueing")
        numpy.testing.assert_array_equal(program.read_exr("ball.exr"), ball)
        # The saved state has the emission of the first data set, and none of the second.
        again, = self.pictures("wait\npicture again.exr\n", ["again"], "noise.trip", fresh=False)
        numpy.testing.assert_array_equal(again, warmer)
        again, = self.pictures("wait\npicture again.exr\n", ["again"], "ball.trip", fresh=False)
        numpy.testing.assert_array_equal(again, ball)
        shutil.rmtree("state")

    def test_unreadable_heat_is_reported_and_other_state_is_restored(self):
        shutil.rmtree("state", ignore_errors=True)
        script = "wait\ndrag left 100 100 160 130 5\nwait\npicture hot.exr\nstatus status.json\n"
        hot, = self.pictures(script, ["hot"], *self.GLOWS, fresh=False)
        camera = shlex.split(self.status()["camera"])
        cold = [*camera[: camera.index("--effects")], "--effects=cueing"]
        self.works("render", "noise.trip", *cold, "--background=0,0,0", "-o", "cold.exr",
                   "--renderer=cpu")
        cold = program.read_exr("cold.exr")
        self.assertTrue((hot != cold).any())
        for spoil in "missing", "damaged":
            shutil.copytree("heat.trip", "kept.trip")
            if spoil == "missing":
                shutil.rmtree("heat.trip")
            else:
                program.write(os.path.join("heat.trip", "index.trip"), b"nothing of the kind")
            self.view("wait\nstatus status.json\nscreenshot said.png\npicture without.exr\n", "noise.trip",
                      "--renderer=cpu", fresh=False)
            without = program.read_exr("without.exr")
            numpy.testing.assert_array_equal(without, cold, spoil)
            status = self.status()
            self.assertTrue(status["exact"] and not status["failed"])
            self.assertIn("heat.trip", status["message"])
            self.assertNotIn("\n", status["message"])
            self.assertNotIn("--emission", status["camera"])
            shutil.rmtree("heat.trip", ignore_errors=True)
            os.rename("kept.trip", "heat.trip")
            again, = self.pictures("wait\npicture again.exr\n", ["again"], "noise.trip",
                                   "--renderer=cpu", fresh=False)
            numpy.testing.assert_array_equal(again, hot)
        shutil.rmtree("state")

    def test_controls_of_effects_draw_the_picture_of_render(self):
        script = "wait\npicture 0.exr\nclick 0.1 Effects\n"
        for i, control in enumerate(("Occlusion", "Depth cueing", "Cueing strength", "Light from the eye",
                                     "Light elevation", "Shadows", "Anisotropy", "Light cells"), 1):
            at = 0.01 if control == "Light cells" else 0.3  # the volume has few cells
            script += f"click {at} {control}\nwait\npicture {i}.exr\nstatus {i}.json\n"
        pictures = self.pictures(script, range(9), "noise.trip")
        for i in range(1, 9):
            self.assertTrue((pictures[i] != pictures[i - 1]).any(), i)
            camera = shlex.split(self.status(f"{i}.json")["camera"])
            self.works("render", "noise.trip", *camera, "--background=0,0,0", "-o", "drawn.exr")
            numpy.testing.assert_array_equal(program.read_exr("drawn.exr"), pictures[i])
        self.assertEqual(camera[camera.index("--effects") + 1], "shadows,occlusion,cueing")

    def test_marked_views_are_key_frames_of_a_path(self):
        if os.path.exists("noise-001.json"):
            os.remove("noise-001.json")
        self.view("wait\npicture first.exr\nwait\nkey m\ndrag left 100 100 160 130 5\nkey m\n"
                  "wait\npicture last.exr\n", "noise.trip", "--tf=bone")
        with open("noise-001.json") as f:
            path = json.load(f)
        self.assertEqual([k["seconds"] for k in path["keys"]], [0, 2])
        with open("path.json", "w") as f:
            json.dump(path | {"frames_per_second": 0.5}, f)
        self.works("render", "noise.trip", "--path=path.json", f"--size={WIDTH - PANEL}x{HEIGHT}",
                   "--background=0,0,0", "-o", "flown.exr")
        for frame, seen in ("000", "first"), ("001", "last"):
            with open(f"flown-{frame}.exr", "rb") as a, open(f"{seen}.exr", "rb") as b:
                self.assertEqual(a.read(), b.read())

    def test_the_window_shows_the_picture(self):
        seen, shown = self.pictures("wait\nscreenshot shown.exr\npicture seen.exr\n",
                                    ["seen", "shown"], "noise.trip")
        self.assertEqual(seen.shape, (HEIGHT, WIDTH - PANEL, 4))
        self.assertEqual(shown.shape, (HEIGHT, WIDTH, 4))
        self.assertLess(numpy.abs(shown[:, : WIDTH - PANEL] - seen).max(), 0.006)

    def test_each_input_changes_the_picture(self):
        inputs = ["drag left 100 100 150 100 3", "drag left 100 100 100 150 3",
                  "drag left 100 100 150 100 3 +shift", "drag middle 100 100 150 120 3",
                  "drag left 100 100 150 100 3 +control", "drag right 100 100 130 100 3",
                  "move 60 60\nwheel 3", "key z", "key x +shift", "key y", "key 2", "key 5",
                  "key ]", "key [", "hold w\nsleep 150\nlet w", "hold a\nsleep 150\nlet a",
                  "key f", "key 0", "key o"]
        script = "wait\npicture 0.exr\n" + "".join(
            f"{text}\nwait\npicture {i + 1}.exr\n" for i, text in enumerate(inputs))
        self.each_changes(script, inputs, "noise.trip")

    def test_each_control_changes_the_picture(self):
        controls = ["click 0.5 Back", "click 0.5 Parallel", "click 0.5 Parallel",
                    "click 0.7 Field of view", "click 0.5 Fit", "click 0.5 Preset\nclick 0.5 hot-metal",
                    "click 0.3 Function editor", "click 0.5 Undo", "click 0.5 Redo",
                    "click 0.4 Opacity", "click 0.5 Shading", "click 0.5 Shading",
                    "click 0.5 Light from the eye\nclick 0.2 Light azimuth", "click 0.9 Light elevation",
                    "click 0.5 Light turns with the view\nclick 0.4 Light distance",
                    "click 0.5 Classification\nclick 0.5 Pre (splats)",
                    "click 0.5 Variants of the papers\nclick 0.5 Kernel radius", "click 0.5 Compositing\nclick 0.5 Per sheet",
                    "click 0.2 Blend start (h)",
                    "click 0.5 Method\nclick 0.5 Clip", "click 0.5 Method\nclick 0.5 Axis",
                    "click 0.9 Antialiasing", "click 0.5 Classification\nclick 0.5 Post (interpolation)",
                    "click 0.9 Samples per sheet", "click 0.5 Classification\nclick 0.5 Automatic",
                    "click 0.5 Classification\nclick 0.5 Post (interpolation)",
                    "click 0.5 Clipping\nclick 0.5 Clip the data\nclick 0.5 Clip box\n"
                    "click 0.4 i min", "click 0.6 j max", "click 0.3 k min",
                    "click 0.5 Add plane", "click 0.6 Plane 1", "click 0.5 Flip 1",
                    "click 0.5 Add plane\nclick 0.6 Plane 2", "click 0.5 Remove 1",
                    "click 0.5 Clip box", "click 0.5 Clip the data", "click 0.5 Clipping",
                    "click 0.5 Debug view\nclick 0.5 Lists",
                    "click 0.5 Debug view\nclick 0.5 Merge weights",
                    "click 0.5 Debug view\nclick 0.5 Levels of detail",
                    "click 0.5 Debug view\nclick 0.5 Off", "click 0.5 Top"]
        unchanged = ["click 0.5 Clipping"]
        script = "wait\nkey 3\nwait\npicture 0.exr\n" + "".join(
            f"{text}\nwait\npicture {i + 1}.exr\n" for i, text in enumerate(controls))
        self.each_changes(script, controls, "noise.trip", unchanged=unchanged)

    def test_clipping_is_copied_restored_and_marked(self):
        self.view("wait\nclick 0.5 Clipping\nclick 0.5 Clip the data\nclick 0.5 Clip box\n"
                  "click 0.4 i min\nclick 0.6 k max\nclick 0.5 Add plane\nclick 0.55 Plane 1\n"
                  "drag left 100 100 160 130 5\nwait\npicture cut.exr\nstatus status.json\n",
                  "noise.trip", fresh=False)
        camera = shlex.split(self.status()["camera"])
        self.assertIn("--clip-box", camera)
        self.assertIn("--clip-plane", camera)
        self.works("render", "noise.trip", *camera, "--background=0,0,0", "-o", "cut_drawn.exr")
        for path in glob.glob("noise-*.json"):
            os.remove(path)
        self.view("wait\npicture kept.exr\nkey m\nwait\n", "noise.trip", fresh=False)
        with open("noise-001.json") as f:
            self.assertIn("clip", json.load(f)["keys"][0])
        self.works("render", "noise.trip", "--path=noise-001.json", "--background=0,0,0",
                   f"--size={WIDTH - PANEL}x{HEIGHT}", "-o", "cut_path.exr")
        flown, = glob.glob("cut_path*.exr")
        for other in "cut_drawn", "kept", flown[: -len(".exr")]:
            with open("cut.exr", "rb") as a, open(f"{other}.exr", "rb") as b:
                self.assertEqual(a.read(), b.read(), other)
        shutil.rmtree("state")

    def each_changes(self, script, names, *arguments, unchanged=()):
        pictures = self.pictures(script, range(len(names) + 1), *arguments, size="560x300")
        for before, after, name in zip(pictures, pictures[1:], names):
            changes = before.shape != after.shape or (before != after).any()
            self.assertEqual(changes, name not in unchanged, name)

    def test_a_script_sets_settings_by_their_options(self):
        chosen = ["--classify", "pre", "--compositing", "sheet", "--background", "0.1,0.2,0.3,1"]
        seen, = self.pictures(f"wait\nset {' '.join(chosen)}\nwait\npicture seen.exr\nstatus status.json\n",
                              ["seen"], "noise.trip")
        camera = self.status()["camera"]
        for option in "--classify pre", "--compositing sheet":
            self.assertIn(option, camera)
        self.works("render", "noise.trip", *shlex.split(camera), "-o", "drawn.exr")
        self.assertTrue((seen == program.read_exr("drawn.exr")).all())

    def test_clipping_options_apply(self):
        cut = ["--clip-box=voxels:4,4,4,20,15,20", "--clip-plane=1,0.5,0,-6"]
        self.view("wait\npicture whole.exr\nwait\n", "noise.trip")
        self.view("wait\npicture cut.exr\nstatus status.json\n", "noise.trip", *cut)
        camera = shlex.split(self.status()["camera"])
        self.works("render", "noise.trip", *camera, "--background=0,0,0", "-o", "cut_drawn.exr")
        self.assertIn("--clip-plane", camera)
        pictures = []
        for name in "cut", "cut_drawn", "whole":
            with open(f"{name}.exr", "rb") as f:
                pictures.append(f.read())
        self.assertEqual(pictures[0], pictures[1])
        self.assertNotEqual(pictures[0], pictures[2])

    def test_annotations_change_the_window_but_not_the_picture(self):
        marks = ["Box", "Axes", "Scale bar", "Keys"]
        script = "wait\nclick 0.5 Fit\nmove 10 10\nwait\npicture p.exr\nscreenshot 0.exr\n" + "".join(
            f"click 0.5 {name}\nmove 10 10\nsleep 50\nscreenshot {i + 1}.exr\n"
            for i, name in enumerate(marks)) + "picture q.exr\n"
        windows = self.pictures(script, range(len(marks) + 1), "noise.trip")
        for before, after, name in zip(windows, windows[1:], marks):
            left = numpy.s_[:, : WIDTH - PANEL]
            self.assertTrue((before[left] != after[left]).any(), name)
        self.assertTrue((program.read_exr("p.exr") == program.read_exr("q.exr")).all())

    def test_a_key_hides_the_panel(self):
        with_panel, without = self.pictures(
            "wait\npicture with.exr\nkey t\nwait\npicture without.exr\n", ["with", "without"],
            "ball.trip")
        self.assertEqual(with_panel.shape[1] + PANEL, without.shape[1])

    def test_windows_can_be_resized_minimised_and_scaled(self):
        sizes = [(500, 300), (90, 60), (900, 500)]
        script = "wait\n" + "".join(
            f"resize {w} {h}\nwait\nscreenshot {w}.exr\n" for w, h in sizes)
        script += "minimise\ndrag left 50 50 90 90 4\nrestore\nwait\nstatus status.json\n"
        pictures = self.pictures(script, [w for w, _ in sizes], "ball.trip")
        self.assertEqual([p.shape[1::-1] for p in pictures], sizes)
        self.assertTrue(self.status()["exact"])
        self.view("wait\npicture large.exr\n", "ball.trip", "--scale=2", size="1350x300")
        self.assertEqual(program.read_exr("large.exr").shape[1], 1350 - 2 * PANEL)

    def test_the_last_view_is_restored(self):
        self.view("wait\nkey 2\nwait\nclick 0.5 Preset\nclick 0.5 bone\nwait\npicture last.exr\n",
                  "noise.trip", fresh=False)
        self.view("wait\npicture again.exr\n", "noise.trip", fresh=False)
        self.view("wait\npicture anew.exr\n", "noise.trip")
        last, again, anew = (program.read_exr(f"{n}.exr") for n in ("last", "again", "anew"))
        self.assertTrue((last == again).all())
        self.assertTrue((last != anew).any())

    def test_tab_switches_between_data_sets(self):
        script = ("wait\npicture a.exr\nkey tab\nwait\npicture b.exr\nkey tab\nwait\npicture c.exr\n"
                  f"drop {os.path.abspath('ball.trip')}\nwait\nstatus status.json\n")
        a, b, c = self.pictures(script, "abc", "noise.trip", "ball.trip")
        self.assertTrue((a == c).all())
        self.assertTrue((a != b).any())
        self.assertEqual(self.status()["documents"], 3)

    def test_a_volume_is_bricked_and_shown(self):
        seen, = self.pictures("wait\npicture seen.exr\nstatus status.json\n", ["seen"], "ball.nrrd")
        self.assertTrue(self.status()["exact"], self.status())
        self.works("render", "ball.nrrd", *shlex.split(self.status()["camera"]), "-o", "drawn.exr",
                   "--background=0,0,0")
        self.assertTrue((seen == program.read_exr("drawn.exr")).all())

    def test_a_volume_is_shown_from_a_data_set_with_more_values(self):
        with tempfile.TemporaryDirectory(prefix="trip-cache-") as cache:
            with unittest.mock.patch.dict(os.environ, XDG_CACHE_HOME=cache):
                self.works("render", "ball.nrrd", "-o", "x.png", "--size=20x20", "--tf=grey",
                           "--window=1", "--level=0")
                before = os.listdir(os.path.join(cache, "triptych"))
                self.view("wait\nstatus status.json\n", "ball.nrrd", "--tf=grey")
                self.assertTrue(self.status()["exact"])
                self.assertFalse(self.status()["failed"])
                after = os.listdir(os.path.join(cache, "triptych"))
        trips = lambda names: [n for n in names if n.endswith(".trip")]
        self.assertEqual(len(trips(before)), 1)
        self.assertEqual(trips(after), trips(before))

    def test_a_report_must_measure_the_data_set_of_the_volume(self):
        self.works("brick", "ball.nrrd", "-q", "-o", "usual.trip")
        program.write_report("usual", "usual.trip")
        program.write_report("splats", "usual.trip", classify="pre")
        program.write_report("other", None)
        for report in "usual", "splats", "other":
            self.view(f"wait\ndrop {os.path.abspath('noise.nrrd')}\nwait\nstatus {report}.json\n"
                      "key tab\nwait\nstatus status.json\n",
                      "ball.nrrd", "--error=255", f"--report={report}")
            status = self.status()
            self.assertTrue(self.status(report + ".json")["exact"])  # the report is not of this data set
            self.assertEqual(status["failed"], report == "other", status)
            if status["failed"]:
                self.assertIn("the report measured another data set", status["message"])

    def test_a_large_volume_is_previewed_while_it_is_bricked(self):
        program.write_nrrd("large.nrrd", program.ball((204, 204, 204), radius=0.5))
        self.view("wait\npicture seen.exr\nwait\nstatus status.json\n", "large.nrrd")
        self.works("render", "large.nrrd", *shlex.split(self.status()["camera"]), "-o", "drawn.exr",
                   "--background=0,0,0")
        with open("seen.exr", "rb") as a, open("drawn.exr", "rb") as b:
            self.assertEqual(a.read(), b.read())
        self.assertEqual(self.status()["dims"], [204, 204, 204])
        # The cache also holds the preview.
        self.assertEqual(self.works("cache", "list").stdout.count(b"large"), 2)

    def test_a_button_bricks_again_with_all_voxels(self):
        self.works("brick", "noise.nrrd", "-o", "part.trip", "--range=200:255")
        self.view("wait\npicture before.exr\nclick 0.5 Brick again with all voxels\nwait\n"
                  "picture after.exr\nstatus status.json\n", "part.trip", "--tf=grey")
        camera = shlex.split(self.status()["camera"])
        self.works("render", "noise.trip", *camera, "--tf=grey", "--background=0,0,0", "-o",
                   "all.exr")
        before, after, everything = (program.read_exr(f"{n}.exr") for n in ("before", "after", "all"))
        self.assertTrue((before != after).any())
        self.assertTrue((after == everything).all())
        # The volume is not beside a copy of the data set.
        os.mkdir("elsewhere")
        shutil.copytree("part.trip", "elsewhere/part.trip")
        self.view("wait\nclick 0.5 Brick again with all voxels\nwait\nscreenshot alone.exr\n"
                  "status status.json\n", "elsewhere/part.trip", "--tf=grey")
        self.assertTrue(self.status()["exact"], self.status())

    def test_faults_appear_as_a_message_in_the_window(self):
        shutil.copytree("noise.trip", "damaged.trip")
        for name in os.listdir("damaged.trip"):
            if name.endswith(".voxels"):
                with open(os.path.join("damaged.trip", name), "r+b") as f:
                    data = bytearray(f.read())
                    for i in range(0, len(data), 512):
                        data[i] ^= 0xFF
                    f.seek(0)
                    f.write(data)
        script = (f"wait\ndrop {os.path.abspath('damaged.trip')}\nwait\nstatus damaged.json\n"
                  "drop /nowhere/at-all.trip\nwait\nstatus missing.json\nscreenshot shown.exr\n"
                  "key tab\nwait\nstatus good.json\n")
        self.view(script, "noise.trip")
        damaged, missing, good = (self.status(f"{n}.json") for n in ("damaged", "missing", "good"))
        self.assertTrue(damaged["failed"] and "damaged.trip" in damaged["message"], damaged)
        self.assertTrue(missing["failed"] and "/nowhere/at-all.trip" in missing["message"], missing)
        self.assertTrue(good["exact"] and not good["failed"], good)

    def test_a_data_set_can_be_removed_while_it_is_open(self):
        # The viewer waits at each pipe until this test opens it.
        shutil.copytree("noise.trip", "gone.trip")
        for pipe in "shown", "go":
            os.mkfifo(pipe)
        with open("going", "w") as f:
            f.write("wait\nkey tab\nwait\nstatus shown\nstatus go\nkey tab\nwait\nkey tab\nwait\n"
                    "status after.json\n")
        process = program.start("view", "noise.trip", "gone.trip", "--fresh", "--script=going",
                                "--size=500x300", env=self.screen.environment)
        self.assertTrue(self.status("shown")["exact"])
        shutil.rmtree("gone.trip")
        self.status("go")
        _, err = process.communicate(timeout=120)
        self.assertEqual(process.returncode, 0, err)
        after = self.status("after.json")
        self.assertTrue(after["failed"] and "gone.trip" in after["message"], after)

    def test_the_viewer_survives_random_events(self):
        count = 150 * ROUNDS
        self.view(f"wait\nrandom {count} 1\nwait\nresize 600 400\nwait\nstatus status.json\n"
                  "key 0\nwait\nscreenshot s.exr\n", "noise.trip", "ball.trip", "scene.trip", size="500x300")
        status = self.status()
        self.assertTrue(status["exact"] or status["documents"] == 0, status)

    def test_invalid_command_lines_are_refused(self):
        no_display = {k: v for k, v in os.environ.items() if k not in ("DISPLAY", "WAYLAND_DISPLAY")}
        self.fails(1, "view", "noise.trip", says="display", env=no_display)
        self.fails(1, "view", "missing.trip", says="missing.trip", env=self.screen.environment)
        self.fails(2, "view", "--size=3x", says="--size", env=self.screen.environment)
        self.fails(2, "view", "--up=0,0,0", says="--up", env=self.screen.environment)
        glows = ["--effects=emission", "--emission=heat.trip"]
        for status, options, says in (
            (2, ["noise.trip", glows[0]], "--emission HEAT.trip"),
            (2, ["noise.trip", glows[1]], "--effects emission"),
            (2, glows, "to one data set"),
            (2, ["noise.trip", "ball.trip", *glows], "to one data set"),
            (2, ["noise.trip", "--temperature=0:3000"], "requires --emission"),
            (2, ["noise.trip", *glows, "--temperature=9:3"], "the smaller first"),
            (1, ["noise.trip", glows[0], "--emission=no.trip"], "no.trip"),
        ):
            self.fails(status, "view", *options, says=says, env=self.screen.environment)
        with open("script", "w") as f:
            f.write("wait\nclick 0.5 No such control\n")
        with open("bad", "w") as f:
            f.write("jump\n")
        self.fails(1, "view", "--script=bad", says="line 1", env=self.screen.environment)
        with open("README.md", "w") as f:
            f.write("# No volume")
        for arguments in ["README.md"], ["noise.trip", "--tf=nope"], ["noise.nrrd", "--tf=nope"]:
            self.fails(1, "view", *arguments,
                       says="nope" if "--tf=nope" in arguments else "README.md",
                       env=self.screen.environment)

    def test_a_script_cannot_replace_an_open_file(self):
        with open("noise.nrrd", "rb") as f:
            before = f.read()
        for inputs, output in (["noise.nrrd"], "noise.nrrd"), (["noise.trip"], "noise.trip/x.png"):
            for event in "screenshot", "picture", "status":
                said = self.view(f"{event} {output}\n", *inputs, status=2)
                self.assertTrue(program.LINE.fullmatch(said), said)
                self.assertIn(output, said)
        with open("noise.nrrd", "rb") as f:
            self.assertEqual(f.read(), before)
        self.assertFalse(os.path.exists("noise.trip/x.png"))

    def test_a_file_that_cannot_be_written_ends_a_script(self):
        for event in "screenshot", "picture", "status":
            said = self.view(f"wait\n{event} missing/x.png\nstatus never.json\n", "noise.trip",
                             status=1)
            self.assertTrue(program.LINE.fullmatch(said), said)
            self.assertIn("missing/x.png", said)
            self.assertFalse(os.path.exists("never.json"))

    def test_a_signal_ends_the_viewer(self):
        os.mkfifo("here")
        with open("script", "w") as f:
            f.write("wait\nstatus here\nsleep 600000\n")
        process = program.start("view", "noise.trip", "--fresh", "--script=script",
                                env=self.screen.environment)
        self.status("here")
        process.send_signal(2)
        _, err = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 1, err)
        self.assertIn(b"interrupted", err)

    # ---- Gaussian scenes ----

    def expect_render(self, name, status, data="scene.trip", options=()):
        """The picture NAME.exr has the bits of `render` with the options of the status."""
        camera = shlex.split(self.status(status)["camera"])
        background = [] if "--background" in camera else ["--background=0,0,0"]
        self.works("render", data, *camera, *options, *background, "-o", "drawn.exr")
        with open(f"{name}.exr", "rb") as seen, open("drawn.exr", "rb") as drawn:
            self.assertEqual(seen.read(), drawn.read(), camera)

    def test_each_control_of_a_scene_draws_the_picture_of_render(self):
        orders = ["depth", *gaussians.orders()[2:], "lists"]
        controls = [f"click 0.5 Order\nclick 0.5 {name.capitalize()}" for name in orders[1:]]
        controls += ["click 0.5 Variants of the papers\nclick 0.2 Blend start (h)",
                     "click 0.5 Method\nclick 0.5 Axis", "click 0.4 Early termination",
                     "click 0.5 Footprint\nclick 0.5 Exact", "click 0.5 Footprint\nclick 0.5 Ewa",
                     "click 0.5 Harmonics\nclick 0.5 0", "click 0.5 Harmonics\nclick 0.5 1", "click 0.7 Opacity",
                     "click 0.9 Antialiasing", "set --background 0.1,0.2,0.3", "click 0.5 Back",
                     "click 0.5 Parallel", "drag left 100 100 130 120 3", "move 90 90\nwheel 2", "click 0.5 Fit",
                     "key x", "key z +shift", "click 0.5 Top", "click 0.5 Parallel",
                     "click 0.5 Clipping\nclick 0.5 Clip the data\nclick 0.5 Clip box\nclick 0.4 x min",
                     "click 0.6 y max", "click 0.5 Add plane", "click 0.5 Flip 1"]
        script = "wait\npicture 0.exr\nstatus 0.json\n" + "".join(
            f"{text}\nwait\npicture {i + 1}.exr\nstatus {i + 1}.json\n" for i, text in enumerate(controls))
        self.each_changes(script, controls, "scene.trip")
        for i in range(len(controls) + 1):
            self.expect_render(i, f"{i}.json")
        for i, name in enumerate(orders):
            self.assertEqual(self.status(f"{i}.json")["order"], name)

    def test_controls_that_do_not_apply_to_a_scene_are_hidden(self):
        self.view("wait\nclick 0.5 Variants of the papers\nwait\nstatus scene.json\nclick 0.5 Order\n"
                  "click 0.5 Lists\nwait\nstatus lists.json\nkey tab\nwait\nstatus volume.json\n",
                  "scene.trip", "noise.trip")
        scene, lists, volume = (set(self.status(f"{n}.json")["controls"]) for n in ("scene", "lists", "volume"))
        of_volumes = {"Transfer function", "Function editor", "Preset", "Light", "Shading", "Light from the eye",
                      "Quality preset", "Classification", "Interpolation", "Samples per sheet",
                      "Debug view", "Probe"}
        of_scenes = {"Scene", "Order", "Footprint", "Harmonics"}
        of_both = {"Opacity", "Background", "Antialiasing", "Early termination", "Clipping", "Box", "Axes",
                   "Effects", "Scale bar", "Parallel", "Fit", "Front"}
        self.assertEqual(scene & of_volumes, set())
        self.assertEqual(volume & of_scenes, set())
        for controls in scene, lists, volume:
            self.assertEqual(of_both - controls, set())
        self.assertEqual(of_volumes - volume, set())
        self.assertEqual(of_scenes - scene, set())
        for label in "Method", "Blend start (h)":  # a picture by depth has one layer
            self.assertEqual([label in controls for controls in (scene, lists, volume)], [False, True, True])

    def test_a_scene_without_harmonics_has_no_choice_of_degree(self):
        gaussians.write_scene("plain.ply", gaussians.many(50))
        self.view("wait\nstatus status.json\n", "plain.ply")
        self.assertNotIn("Harmonics", self.status()["controls"])
        self.assertIn("Order", self.status()["controls"])

    def test_a_scene_file_is_bricked_and_shown(self):
        self.view("wait\npicture seen.exr\nstatus status.json\n", "scene.ply", "--order=lists")
        self.assertEqual((self.status()["gaussians"], self.status()["order"]), (800, "lists"))
        self.expect_render("seen", "status.json", "scene.ply")

    def test_a_light_falls_on_a_cloud_of_points(self):
        cloud = os.path.join(program.DATASETS, "lamp.ply")
        lit, plain = (self.pictures("wait\npicture seen.exr\nstatus status.json\n", ["seen"], cloud, *light)[0]
                      for light in (["--light=1,0.2,0"], []))
        self.assertGreater(numpy.abs(lit - plain).max(), 0.1)
        self.view("wait\npicture seen.exr\nstatus status.json\n", cloud, "--light=1,0.2,0")
        self.expect_render("seen", "status.json", cloud, ["--light=1,0.2,0"])

    def test_each_control_of_a_cloud_draws_the_picture_of_render(self):
        cloud, brick = os.path.join(program.DATASETS, "lamp.ply"), ["--radius=1.5x", "--k=8"]
        controls = ["Shading", "Light from the eye", "Light azimuth", "Light elevation",
                    "Effects\nclick 0.5 Eye-dome lighting", "Dome strength", "Dome radius", "Occlusion", "Shading"]
        script = "wait\npicture 0.exr\nstatus 0.json\n" + "".join(
            f"click 0.2 {text}\nwait\npicture {i + 1}.exr\nstatus {i + 1}.json\n"
            for i, text in enumerate(controls))
        self.each_changes(script, controls, cloud, *brick)
        for i in range(len(controls) + 1):
            self.expect_render(i, f"{i}.json", cloud, brick)
        self.assertIn("--effects occlusion,edl --edl-strength", self.status(f"{i}.json")["camera"])
        with self.assertRaises(AssertionError):  # the options of bricking count
            self.expect_render(0, "0.json", cloud)

    def test_scenes_with_y_down_stand_upright(self):
        """The red Gaussian has the least y, which is up."""
        colours = {-1: (1, 0, 0), 0: (0, 1, 0), 1: (0, 0, 1)}
        rows = [gaussians.row((0, y, 0), colour, 0.9, (0.2, 0.2, 0.2)) for y, colour in colours.items()]
        gaussians.write_scene("tower.ply", rows)
        views = ["", "key 1", "key 2", "key 3", "key f", "key o", "key x", "key z", "drag left 100 100 130 104 3"]
        script = "".join(f"{text}\nwait\npicture {i}.exr\n" for i, text in enumerate(views) if text)
        pictures = self.pictures("wait\npicture 0.exr\n" + script, range(len(views)), "tower.ply")
        for picture, name in zip(pictures, views):
            rows = [(picture[:, :, c].sum(1) * numpy.arange(HEIGHT)).sum() / picture[:, :, c].sum() for c in range(3)]
            self.assertTrue(rows[0] < rows[1] < rows[2], (name, rows))

    def test_the_state_of_a_scene_is_restored(self):
        shutil.rmtree("state", ignore_errors=True)
        last, again = (self.pictures(script + "wait\npicture seen.exr\n", ["seen"], "scene.trip", fresh=False)[0]
                       for script in ("wait\nset --order lists --kernel ewa --sh 1\nkey 2\n", ""))
        anew, = self.pictures("wait\npicture seen.exr\n", ["seen"], "scene.trip")
        self.assertTrue((last == again).all())
        self.assertTrue((last != anew).any())
        shutil.rmtree("state")

    def test_marked_views_of_a_scene_are_key_frames(self):
        for path in glob.glob("scene-*.json"):
            os.remove(path)
        self.view("wait\npicture seen.exr\nkey m\n", "scene.trip")
        self.works("render", "scene.trip", "--path=scene-001.json", f"--size={WIDTH - PANEL}x{HEIGHT}",
                   "--background=0,0,0", "-o", "marked.exr")
        flown, = glob.glob("marked*.exr")
        self.assertTrue((program.read_exr(flown) == program.read_exr("seen.exr")).all())

    def test_scenes_and_volumes_share_a_window(self):
        script = ("wait\npicture scene.exr\nstatus scene.json\nkey tab\nwait\npicture noise.exr\n"
                  "status noise.json\nkey tab\nwait\npicture again.exr\n"
                  f"drop {os.path.abspath('ball.trip')}\nwait\nstatus ball.json\n")
        self.view(script, "scene.trip", "noise.trip")
        self.expect_render("scene", "scene.json")
        self.expect_render("noise", "noise.json", "noise.trip")
        self.assertTrue((program.read_exr("scene.exr") == program.read_exr("again.exr")).all())
        self.assertEqual(self.status("ball.json")["dims"], [24, 24, 24])
        self.assertNotIn("dims", self.status("scene.json"))

    def test_options_that_do_not_apply_are_refused_before_a_window_opens(self):
        for options, says in self.REFUSED:
            for name in "scene.trip", "scene.ply":
                said = self.leaves_nothing(2, "view", name, *options, says=says, env=self.screen.environment).stderr
                self.assertTrue(program.LINE.fullmatch(said), said)
        for options in ("--order", "lists"), ("--sh", "1"):
            self.fails(2, "view", "scene.trip", "noise.trip", *options, says="applies to Gaussian scenes only",
                       env=self.screen.environment)

    REFUSED = [(["--tf=bone"], "--tf: does not apply"), (["--effects=occlusion"], "--effects: must be edl or none"),
               (["--quality=high"], "--quality: does not apply"), (["--engine=io_uring"], "--engine: must be pread"),
               (["--h=0.5"], "--h: does not apply to scenes with --order depth"),
               (["--kernel=fixed"], "fixed does not apply"),
               (["--clip-box=voxels:0,0,0,1,1,1"], "voxels: does not apply")]

    def test_what_does_not_apply_to_an_open_scene_is_said(self):
        program.write("f.tf", b"triptych 1\n")
        said = self.view(f"wait\npicture a.exr\nset --effects occlusion\nset --h 0.2\nwait\npicture b.exr\n"
                         f"drop {os.path.abspath('f.tf')}\nwait\nstatus status.json\npicture c.exr\n"
                         "screenshot said.exr\n", "scene.trip")
        self.assertIn("--effects: must be edl or none for Gaussian scenes", said)
        self.assertIn("--h: does not apply", said)
        for name in "b", "c":
            self.assertTrue((program.read_exr("a.exr") == program.read_exr(f"{name}.exr")).all(), name)

    def test_faults_of_scenes_appear_in_the_window(self):
        with open("scene.ply", "rb") as f:
            program.write("cut.ply", f.read()[:-100])
        shutil.rmtree("spoilt.trip", ignore_errors=True)
        shutil.copytree("scene.trip", "spoilt.trip")
        for path in glob.glob("spoilt.trip/*"):
            if not path.endswith("index.trip"):
                with open(path, "rb") as f:
                    data = bytes(byte ^ 255 for byte in f.read())
                program.write(path, data)
        self.view(f"wait\ndrop {os.path.abspath('cut.ply')}\nwait\nstatus cut.json\n"
                  f"drop {os.path.abspath('spoilt.trip')}\nwait\nstatus spoilt.json\n"
                  "key tab\nwait\nstatus good.json\n", "scene.trip")
        for name, says in ("cut", "is it truncated?"), ("spoilt", "spoilt.trip"):
            status = self.status(f"{name}.json")
            self.assertTrue(status["failed"] and says in status["message"], status)
        self.assertTrue(self.status("good.json")["exact"])

    def test_short_memory_is_said_in_one_line(self):
        gaussians.write_scene("many.ply", gaussians.many(20000))
        self.view("wait\nstatus status.json\n", "many.ply", "--memory=7M")
        status = self.status()
        self.assertTrue(status["failed"] and "raise --memory" in status["message"], status)
        self.assertNotIn("\n", status["message"])

    # ---- scene files ----

    def write_objects(self):
        """Writes scene files with 1600 Gaussians in two objects, and with 800 beside a volume."""
        turned = {"data": "scene.ply", "translate": [2, 0.5, 0], "scale": 0.5,
                  "rotate": {"axis": [0, 1, 0], "degrees": 50}}
        for name, objects in (("scenes", [{"data": "scene.trip"}, turned]),
                              ("mixed", [{"data": "scene.ply"},
                                         {"data": "noise.nrrd", "scale": 0.1, "translate": [-1, -1, -1]}])):
            program.write(f"{name}.json", json.dumps({"objects": objects}).encode())

    def test_scene_files_show_the_picture_of_render(self):
        self.write_objects()
        for name, options, counts in (("scenes", ["--order=lists"], (2, 0, 1600)), ("mixed", [], (2, 1, 800)),
                                      ("mixed", ["--classify=post", "--tf=bone", "--lod=0"], (2, 1, 800))):
            self.view("wait\npicture 0.exr\nstatus 0.json\ndrag left 100 100 150 120 4\nwait\npicture 1.exr\n"
                      "status 1.json\nclick 0.7 Opacity\nkey o\nset --clip-plane 1,0,0,0.2\nwait\npicture 2.exr\n"
                      "status 2.json\n", f"{name}.json", *options)
            tf = [option for option in options if option.startswith("--tf")]
            for i in range(3):
                status = self.status(f"{i}.json")
                self.assertTrue(status["exact"] and not status["failed"], status)
                self.assertEqual((status["objects"], status["volumes"], status["gaussians"]), counts)
                drawn = program.read_exr(f"{i}.exr")
                self.expect_render(i, f"{i}.json", f"{name}.json", tf if "--tf" not in status["camera"] else [])
                self.assertTrue(i == 0 or (drawn != program.read_exr(f"{i - 1}.exr")).any())

    def test_a_scene_file_is_bricked_once(self):
        self.write_objects()
        with tempfile.TemporaryDirectory(prefix="trip-cache-") as cache, \
                unittest.mock.patch.dict(self.screen.environment, XDG_CACHE_HOME=cache), \
                unittest.mock.patch.dict(os.environ, XDG_CACHE_HOME=cache):
            self.view("wait\nstatus status.json\n", "mixed.json")
            self.assertTrue(self.status()["exact"])
            self.assertNotIn(b"bricked", self.works("render", "mixed.json", "-o", "r.png").stdout)
            shutil.rmtree(cache)
            os.mkdir(cache)
            self.assertIn(b"2 of its 2 objects bricked", self.works("render", "mixed.json", "-o", "r.png").stdout)

    def test_controls_that_do_not_apply_to_objects_are_hidden(self):
        self.write_objects()
        self.view("wait\nclick 0.5 Variants of the papers\nwait\nclick 0.5 Order\nwait\nstatus scenes.status\n"
                  "click 0.5 Lists\nwait\nkey tab\nwait\nstatus mixed.status\n", "scenes.json", "mixed.json")
        scenes, mixed = (set(self.status(f"{n}.status")["controls"]) for n in ("scenes", "mixed"))
        self.assertEqual({"Lists", "Sheets"} & scenes, {"Lists"})
        gone = {"Order", "Level of detail", "Transfer function", "Function editor", "Preset", "Light", "Effects",
                "Quality preset", "Debug view", "Probe"}
        self.assertEqual(mixed & gone, set())
        self.assertEqual({"Scene", "Footprint", "Opacity", "Background", "Antialiasing", "Clipping", "Box"} - mixed,
                         set())

    def test_scene_files_can_be_dropped_and_their_state_is_kept(self):
        self.write_objects()
        program.write("f.tf", b"triptych 1\n")
        shutil.rmtree("state", ignore_errors=True)
        dropped = f"wait\ndrop {os.path.abspath('mixed.json')}\nwait\n"
        self.view(dropped + "picture seen.exr\nstatus status.json\n", "ball.trip")
        self.expect_render("seen", "status.json", "mixed.json")
        last, again = (self.pictures(script + "wait\npicture seen.exr\n", ["seen"], "mixed.json", fresh=False)[0]
                       for script in (f"wait\nset --kernel exact\nkey 2\ndrop {os.path.abspath('f.tf')}\n", ""))
        self.assertTrue((last == again).all())
        self.assertTrue((last != program.read_exr("drawn.exr")).any())
        shutil.rmtree("state")

    def test_faults_of_scene_files_are_one_line(self):
        self.write_objects()
        program.write("bare.nrrd", b"not a volume")
        file = lambda *objects: json.dumps({"objects": objects}).encode()
        bad = ((b"{", "is not JSON"), (file(), "1 to 16384 objects"), (file({"data": "none.ply"}), "none.ply"),
               (file({"data": "none.trip"}), "none.trip"), (file({"data": "bad.json"}), "is a scene file itself"),
               (file({"data": "scene.ply", "tf": "bone"}), "leave out tf"),
               (file({"data": "noise.nrrd", "tf": "none.tf"}), "none.tf"),
               (file({"data": "bare.nrrd", "scale": 2}), "bare.nrrd"),
               (file({"data": "scene.ply", "scale": 0}), "scale must be above 0"))
        for text, says in bad:
            program.write("bad.json", text)
            for command in ("view", "bad.json"), ("serve", "bad.json"):
                run = program.call(*command, env=self.screen.environment, timeout=60)
                self.assertIn(run.returncode, (1, 2), (text, run.stderr))
                self.assertTrue(program.LINE.fullmatch(run.stderr) and says in run.stderr, run.stderr)
            self.view(f"wait\ndrop {os.path.abspath('bad.json')}\nwait\nstatus bad.status\nkey tab\nwait\n"
                      "status good.status\n", "mixed.json")
            status = self.status("bad.status")
            self.assertTrue(status["failed"] and says in status["message"], (text, status["message"]))
            self.assertTrue(self.status("good.status")["exact"])

    def test_options_that_do_not_apply_to_objects_are_refused_before_a_window_opens(self):
        self.write_objects()
        for name, option in (("mixed", "--order=lists"), ("mixed", "--lod=2"), ("mixed", "--show=merge"),
                             ("mixed", "--error=1"), ("mixed", "--emission=heat.trip --effects=emission"), ("mixed", "--spacing=1,1,1"), ("mixed", "--max-ms=5"),
                             ("scenes", "--order=sheets"), ("scenes", "--tf=bone"), ("scenes", "--effects=occlusion")):
            for command in "view", "serve":
                said = self.leaves_nothing(2, command, f"{name}.json", *option.split(), says=option.partition("=")[0],
                                           env=self.screen.environment).stderr
                self.assertTrue(program.LINE.fullmatch(said), said)


skip_what_is_missing()
if __name__ == "__main__":
    program.main()
