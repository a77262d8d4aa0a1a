"""Tests `triptych serve` by HTTP requests such as a browser makes."""
import http.client
import json
import os
import select
import shlex
import signal
import socket
import struct
import tempfile
import threading
import time
import unittest.mock
import urllib.parse
import zlib

import numpy

import program
import test_gaussians as gaussians

ANSWER_S = 3  # a request with the token is answered within this time
STRANGER_S = 5  # whole time of a connection that has not shown the token
GUEST_S = 10  # time of each step of a connection that has
LATE_S = 4  # for a loaded machine


def read_png(data):
    """Decodes a PNG with 8 bits per channel, not interlaced, as height x width x channels."""
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at, packed = 8, b""
    while at < len(data):
        (size,) = struct.unpack_from(">I", data, at)
        name, chunk = data[at + 4 : at + 8], data[at + 8 : at + 8 + size]
        if name == b"IHDR":
            width, height, depth, colour = struct.unpack_from(">IIBB", chunk)
            assert depth == 8 and colour in (2, 6)
        packed += chunk if name == b"IDAT" else b""
        at += size + 12
    channels = 4 if colour == 6 else 3
    rows = numpy.frombuffer(zlib.decompress(packed), numpy.uint8)
    rows = rows.reshape(height, 1 + width * channels)
    picture = numpy.zeros((height, width, channels), numpy.uint8)
    above = numpy.zeros((width, channels), int)
    for y, row in enumerate(rows):
        line = row[1:].reshape(width, channels).astype(int)
        above = unfilter(row[0], line, above)
        picture[y] = above
    return picture


def unfilter(kind, line, above):
    """Reverses PNG filter `kind` of a row."""
    if kind == 0:
        return line
    if kind == 2:
        return (line + above) & 255
    if kind == 1:
        return numpy.cumsum(line, axis=0) & 255
    out = numpy.zeros_like(line)
    zero = numpy.zeros(line.shape[1], int)
    for x, value in enumerate(line):
        a, b = (out[x - 1] if x else zero), above[x]
        c = above[x - 1] if x else zero
        if kind == 3:
            guess = (a + b) // 2
        else:
            p = a + b - c
            pa, pb, pc = abs(p - a), abs(p - b), abs(p - c)
            guess = numpy.where((pa <= pb) & (pa <= pc), a, numpy.where(pb <= pc, b, c))
        out[x] = (value + guess) & 255
    return out


