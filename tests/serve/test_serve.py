"""Tests `triptych serve` by HTTP requests such as a browser makes."""
import http.client
import json
import os
import shlex
import signal
import struct
import tempfile
import time
import unittest.mock
import urllib.parse
import zlib

import numpy

import program


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


if __name__ == "__main__":
    program.main()
