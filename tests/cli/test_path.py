"""Tests of camera paths, of several frames in flight, and of videos. Videos are made by ffmpeg, and
by a stand-in that keeps its input or fails."""
import json
import math
import os
import signal
import shutil
import stat
import subprocess
import sys
import unittest

import numpy

import program

ENCODER = """#!%s
import os, sys
if os.environ.get("ENCODER_FAILS"):
    sys.stdin.buffer.read(5)
    sys.exit("frame 1: no such codec")
data = sys.stdin.buffer.read()
open("given", "w").write("\\n".join(sys.argv[1:]))
assert sys.argv[-1].startswith("file:"), sys.argv
open(sys.argv[-1][5:], "wb").write(data)
"""
SIZE = ("--size", "40x30")


def key(seconds, degrees, **more):
    """Returns a key frame with the eye at an angle around the centre of the volume."""
    x, y = math.sin(math.radians(degrees)), -math.cos(math.radians(degrees))
    eye = [15.5 + 90 * x, 15.5 + 90 * y, 15.5]
    return dict(seconds=seconds, eye=eye, look=[15.5] * 3, up=[0, 0, 1], fov=30) | more


def options(k):
    return [
        *("--eye", ",".join(map(repr, k["eye"])), "--look", "15.5,15.5,15.5", "--up", "0,0,1"),
        *("--fov", "30"),
    ]