class Serve(program.ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        program.write_nrrd("v.nhdr", program.noise((24, 28, 32)))
        program.write_nrrd("heat.nhdr", program.noise((12, 14, 32)))
        for name in "v", "heat":
            run = program.call("brick", f"{name}.nhdr", "-o", f"{name}.trip", "-q", "--keep-all")
            assert run.returncode == 0, run.stderr

    def setUp(self):
        self.serve("v.trip")

    def serve(self, *arguments):
        self.server = program.start("serve", *arguments, "--memory", "128M", "--threads", "2")
        self.address = self.server.stdout.readline().decode().strip()
        url = urllib.parse.urlsplit(self.address)
        self.host, self.port = url.hostname, url.port
        self.token = urllib.parse.parse_qs(url.query)["token"][0]

    def tearDown(self):
        if self.server.poll() is None:
            self.server.kill()
        self.server.communicate()

    def ask(self, path, method="GET", body=None, headers=None, **arguments):
        """Sends a request. Returns status, headers and body."""
        arguments.setdefault("token", self.token)
        query = urllib.parse.urlencode({k: v for k, v in arguments.items() if v is not None})
        connection = http.client.HTTPConnection(self.host, self.port, timeout=60)
        connection.request(method, f"{path}?{query}", body, headers or {})
        answer = connection.getresponse()
        data = answer.read()
        connection.close()
        return answer.status, answer.headers, data

    def do(self, *lines):
        status, _, data = self.ask("/events", "POST", "\n".join(lines))
        self.assertEqual(status, 204, data)

    def status(self):
        return json.loads(self.ask("/status")[2])

    def whole_picture(self, after=0):
        """Waits for the next full picture. Returns the picture, its number and its camera
        options."""
        while True:
            status, headers, data = self.ask("/picture", after=after)
            self.assertIn(status, (200, 204))
            if status == 200 and headers["X-Whole"] == "1":
                self.assertEqual(headers["Content-Type"], "image/png")
                return read_png(data), int(headers["X-Picture"]), self.status()["camera"]
            if status == 200:
                self.assertEqual(headers["Content-Type"], "image/jpeg")
                self.assertEqual(data[:3] + data[-2:], b"\xff\xd8\xff\xff\xd9")
                after = headers["X-Picture"]

    def assert_rendered(self, picture, camera, *options):
        self.works("render", "v.trip", "-o", "r.png", *shlex.split(camera), *options)
        with open("r.png", "rb") as f:
            expected = read_png(f.read())
        numpy.testing.assert_array_equal(picture[..., :3], expected[..., :3])

    def test_the_picture_at_rest_equals_render(self):
        picture, number, camera = self.whole_picture()
        self.assertEqual(picture.shape[:2], (768, 1024))
        self.do("resize 120 90")
        picture, number, camera = self.whole_picture(number)
        self.assertEqual(picture.shape[:2], (90, 120))
        self.assert_rendered(picture, camera)
        self.do("drag left 60 45 90 40 3")
        turned, number, there = self.whole_picture(number)
        self.assertNotEqual(there, camera)
        self.assert_rendered(turned, there)
        self.assertTrue((turned != picture).any())
        status, _, _ = self.ask("/function", "POST", name="bone")
        self.assertEqual(status, 204)
        bone, number, shown = self.whole_picture(number)
        self.assert_rendered(bone, there, "--tf", "bone")
        self.assert_rendered(bone, shown)
        self.assertTrue(self.status()["exact"])

    def test_each_setting_is_drawn(self):
        self.do("resize 60 50")
        picture, number, camera = self.whole_picture()
        pre = ["--classify=pre"]
        flat = [*pre, "--no-shading"]
        for name, value, options in (
            ("classify", "pre", pre),
            ("classify", "post", ["--classify=post"]),
            ("classify", "pre", pre),
            ("no-shading", "1", flat),
            ("show", "lists", [*flat, "--show=lists"]),
            ("show", "picture", flat),
            ("method", "axis", [*flat, "--method=axis"]),
            ("method", "merge", flat),
            ("h", "0.2", [*flat, "--h=0.2"]),
            ("early-termination", "0.05", [*flat, "--h=0.2", "--early-termination=0.05"]),
            ("early-termination", "", [*flat, "--h=0.2"]),
            ("opacity", "0.1", [*flat, "--h=0.2", "--opacity-scale=0.1"]),
        ):
            status, _, data = self.ask("/set", "POST", name=name, value=value)
            self.assertEqual(status, 204, data)
            before = picture
            picture, number, shown = self.whole_picture(number)
            self.assert_rendered(picture, camera, *options)
            self.assert_rendered(picture, shown)
            self.assertTrue((picture != before).any(), (name, value))
        for name, value in (
            ("classify", "x"), ("shading", "2"), ("h", "1"), ("h", "nan"),
            ("early-termination", "0.11"), ("early-termination", "-2"), ("early-termination", "x"),
            ("opacity", "0"), ("opacity", "1e9"), ("light", "1"), ("light", "1,91"),
            ("light", "nan,0,9"), ("light", "0,91,9"), ("light", "0,0,0"), ("light", "1,2,3,4"),
            ("light", "," * 500), ("light", "turn"), ("samples", "65"), ("depth", "1"), ("count", "1"), ("", ""), ("emission", "1"),
            ("cueing", "2"), ("occlusion", ""), ("auto", "yes"), ("fading", "0"), ("fading", "1.1"),
            ("anisotropy", "nan"), ("anisotropy", "-1"), ("coldest", "-1"), ("hottest", "1e9"),
            ("light-cells", "7"), ("light-cells", "1025"), ("light-cells", "8.5"),
        ):
            self.assertEqual(self.ask("/set", "POST", name=name, value=value)[0], 400, (name, value))
        self.assertEqual(self.ask("/set", "POST", name="light", value="30,45,1.5")[0], 204)
        # without shading and effects, the light is no setting of the picture
        self.assertEqual(self.status()["settings"], {
            "classify": "pre", "method": "merge", "show": "picture", "no-shading": "1", "h": "0.2"})
        self.assertIn("bone", json.loads(self.ask("/presets")[2]))

    def test_a_point_light_equals_render(self):
        self.do("resize 60 50")
        before, number, camera = self.whole_picture()
        for value in ("30,45,0.7", "30,45,1.2", "30,45,10"):
            self.assertEqual(self.ask("/set", "POST", name="light", value=value)[0], 204)
            picture, number, camera = self.whole_picture(number)
            self.assertEqual("--light point:" in camera, value != "30,45,10", camera)
            self.assert_rendered(picture, camera)
            self.assertTrue((picture != before).any(), value)
            before = picture

    def test_a_light_that_turns_keeps_its_direction_when_it_is_fixed(self):
        self.do("resize 60 50")
        before, number, camera = self.whole_picture()
        self.assertEqual(self.ask("/set", "POST", name="light", value="60,20")[0], 204)
        turning, number, camera = self.whole_picture(number)
        self.assertIn("--light 0.8", camera)  # left is sin 60 cos 20 = 0.81
        self.assert_rendered(turning, camera)
        self.assertTrue((turning != before).any())
        self.assertEqual(self.ask("/set", "POST", name="light", value="fixed")[0], 204)
        for _ in range(200):
            camera = self.status()["camera"]
            if "--light world:" in camera:
                break
            time.sleep(0.05)
        self.assertIn("--light world:", camera)
        self.assertFalse(self.status()["light"]["turns"])
        self.assertEqual(self.ask("/set", "POST", name="light", value="turns")[0], 204)
        now = self.status()["light"]
        self.assertTrue(now["turns"])
        self.assertAlmostEqual(now["round"], 60, 9)
        self.assertAlmostEqual(now["up"], 20, 9)

    def test_effects_can_be_switched_and_equal_render(self):
        self.tearDown()
        self.serve("v.trip", "--effects", "auto", "--emission", "heat.trip")
        self.do("resize 60 50")
        before, number, camera = self.whole_picture()
        for name, value in (
            ("auto", "0"), ("emission", "1"), ("hottest", "4000"), ("coldest", "500"), ("emission", "0"),
            ("light", "30,45,10"), ("shadows", "1"), ("anisotropy", "0.5"),
            ("light-cells", "9"), ("shadows", "0"), ("occlusion", "1"), ("cueing", "1"), ("fading", "0.25"),
        ):
            status, _, data = self.ask("/set", "POST", name=name, value=value)
            self.assertEqual(status, 204, (name, data))
            picture, number, camera = self.whole_picture(number)
            self.assert_rendered(picture, camera)
            self.assertTrue((picture != before).any(), (name, value))
            before = picture
        now = self.status()
        self.assertEqual(now["effects"], "occlusion, depth cueing")
        self.assertEqual([e["name"] for e in now["switches"] if e["on"]], ["occlusion", "cueing"])
        self.assertEqual({n["name"]: n["value"] for e in now["switches"] for n in e["numbers"]},
                         {"anisotropy": 0.5, "light-cells": 9, "fading": 0.25, "coldest": 500,
                          "hottest": 4000})
        self.assertEqual({e["name"]: [n["name"] for n in e["numbers"]] for e in now["switches"] if e["on"]},
                         {"occlusion": ["light-cells"], "cueing": ["fading"]})
        self.assertFalse(now["light"]["head"])
        for name, degrees in ("round", 30), ("up", 45):
            self.assertAlmostEqual(now["light"][name], degrees, 9)
        self.ask("/set", "POST", name="light", value="head")
        lacking = {e["name"]: e["lacks"] for e in self.status()["switches"] if e["lacks"]}
        self.assertEqual(lacking, {"shadows": "the light is the headlight"})

    def test_emission_equals_render(self):
        for renderer in "cpu", *program.GL:
            self.tearDown()
            self.serve("v.trip", "--effects", "emission", "--emission", "heat.trip", "--temperature",
                       "500:3000", "--renderer", renderer)
            self.do("resize 60 50")
            picture, _, camera = self.whole_picture()
            self.assertIn("--emission", camera)
            self.assert_rendered(picture, camera, "--renderer", renderer)
            cold = camera[: camera.index(" --effects")]
            with self.assertRaises(AssertionError):
                self.assert_rendered(picture, cold, "--renderer", renderer)
            self.assertEqual(self.status()["effects"], "emission of heat.trip, 500 to 3000 K")

    # ---- Gaussian scenes ----

    def serve_scene(self, *arguments):
        """Serves a scene in place of the volume, in a small picture."""
        self.tearDown()
        if not os.path.exists("scene.ply"):
            gaussians.write_scene("scene.ply", gaussians.many(800, degree=2), 2)
            self.works("brick", "scene.ply", "-o", "scene.trip", "-q")
        self.serve(*(arguments or ["scene.trip"]))
        self.do("resize 120 90")

    def scene_picture(self, after=0, data="scene.trip", options=()):
        """Waits for the full picture, and expects the bits of `render`."""
        picture, number, camera = self.whole_picture(after)
        while picture.shape[:2] != (90, 120):  # drawn before the change of size
            picture, number, camera = self.whole_picture(number)
        while "--size 120x90" not in camera:  # said before the change
            camera = self.status()["camera"]
        self.works("render", data, "-o", "r.png", *options, *shlex.split(camera))
        with open("r.png", "rb") as f:
            expected = read_png(f.read())
        numpy.testing.assert_array_equal(picture[..., :3], expected[..., :3], camera)
        return picture, number, camera

    def test_each_setting_of_a_scene_equals_render(self):
        self.serve_scene()
        before, number, _ = self.scene_picture()
        scene = self.status()["scene"]
        self.assertTrue(scene["text"].startswith("800 Gaussians by depth, "), scene["text"])
        for name, value, says in (
            *(("order", order, f"--order {order}") for order in self.entries("order")[2:]),
            ("order", "lists", "--order lists"),
            ("h", "0.2", "--h 0.2"), ("method", "axis", "--method axis"), ("kernel", "exact", "--kernel exact"),
            ("kernel", "ewa", "--kernel ewa"), ("sh", "0", "--sh 0"), ("sh", "1", "--sh 1"),
            ("opacity", "3", "--opacity-scale 3"), ("background", "#204060", "--background"),
            ("samples", "2", "--samples 2"), ("clip-plane", "1,0,0,0", "--clip-plane 1,0,0,0"),
            ("early-termination", "0.1", "--early-termination 0.1"),
        ):
            self.assertEqual(self.ask("/set", "POST", name=name, value=value)[0], 204, name)
            picture, number, camera = self.scene_picture(number)
            self.assertIn(says, camera)
            self.assertTrue((picture != before).any(), name)
            before = picture
        self.do("key o")
        parallel, number, camera = self.scene_picture(number)
        self.assertIn("--ortho", camera)
        self.assertTrue((parallel != before).any())
        self.assertIn("800 Gaussians by lists", self.status()["scene"]["text"])

    def entries(self, name):
        choice, = (c for c in self.status()["scene"]["choices"] if c["name"] == name)
        return [e["value"] for e in choice["entries"]]

    def test_the_page_gets_the_choices_that_the_scene_has(self):
        self.serve_scene()
        self.whole_picture()
        self.assertEqual(self.entries("order"), gaussians.orders())
        self.assertEqual(self.entries("kernel"), ["", "exact", "ewa"])
        self.assertEqual(self.entries("sh"), ["", "0", "1"])
        status = self.status()
        self.assertNotIn("light", status)
        self.assertEqual([e["name"] for e in status["switches"]], ["edl"])
        self.assertEqual((status["function"], status["effects"]), ("", ""))
        applies = status["scene"]["applies"]
        self.assertIn("background", applies)
        for name in "h", "method", "classify", "quality", "no-shading", "interpolation", "show":
            self.assertNotIn(name, applies)

    def test_what_does_not_apply_to_a_scene_is_refused(self):
        self.serve_scene()
        _, number, camera = self.whole_picture()
        for name, value in (("effects", "occlusion"), ("occlusion", "1"), ("light", "45,30"), ("classify", "post"),
                            ("h", "0.5"), ("method", "clip"), ("kernel", "fixed"), ("quality", "high"),
                            ("show", "lists"), ("clip-box", "voxels:0,0,0,1,1,1"), ("order", "nonsense")):
            self.assertEqual(self.ask("/set", "POST", name=name, value=value)[0], 400, name)
        self.assertEqual(self.ask("/function", "POST", name="bone")[0], 400)
        self.assertEqual(self.status()["camera"], camera)
        self.tearDown()
        self.serve("v.trip")
        self.whole_picture()
        for name, value in ("order", "lists"), ("sh", "0"):
            self.assertEqual(self.ask("/set", "POST", name=name, value=value)[0], 400, name)
        for options, says in ((["--tf=bone"], "--tf: does not apply"), (["--effects=occlusion"], "--effects: "),
                              (["--engine=null"], "--engine: must be pread"), (["--h=0.5"], "--h: does not apply")):
            for name in "scene.trip", "scene.ply":
                self.leaves_nothing(2, "serve", name, *options, says=says)
        self.leaves_nothing(2, "serve", "v.trip", "--order=lists", says="applies to Gaussian scenes only")

    def test_a_scene_file_is_bricked_and_shown(self):
        self.serve_scene("scene.ply", "--order=lists", "--sh=1")
        _, _, camera = self.scene_picture(data="scene.ply")
        self.assertIn("--order lists --sh 1", camera)

    def test_light_and_effects_of_a_cloud_equal_render(self):
        cloud, brick = os.path.join(program.DATASETS, "lamp.ply"), ("--radius=2x", "--k=8")
        self.serve_scene(cloud, *brick)
        before, number, _ = self.scene_picture(0, cloud, brick)
        self.assertFalse(self.status()["light"]["shading"])
        for name, value, says in (
            ("occlusion", "1", "--effects occlusion"), ("light-cells", "40", "--light-cells 40"),
            ("edl", "1", "--effects occlusion,edl"), ("edl-strength", "2", "--edl-strength 2"),
            ("edl-radius", "3", "--edl-radius 3"), ("shading", "1", "--light head"), ("light", "60,20", "--light 0.8"),
            ("light", "60,20,0.4", "--light point:"), ("edl", "0", "--light point:"),
            ("occlusion", "0", "--light point:"),
            ("shading", "0", "--no-shading"), ("auto", "1", "--effects auto"),
        ):
            self.assertEqual(self.ask("/set", "POST", name=name, value=value)[0], 204, name)
            picture, number, camera = self.scene_picture(number, cloud, brick)
            self.assertIn(says, camera)
            self.assertTrue((picture != before).any(), name)
            before = picture
        self.assertEqual([e["name"] for e in self.status()["switches"]], ["occlusion", "auto", "edl"])
        for name, value in ("shadows", "1"), ("cueing", "0.5"), ("shading", "2"), ("edl-radius", "0.5"):
            self.assertEqual(self.ask("/set", "POST", name=name, value=value)[0], 400, name)
        self.tearDown()
        for command in "serve", "view":
            for name, says in ("v.trip", "is a data set"), ("v.nhdr", "applies to clouds"), ("scene.ply", "applies to clouds"):
                self.leaves_nothing(2, command, name, "--color=height", says=says)
        self.serve("v.trip")

    def test_a_fault_of_a_scene_is_a_line_on_stderr(self):
        self.serve_scene()
        with open("scene.ply", "rb") as f:
            program.write("cut.ply", f.read()[:-100])
        self.serve_scene("cut.ply")
        for _ in range(200):
            if self.status()["failed"]:
                break
            time.sleep(0.02)
        self.assertIn("is it truncated?", self.status()["message"])
        self.server.send_signal(signal.SIGINT)
        _, err = self.server.communicate(timeout=20)
        self.assertEqual(self.server.returncode, 0)
        self.assertTrue(program.LINE.fullmatch(err.decode()), err)

    def test_a_scene_file_with_a_volume_equals_render(self):
        self.serve_scene()  # writes scene.ply
        objects = [{"data": "scene.ply"}, {"data": "v.nhdr", "scale": 0.1, "translate": [-1, -1, -1]}]
        program.write("objects.json", json.dumps({"objects": objects}).encode())
        self.serve_scene("objects.json")
        before, number, _ = self.scene_picture(data="objects.json")
        status = self.status()
        self.assertTrue(status["scene"]["text"].startswith("1 volume and 1 scene, 800 Gaussians by depth, "), status)
        self.assertEqual([c["name"] for c in status["scene"]["choices"]], ["kernel", "sh"])
        applies = status["scene"]["applies"]
        for name in "lod", "max-ms", "show", "sheet", "count":
            self.assertNotIn(name, applies)
        self.assertEqual({"light", "switches"} & set(status), set())
        for name, value in (("kernel", "exact"), ("opacity", "3"), ("no-shading", "1"), ("classify", "post"),
                            ("background", "#204060"), ("clip-plane", "1,0,0,0")):
            self.assertEqual(self.ask("/set", "POST", name=name, value=value)[0], 204, name)
            picture, number, _ = self.scene_picture(number, "objects.json")
            self.assertTrue((picture != before).any(), name)
            before = picture
        for name, value in ("order", "lists"), ("show", "lists"), ("lod", "2"):
            self.assertEqual(self.ask("/set", "POST", name=name, value=value)[0], 400, name)
        self.assertEqual(self.ask("/function", "POST", name="bone")[0], 400)

    def test_a_volume_is_bricked_and_shown(self):
        cache = tempfile.TemporaryDirectory(prefix="trip-cache-")  # no data set keeps more values
        self.addCleanup(cache.cleanup)
        changed = unittest.mock.patch.dict(os.environ, XDG_CACHE_HOME=cache.name)
        changed.start()
        self.addCleanup(changed.stop)
        self.tearDown()
        self.serve("v.nhdr")
        self.do("resize 40 30")
        while not self.status()["exact"]:
            self.assertFalse(self.status()["failed"], self.status())
            time.sleep(0.02)
        status, headers, data = self.ask("/picture", after=0)
        self.assertEqual(headers["X-Whole"], "1")
        self.works("render", "v.nhdr", "-o", "r.png", *shlex.split(self.status()["camera"]))
        with open("r.png", "rb") as f:
            numpy.testing.assert_array_equal(read_png(data)[..., :3], read_png(f.read())[..., :3])
        self.assertEqual(self.ask("/function", "POST", name="grey")[0], 204)
        while "dropped" not in self.status()["message"]:
            time.sleep(0.02)
        self.assertIn("to keep them: triptych brick --tf grey v.nhdr", self.status()["message"])

    def test_a_request_waits_for_a_new_picture(self):
        self.do("resize 40 30")
        while not self.status()["exact"]:
            time.sleep(0.01)
        status, headers, _ = self.ask("/picture", after=0)
        last = headers["X-Picture"]
        self.assertEqual((status, headers["X-Whole"]), (200, "1"))
        waiting = http.client.HTTPConnection(self.host, self.port, timeout=60)
        waiting.request("GET", f"/picture?token={self.token}&after={last}")
        self.do("wheel 2")
        answer = waiting.getresponse()
        self.assertEqual(answer.status, 200)
        self.assertGreater(int(answer.headers["X-Picture"]), int(last))
        answer.read()
        waiting.close()

    def test_the_page_loads_nothing_from_other_hosts(self):
        status, headers, page = self.ask("/")
        self.assertEqual(status, 200)
        self.assertTrue(headers["Content-Type"].startswith("text/html"))
        self.assertIn("default-src 'none'", headers["Content-Security-Policy"])
        self.assertNotIn(b"http", page.replace(b"<!doctype html>", b""))

    def test_the_automatic_choice_has_the_name_of_the_option(self):
        _, _, page = self.ask("/")
        self.assertIn(b'<option value="">Automatic</option>', page)

    def test_only_local_requests_with_the_token_are_answered(self):
        for path in ("/", "/picture", "/status", "/presets", "/nothing"):
            for token in (None, "", "0" * 32, self.token[:-1], self.token.upper() + "x"):
                self.assertEqual(self.ask(path, token=token)[0], 403, (path, token))
        for host in ("evil.example", f"evil.example:{self.port}", f"127.0.0.1:{self.port + 1}"):
            status, _, said = self.ask("/", headers={"Host": host})
            self.assertEqual(status, 403)
            self.assertIn(b"ssh -L has to forward a port of the same number", said)
        self.assertEqual(self.ask("/", headers={"Host": f"localhost:{self.port}"})[0], 200)
        listening = open("/proc/net/tcp", encoding="ascii").read().split("\n")[1:]
        places = [l.split()[1] for l in listening if l and l.split()[3] == "0A"]
        self.assertIn(f"0100007F:{self.port:04X}", places)
        self.assertNotIn(f"00000000:{self.port:04X}", places)

    def test_the_server_survives_bad_requests(self):
        before = set(os.listdir("."))
        for body in (
            "screenshot x.png", "picture x.png", "status x.json", "drop v.trip", "close", "wait",
            "sleep 100000", "random 1000000 1", "type abc", "key q", "hold p", "key m", "key c", "key t", "resize 99999 10",
            "resize 1 1", "nonsense", "move 1 nan", "move 0 0\n" * 1001, "\0", "move 1 1\nkey q",
        ):
            self.assertEqual(self.ask("/events", "POST", body)[0], 400, body)
        self.assertIn(self.ask("/events", "POST", "move 1 1\n" * 20000)[0], (400, 413))
        self.assertEqual(self.ask("/function", "POST", name="../../etc/passwd")[0], 400)
        for after in ("", "x", "-1", "1e3", " 1"):
            self.assertEqual(self.ask("/picture", after=after)[0], 400, after)
        self.assertEqual(self.ask("/nothing")[0], 404)
        self.assertEqual(self.ask("/", "DELETE")[0], 405)
        for garbage in (b"\0\0\0\0\r\n\r\n", b"GET\r\n\r\n", b"A" * 100000 + b"\r\n\r\n"):
            connection = http.client.HTTPConnection(self.host, self.port, timeout=60)
            connection.connect()
            try:
                connection.sock.sendall(garbage)
                connection.sock.settimeout(1)
                connection.sock.recv(1000)
            except OSError:
                pass
            connection.close()
        self.assertEqual(self.ask("/")[0], 200)
        self.assertEqual(set(os.listdir(".")), before)
        self.assertIsNone(self.server.poll())

    def test_the_status_has_the_current_transfer_function_and_opacity(self):
        self.tearDown()
        program.write("own.tf", b"0 0 0 0 0\n255 1 1 1 1\n")
        self.serve("v.trip", "--tf", "own.tf")

        def drawn():
            status = self.status()
            return status["function"], status["opacity"]

        self.assertEqual(drawn(), ("own.tf", 1))
        for name in "bone", "", "own.tf":
            self.assertEqual(self.ask("/function", "POST", name=name)[0], 204)
            self.assertEqual(drawn(), (name, 1))
        self.assertEqual(self.ask("/set", "POST", name="opacity", value="0.25")[0], 204)
        self.assertEqual(drawn(), ("own.tf", 0.25))

    def test_a_later_fault_is_a_line_on_stderr(self):
        self.tearDown()
        program.write("short.nrrd", b"NRRD0004\ntype: uint8\ndimension: 3\nsizes: 9 9 9\n"
                                    b"encoding: raw\n\nshort")
        self.serve("short.nrrd")
        while not self.status()["failed"]:
            time.sleep(0.01)
        line = self.server.stderr.readline().decode()
        self.assertTrue(program.LINE.fullmatch(line), line)
        self.assertIn("short.nrrd", line)
        self.assertIsNone(self.server.poll())

    def test_an_interrupt_ends_the_server(self):
        self.ask("/picture", after=0)
        self.server.send_signal(signal.SIGINT)
        self.assertEqual(self.server.wait(60), 0)

    def test_a_report_must_measure_the_data_set_of_the_volume(self):
        self.works("brick", "v.nhdr", "-q", "-o", "usual.trip")
        program.write_report("usual", "usual.trip")
        program.write_report("splats", "usual.trip", classify="pre")
        program.write_report("other", None)
        for report in "usual", "splats", "other":
            self.tearDown()
            self.serve("v.nhdr", "--error", "255", "--report", report)
            status = self.status()
            while not (status["exact"] or status["failed"]):
                self.ask("/picture", after=0)
                status = self.status()
            self.assertEqual(status["failed"], report == "other", status)
            if status["failed"]:
                self.assertIn("the report measured another data set", status["message"])

    def test_invalid_input_is_refused(self):
        self.fails(1, "serve", "no.trip")
        self.fails(2, "serve")
        self.fails(2, "serve", "v.trip", "--port", "65536")
        self.fails(1, "serve", "v.trip", "--tf", "no.tf")
        self.fails(1, "serve", "v.nhdr", "--tf", "no.tf", says="no.tf")
        program.write("README.md", b"# No volume")
        self.fails(1, "serve", "README.md", says="README.md")
        self.fails(2, "serve", "v.trip", "--effects", "emission", says="--emission HEAT.trip")
        self.fails(2, "serve", "v.trip", "--emission", "heat.trip", says="--effects emission")
        self.fails(1, "serve", "v.trip", "--effects", "auto", "--emission", "no.trip", says="no.trip")
        self.fails(1, "serve", "v.trip", "--port", self.port, says="--port, or 0 for a free")
    def test_port_80_is_left_out_of_the_host(self):
        self.tearDown()
        self.server = program.start("serve", "v.trip", "--port", "80")
        address = self.server.stdout.readline().decode().strip()
        if not address:
            self.skipTest(f"no server on port 80 here: {self.server.stderr.read().decode()}")
        self.host, self.port, self.token = "127.0.0.1", 80, address.partition("token=")[2]
        for host, status in (("127.0.0.1", 200), ("localhost", 200), ("127.0.0.1:80", 200),
                             ("127.0.0.1:81", 403), ("evil.example", 403)):
            self.assertEqual(self.ask("/status", headers={"Host": host})[0], status, host)
        for origin, status in (("http://localhost", 204), ("http://evil.example", 403)):
            said = self.ask("/events", "POST", "move 1 1", headers={"Origin": origin})
            self.assertEqual(said[0], status, origin)


class Connections(program.ProgramTest):
    """Sends bytes that no browser would send, at times that no browser would choose."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        program.write_nrrd("v.nhdr", program.noise((12, 14, 16)))
        run = program.call("brick", "v.nhdr", "-o", "v.trip", "-q", "--keep-all")
        assert run.returncode == 0, run.stderr

    def setUp(self):
        self.server = program.start("serve", "v.trip", "--memory", "128M", "--threads", "2")
        url = urllib.parse.urlsplit(self.server.stdout.readline().decode().strip())
        self.port, self.token = url.port, url.query
        self.host = f"Host: 127.0.0.1:{self.port}\r\n"
        self.sockets = []

    def tearDown(self):
        for s in self.sockets:
            s.close()
        self.server.kill()
        self.server.communicate()

    def connect(self, data=b"", buffer=None):
        s = socket.socket()
        self.sockets.append(s)
        s.settimeout(60)
        if buffer:
            s.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, buffer)
        s.connect(("127.0.0.1", self.port))
        try:
            s.sendall(data)
        except OSError:  # the server has dropped it
            pass
        return s

    def request(self, line, *headers, body="", token=True):
        """Returns a request's bytes. `line` is a method, a path and perhaps a version."""
        method, path, version = (line.split() + ["HTTP/1.1"])[:3]
        query = f"?{self.token}" if token else ""
        lines = "".join(h + "\r\n" for h in headers)
        return f"{method} {path}{query} {version}\r\n{self.host}{lines}\r\n{body}".encode()

    def reply(self, data):
        """Sends bytes. Returns the status, or 0 without a reply, and the whole reply."""
        s, said = self.connect(data), b""
        try:
            while b"\r\n\r\n" not in said:
                part = s.recv(65536)
                if not part:
                    break
                said += part
        except ConnectionResetError:
            pass
        s.close()
        self.assertTrue(not said or said.startswith(b"HTTP/1.1 "), said)
        return int(said.split()[1]) if said else 0, said

    def status(self, line, *headers, body="", token=True):
        start = time.monotonic()
        status, said = self.reply(self.request(line, *headers, body=body, token=token))
        self.assertLess(time.monotonic() - start, ANSWER_S, (line, headers))
        return status

    def threads(self):
        return len(os.listdir(f"/proc/{self.server.pid}/task"))

    def open_sockets(self):
        """Counts the server's sockets. It closes one when the thread of its connection has ended."""
        folder = f"/proc/{self.server.pid}/fd"
        count = 0
        for name in os.listdir(folder):
            try:
                count += os.readlink(f"{folder}/{name}").startswith("socket:")
            except FileNotFoundError:
                pass
        return count

    def test_half_requests_lock_nobody_out(self):
        halves = (b"", b"GET / HT", self.request("GET /status")[:-2],
                  self.request("POST /events", "Content-Length: 60000", token=False))
        for i in range(64):
            self.connect(halves[i % len(halves)])
        self.assertEqual(self.status("GET /status"), 200)
        stop = threading.Event()

        def flood():  # keeps every place taken
            while not stop.is_set():
                self.connect(b"GET / HT")
                if len(self.sockets) > 500:
                    self.sockets.pop(0).close()
                time.sleep(0.002)

        thread = threading.Thread(target=flood)
        thread.start()
        try:
            for _ in range(10):
                time.sleep(0.1)
                self.assertEqual(self.status("GET /status"), 200)
        finally:
            stop.set()
            thread.join()
        self.assertLess(self.threads(), 100)

    def test_the_last_connection_with_the_token_is_answered(self):
        first = self.connect(self.request("GET /presets"))
        for _ in range(100):
            s = self.connect(self.request("GET /status"))
            self.assertIn(b"200 OK", s.recv(65536))
        first.settimeout(ANSWER_S)  # 100 later connections have taken its place
        try:
            while first.recv(65536):
                pass
        except ConnectionResetError:
            pass
        self.assertEqual(self.status("GET /status"), 200)
        self.assertLess(self.threads(), 100)

    def test_no_step_of_a_connection_outlasts_its_time(self):
        """A byte every now and then keeps no connection."""
        before = self.open_sockets()
        body = self.request("POST /events", "Content-Length: 60000")
        slow = {
            "silence": (self.connect(), b"", STRANGER_S),
            "header": (self.connect(b"GET /"), b"a", STRANGER_S),
            "refused body": (self.connect(b"POST / HTTP/1.1\r\n"), b"x: y\r\n", STRANGER_S),
            "body": (self.connect(body), b"#", GUEST_S),
            "second header": (self.connect(self.request("GET /presets") + b"GET /"), b"a", GUEST_S),
            "rest": (self.connect(self.request("GET /presets")), b"", GUEST_S),
            "reply": (self.connect(self.request("GET /") * 4000, buffer=4096), b"", GUEST_S),
        }
        self.assertEqual(self.status("GET /status"), 200)
        start, ended = time.monotonic(), {}
        while len(ended) < len(slow) and time.monotonic() - start < GUEST_S + LATE_S:
            for name in slow.keys() - ended.keys():
                s, byte, _ = slow[name]
                poll = select.poll()
                poll.register(s, select.POLLRDHUP)
                if poll.poll(0):
                    ended[name] = time.monotonic() - start
                    continue
                try:
                    s.sendall(byte)
                except OSError:
                    pass
            time.sleep(0.2)
        for name, (_, _, limit) in slow.items():
            self.assertIn(name, ended)
            self.assertLess(ended[name], limit + LATE_S, name)
            self.assertGreater(ended[name], limit - 1, name)
        for _ in range(10 * LATE_S):
            if self.open_sockets() == before:
                break
            time.sleep(0.1)
        self.assertEqual(self.open_sockets(), before)

    def test_requests_are_refused_before_their_body(self):
        long, waits = "Content-Length: 1000000000", "Expect: 100-continue"
        for headers in (long,), (long, waits), ("Content-Length: 8", waits):
            for line, token, wanted in (("POST /events", False, 403), ("DELETE /events", True, 405)):
                status, said = self.reply(self.request(line, *headers, token=token))
                self.assertEqual(status, wanted, headers)
                self.assertIn(b"Connection: close", said)
        self.assertEqual(self.status("POST /events", long), 413)
        self.assertEqual(self.status("POST /events", long, waits), 413)
        self.assertEqual(self.status("POST /events", "Content-Length: 65537"), 413)
        self.assertEqual(self.status("POST /events", "Content-Length: 65536", waits), 100)
        status, said = self.reply(f"POST /events?{self.token} HTTP/1.1\r\nHost: evil\r\n{long}\r\n"
                                  "\r\n".encode())
        self.assertEqual(status, 403)
        for origin, wanted in (("http://evil.example", 403), ("null", 403), ("", 403),
                               ("https://127.0.0.1:1", 403), (f"http://127.0.0.1:{self.port}", 204),
                               (f"http://127.0.0.1:{self.port}0", 403),
                               (f"http://localhost:{self.port}", 204)):
            said = self.status("POST /events", f"Origin: {origin}", "Content-Length: 8",
                               body="move 1 1")
            self.assertEqual(said, wanted, origin)
        self.assertEqual(self.status("POST /events", long, "Origin: http://evil.example"), 403)

    def test_headers_have_a_limit(self):
        cookie = "Cookie: " + "c" * 6000  # of another server on this machine
        self.assertEqual(self.status("GET /status", cookie), 200)
        self.assertEqual(self.status("GET /status", "x: " + "y" * 20000), 431)
        self.assertEqual(self.status("GET /status", *["x: y"] * 2000), 431)
        self.assertEqual(self.status("GET /" + "y" * 20000), 414)
        self.assertIn(self.reply(b"GET / HTTP/1.1\r\nx: " + b"y" * 1000000)[0], (431, 0))
        self.assertIn(self.reply(b"G" * 1000000)[0], (400, 414, 431, 0))

    def test_every_form_of_request_is_answered_or_refused(self):
        self.assertEqual(self.status("GET /status HTTP/1.0"), 200)
        self.assertEqual(self.status("GET /status HTTP/9.1"), 505)
        self.assertEqual(self.status("GET /status", self.host.strip()), 403)
        self.assertEqual(self.reply(f"GET /?{self.token} HTTP/1.0\r\n\r\n".encode())[0], 403)
        self.assertEqual(self.reply(f"GET /?{self.token} HTTP/1.1\r\n\r\n".encode())[0], 400)
        for path in "/", "/status", "/presets":
            status, said = self.reply(self.request(f"HEAD {path}"))
            self.assertEqual(status, 200)
            self.assertTrue(said.endswith(b"\r\n\r\n"), said)
        for method in "OPTIONS", "PUT", "DELETE", "TRACE", "PATCH", "TRIPTYCH", "get":
            status, said = self.reply(self.request(f"{method} /status"))
            self.assertEqual(status, 405)
            self.assertIn(b"Allow: GET, HEAD, POST\r\n", said)
            self.assertEqual(self.status(f"{method} /status", token=False), 403)
        chunks = "Transfer-Encoding: chunked"
        event, part = "8\r\nmove 1 1\r\n", "1000\r\n" + "move 1 1" * 512 + "\r\n"
        for headers, body, wanted in (
            ([chunks], event + "0\r\n\r\n", 204),
            ([chunks], "-" + event, 400),
            ([chunks], "ffffffffffffffffff\r\nmove 1 1", 413),
            ([chunks], part * 17, 0),
            ([chunks, "Content-Length: 8"], event + "0\r\n\r\n", 400),
            (["Content-Length: 8"] * 2, "move 1 1", 400),
            (["Content-Length: 8", "Content-Length: 7"], "move 1 1", 400),
            (["Content-Length: -1"], "move 1 1", 400),
            (["Content-Length: 99999999999999999999"], "move 1 1", 413),
            ([], "", 204),
        ):
            self.assertEqual(self.status("POST /events", *headers, body=body), wanted,
                             (headers, body[:20]))
        s = self.connect(self.request("GET /presets") * 2 +
                         self.request("GET /nothing", "Connection: close"))
        said = b""
        while part := s.recv(65536):
            said += part
        self.assertEqual([r.split()[0] for r in said.split(b"HTTP/1.1 ")[1:]],
                         [b"200", b"200", b"404"])

    def test_only_the_pages_of_the_server_are_sent(self):
        for path in ("/index.html", "/page.html", "//", "/../v.trip", "/v.trip", "/v.nhdr",
                     "/../../../../etc/passwd", "/%2e%2e/v.trip", "/..%2fv.trip", "/status/",
                     "/status/../presets", "/%2fetc%2fpasswd", "\\v.trip"):
            self.assertEqual(self.status(f"GET {path}"), 404, path)

    def test_slow_clients_do_not_delay_the_end(self):
        for _ in range(20):
            self.connect(b"GET / HT")
            self.connect(self.request("POST /events", "Content-Length: 9"))
        self.connect(self.request("GET /") * 4000, buffer=4096)
        self.connect(self.request("GET /picture"))
        self.assertEqual(self.status("GET /status"), 200)
        self.server.send_signal(signal.SIGINT)
        self.assertEqual(self.server.wait(ANSWER_S), 0)


if __name__ == "__main__":
    program.main()