def decoded(video, height, width):
    """Returns the frames of a video with 8 bits per channel, decoded by ffmpeg."""
    command = ["ffmpeg", "-loglevel", "error", "-i", video, "-vf", "scale=in_color_matrix=bt709"]
    run = subprocess.run(
        [*command, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"], capture_output=True, check=True
    )
    return numpy.frombuffer(run.stdout, numpy.uint8).reshape(-1, height, width, 3).astype(float)


def rate_of(video):
    command = ["ffprobe", "-loglevel", "error", "-show_entries", "stream=r_frame_rate"]
    run = subprocess.run(
        [*command, "-of", "csv=p=0", video], capture_output=True, check=True, text=True
    )
    return run.stdout.strip()


def blob():
    """Returns a smooth, elongated blob off the centre, which looks different from each side."""
    x, y, z = numpy.mgrid[:32, :32, :32].astype(float)
    there = numpy.exp(-((x - 9) ** 2 / 40 + (y - 16) ** 2 / 90 + (z - 20) ** 2 / 30))
    return (255 * there).astype(numpy.uint8)


class Paths(program.ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        program.write_nrrd("v.nhdr", program.noise((32, 32, 32)))
        run = program.call("brick", "v.nhdr", "-o", "v.trip", "-q", "--keep-all")
        assert run.returncode == 0, run.stderr
        program.write_nrrd("blob.nhdr", blob())
        run = program.call("brick", "blob.nhdr", "-o", "blob.trip", "-q")
        assert run.returncode == 0, run.stderr
        os.mkdir("bin")
        program.write("bin/ffmpeg", (ENCODER % sys.executable).encode())
        os.chmod("bin/ffmpeg", stat.S_IRWXU)
        cls.with_encoder = dict(os.environ, PATH=os.path.abspath("bin"))

    def path(self, *keys, **more):
        path = dict(triptych_path=1, frames_per_second=4, keys=keys) | more
        program.write("path.json", json.dumps(path).encode())
        return "path.json"

    def frames(self, *arguments, name="f.exr"):
        """Renders the frames. Returns the contents of their files in order."""
        stem, extension = os.path.splitext(name)
        for old in [f for f in os.listdir(".") if f.startswith(stem + "-")]:
            os.remove(old)
        self.works("render", "v.trip", "-o", name, *SIZE, *arguments)
        files = sorted(f for f in os.listdir(".") if f.startswith(stem + "-"))
        self.assertEqual(files, [f"{stem}-{i:03d}{extension}" for i in range(len(files))])
        return [open(f, "rb").read() for f in files]

    def single(self, *arguments):
        self.works("render", "v.trip", "-o", "s.exr", *SIZE, *arguments)
        with open("s.exr", "rb") as f:
            return f.read()

    def test_frames_in_flight_equal_single_pictures(self):
        path = self.path(key(0, 0), key(1, 60), key(2, 120))
        one = self.frames("--path", path, "--in-flight", "1")
        self.assertEqual(len(one), 9)
        for count in ("2", "3", "16"):
            self.assertEqual(self.frames("--path", path, "--in-flight", count), one)
        self.assertEqual(self.frames("--path", path), one)
        self.assertEqual(self.frames("--path", path, "--stats", "s.json"), one)
        for frame, degrees in ((0, 0), (4, 60), (8, 120)):
            self.assertEqual(self.single(*options(key(0, degrees))), one[frame])
        cameras = [f["camera"].split() for f in json.load(open("s.json"))["frames"]]
        for frame in (1, 6):  # frames between keys have the printed view
            self.assertEqual(self.single(*cameras[frame]), one[frame])
            eye = [float(x) for x in cameras[frame][1].split(",")]
            expected = key(0, 15 * frame)["eye"]
            numpy.testing.assert_allclose(eye, expected, atol=1e-9)

    def test_frames_in_flight_do_not_change_an_orbit(self):
        one = self.frames("--orbit", "5", "--in-flight", "1")
        self.assertEqual(len(set(one)), 5)
        self.assertEqual(self.frames("--orbit", "5"), one)
        self.assertEqual(self.frames("--orbit", "5", "--in-flight", "4"), one)

    def test_frames_are_drawn_one_by_one_in_little_memory(self):
        one = self.frames("--orbit", "3", "--in-flight", "1", "--memory", "64M")
        together = ("--orbit", "3", "--in-flight", "16", "--memory", "64M", "--size", "500x500")
        alone = ("--orbit", "3", "--in-flight", "1", "--memory", "64M", "--size", "500x500")
        self.assertEqual(self.frames(*together), self.frames(*alone))
        self.assertEqual(self.frames("--orbit", "3"), one)

    def test_distances_equal_single_pictures(self):
        path = self.path(key(0, 0), key(1, 60))
        self.frames("--path", path, "--depth", "z.tif")
        self.single(*options(key(0, 60)), "--depth", "s.tif")
        self.assertEqual(open("z-004.tif", "rb").read(), open("s.tif", "rb").read())

    def test_transfer_functions_are_interpolated(self):
        first, last = "0 1 0 0 0\n255 1 0 0 0.2\n", "0 0 0 1 0\n100 0 1 1 0.1\n255 0 0 1 0.6\n"
        program.write("last.tf", last.encode())
        path = self.path(
            key(0, 30), key(0.5, 30, function_text=first), key(1.5, 30, function="last.tf")
        )
        frames = self.frames("--path", path, "--tf", "last.tf")
        self.assertEqual(len(frames), 7)
        # A quarter of the way, at each of 0, 100 and 255, the weights are 3/4 and 1/4.
        middle = (1 - 0.25) * 0.2 * 100 / 255 + 0.25 * 0.1
        quarter = (
            f"0 0.75 0 0.25 0\n100 0.75 0.25 0.25 {middle!r}\n"
            f"255 0.75 0 0.25 {0.75 * 0.2 + 0.25 * 0.6!r}\n"
        )
        for frame, text in ((0, last), (2, first), (3, quarter), (6, last)):
            program.write("f.tf", text.encode())
            program.write("got.exr", frames[frame])
            program.write("expected.exr", self.single(*options(key(0, 30)), "--tf", "f.tf"))
            numpy.testing.assert_allclose(
                program.read_linear_exr("got.exr"),
                program.read_linear_exr("expected.exr"),
                atol=0 if frame != 3 else 1e-5,
            )
        self.assertNotEqual(frames[2], frames[3])

    def test_a_volume_is_bricked_for_all_transfer_functions_of_a_path(self):
        program.write_nrrd("ball.nrrd", program.ball((20, 20, 20)))
        faint, clear = "1 1 0 0 0\n60 1 0 0 0.3\n200 1 0 0 0\n", "0 0 0 0 0\n255 1 1 1 0.5\n"
        program.write("clear.tf", clear.encode())
        options = key(0, 0, function_text=faint), key(0.25, 9, function="clear.tf")
        path = self.path(*options)
        run = program.call("brick", "ball.nrrd", "-o", "all.trip", "-q", "--keep-all")
        self.assertEqual(run.returncode, 0, run.stderr)
        for volume in "ball.nrrd", "all.trip":
            said = self.works("render", volume, "--path", path, "--no-shading", *SIZE, "-o",
                              f"{volume}.exr")
            self.assertEqual(said.stderr, "")
        for frame in "000", "001":
            numpy.testing.assert_allclose(*(program.read_exr(f"{v}-{frame}.exr")
                                            for v in ("ball.nrrd", "all.trip")), atol=0.02)

    def test_bad_paths_are_refused_by_name(self):
        good = key(0, 0)
        for path, says in (
            ("{", "path.json: line 1: incomplete JSON"),
            ([good | {"zoom": 3}], 'key 1: unknown member "zoom"'),
            ('{"triptych_path": 9, "keys": []}', "has version 9"),
            ([good, good], "key 2: must be later"),
            ([good | {"fov": "wide"}], 'key 1: "fov"'),
            ([good | {"eye": good["look"]}], "key 1: is no view"),
            ([good, key(1e5, 0)], "frames or more"),
            ([good | {"function": "no-such.tf"}], "no-such.tf"),
            ([good | {"function_text": "0 0 0 0 7\n"}], "line 1"),
            ([good | {"function_text": "values normalised\n0 0 0 0 0\n"}], "data units"),
        ):
            if isinstance(path, str):
                program.write("path.json", path.encode())
            else:
                self.path(*path)
            self.leaves_nothing(
                1, "render", "v.trip", "-o", "x.png", "--path", "path.json", says=says
            )
        self.path(good)
        self.leaves_nothing(1, *("render", "v.trip", "-o", "x.png", "--path", "no.json"))
        for more in (["--zoom", "2"], ["--orbit", "3"], ["--view", "top"], ["--fov", "20"]):
            self.leaves_nothing(
                *(2, "render", "v.trip", "-o", "x.png", "--path", "path.json", *more),
                says="--path",
            )

    def test_a_video_gets_the_pixels_of_the_pictures(self):
        path = self.path(key(0, 0), key(1, 60))
        for more in (["--path", path], ["--path", path, "--in-flight", "1"]):
            run = self.works(
                *("render", "v.trip", "-o", "a.mp4", *SIZE, *more), env=self.with_encoder
            )
            self.assertRegex(run.stdout, rb"\Aa\.mp4: 5 pictures of 40 x 30, [\d.]+ s each, [^\n]*\n\Z")
            with open("a.mp4", "rb") as f:
                video = numpy.frombuffer(f.read(), numpy.uint8).reshape(5, 30, 40, 3)
            given = open("given").read().split("\n")
            self.assertEqual(given[given.index("-framerate") + 1], "4")
            self.assertEqual(given[given.index("-video_size") + 1], "40x30")
            self.frames("--path", path)
            for i, frame in enumerate(video):
                display = program.read_exr(f"f-{i:03d}.exr")[..., :3]
                numpy.testing.assert_allclose(frame, 255 * display, atol=0.51)
        os.remove("a.mp4")
        self.works(
            *("render", "v.trip", "-o", "a.webm", *SIZE, "--orbit", "3", "--fps", "12.5"),
            env=self.with_encoder,
        )
        given = open("given").read().split("\n")
        self.assertEqual(given[given.index("-framerate") + 1], "12.5")
        self.assertEqual(os.path.getsize("a.webm"), 3 * 3600)
        os.remove("a.webm")

    def test_a_turntable_prints_one_line(self):
        orbit = ("render", "v.trip", *SIZE, "--orbit", "4", "-o", "turn.png")
        line = (rb"turn-000\.png to turn-003\.png: 4 pictures of 40 x 30, [\d.]+ s each, "
                rb"[\d.]+ s in all, [\d.]+ MB of memory at peak\n")
        for more in (), ("--in-flight", "1"), ("--stats", "s.json"):
            run = self.works(*orbit, *more)
            self.assertRegex(run.stdout, rb"\A" + line + rb"\Z")
            self.assertEqual(run.stderr, "")
        self.assertEqual(self.works(*orbit, "-q").stdout, b"")
        named = self.works(*orbit, "--explain").stdout  # a line ends each picture's explanation
        self.assertEqual([named.count(b"turn-%03d.png: 40 x 30, " % i) for i in range(4)], [1] * 4)

    def test_an_interrupted_turntable_counts_its_pictures(self):
        for output, says in ("turn.png", "are written"), ("turn.mp4", "no video is written"):
            process = program.start(
                "render", "v.trip", "-o", output, "--size", "600x600", "--orbit", "5000",
                "--renderer", "integral", env=self.with_encoder)
            program.await_handler(process)
            process.send_signal(signal.SIGINT)
            err = process.communicate()[1].decode()
            self.assertEqual(process.returncode, 1)
            lines = err.splitlines()
            self.assertIn("interrupted", lines[0])
            if len(lines) > 1:  # the signal came while pictures were drawn
                self.assertRegex(lines[1], rf"note: {output}: .*\d+ of 5000 pictures .*{says}")
            self.assertLessEqual(len(lines), 2)
            self.assertFalse(os.path.exists("turn.mp4"))

    def test_a_higher_frame_rate_keeps_the_duration(self):
        path = self.path(key(0, 0), key(1, 60))
        videos = []
        for options, rate, frames in ([], "4", 5), (["--fps", "8"], "8", 9):
            self.works("render", "v.trip", "-o", "a.mp4", *SIZE, "--path", path, *options,
                       env=self.with_encoder)
            given = open("given").read().split("\n")
            self.assertEqual(given[given.index("-framerate") + 1], rate)
            with open("a.mp4", "rb") as f:
                videos.append(numpy.frombuffer(f.read(), numpy.uint8).reshape(frames, 30, 40, 3))
        self.assertTrue((videos[1][::2] == videos[0]).all())
        self.assertTrue((videos[1][1::2] != videos[0][1:]).any())
        path = self.path(key(0, 0), key(200, 60))
        self.leaves_nothing(2, "render", "v.trip", "-o", "b.mp4", "--path", path, "--fps", "600",
                            env=self.with_encoder, says="100000 frames")

    @unittest.skipUnless(shutil.which("ffmpeg") and shutil.which("ffprobe"), "no ffmpeg")
    def test_a_video_shows_the_pictures_in_order(self):
        size = ("--size", "160x120")
        path = self.path(key(0, 0), key(0.5, 40), key(1, 80))
        look = ("--path", path, "--tf", "grey", *size)
        self.works("render", "blob.trip", "-o", "p.exr", *look)
        pictures = [255 * program.read_exr(f"p-{i:03d}.exr")[..., :3] for i in range(5)]
        for extension in "mp4", "mov", "mkv", "webm":
            video = "c." + extension
            self.works("render", "blob.trip", "-o", video, *look)
            frames = decoded(video, 120, 160)
            self.assertEqual(len(frames), 5)
            self.assertEqual(rate_of(video), "4/1")
            for i, frame in enumerate(frames):
                apart = [numpy.abs(frame - p).mean() for p in pictures]
                self.assertEqual(numpy.argmin(apart), i)
                self.assertLess(apart[i], 2)
            os.remove(video)

    def test_a_failed_video_leaves_nothing(self):
        orbit = ("--orbit", "4", *SIZE)
        self.leaves_nothing(
            *(1, "render", "v.trip", "-o", "b.mp4", *orbit),
            env=dict(self.with_encoder, ENCODER_FAILS="1"),
            says="b.mp4: ffmpeg failed: frame 1: no such codec",
        )
        self.leaves_nothing(
            *(1, "render", "v.trip", "-o", "b.mp4", *orbit),
            env=dict(os.environ, PATH="/nowhere"),
            says="ffmpeg, which is not installed",
        )
        self.leaves_nothing(
            *(2, "render", "v.trip", "-o", "b.mp4", "--orbit", "4", "--size", "41x30"),
            env=self.with_encoder,
            says="even",
        )
        self.leaves_nothing(2, "render", "v.trip", "-o", "b.mp4", says="--orbit or --path")
        self.leaves_nothing(
            2, "render", "v.trip", "-o", "b.png", "--orbit", "4", "--fps", "5", says="--fps"
        )
        self.leaves_nothing(
            2, "render", "v.trip", "-o", "b.png", "--in-flight", "2", says="--in-flight"
        )


if __name__ == "__main__":
    program.main()
