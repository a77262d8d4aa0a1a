"""Tests of the page of `triptych serve` in Chromium without a window. The tests drive the browser
by its DevTools protocol: JSON messages through a pair of pipes. Without Chromium they are
skipped."""
import json
import math
import os
import shutil
import subprocess
import tempfile
import time
import unittest

import program
import test_gaussians as gaussians


class Browser:
    """A browser with one page. Each call waits for its answer."""

    def __init__(self, executable, folder):
        to_browser, commands = os.pipe()
        answers, from_browser = os.pipe()
        words = [
            *(executable, "--headless", "--no-sandbox", "--disable-gpu", "--window-size=400,300"),
            *("--hide-scrollbars", f"--user-data-dir={folder}", "--remote-debugging-pipe"),
            "about:blank",
        ]
        self.process = subprocess.Popen(
            ["/bin/sh", "-c", f'exec "$@" 3<&{to_browser} 4>&{from_browser}', "sh", *words],
            pass_fds=(to_browser, from_browser),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(to_browser)
        os.close(from_browser)
        self.commands = os.fdopen(commands, "wb")
        self.answers, self.rest, self.last, self.session = answers, b"", 0, None
        pages = self.call("Target.getTargets")["targetInfos"]
        page = next(p["targetId"] for p in pages if p["type"] == "page")
        self.session = self.call("Target.attachToTarget", targetId=page, flatten=True)["sessionId"]

    def call(self, method, **parameters):
        self.last += 1
        message = {"id": self.last, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        self.commands.write(json.dumps(message).encode() + b"\0")
        self.commands.flush()
        while True:
            while b"\0" not in self.rest:
                data = os.read(self.answers, 1 << 20)
                if not data:
                    raise AssertionError("the browser has ended")
                self.rest += data
            line, _, self.rest = self.rest.partition(b"\0")
            answer = json.loads(line)
            if answer.get("id") == self.last:
                if "error" in answer:
                    raise AssertionError(answer["error"])
                return answer["result"]

    def value(self, expression):
        result = self.call("Runtime.evaluate", expression=expression, returnByValue=True)
        return result["result"].get("value")

    def close(self):
        self.commands.close()
        self.process.kill()
        self.process.wait()
        os.close(self.answers)


class Page(program.ProgramTest):
    """The page of a data set that write() makes."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        executable = shutil.which("chromium") or shutil.which("google-chrome")
        if not executable:
            raise unittest.SkipTest("Chromium is not installed")
        source = cls.write()
        run = program.call("brick", source, "-o", "v.trip", "-q", *cls.KEPT)
        assert run.returncode == 0, run.stderr
        cls.server = program.start("serve", "v.trip", "--memory", "128M", "--threads", "2")
        address = cls.server.stdout.readline().decode().strip()
        cls.browser = Browser(executable, tempfile.mkdtemp(dir=cls.folder))
        cls.browser.call("Page.navigate", url=address)

    @classmethod
    def tearDownClass(cls):
        if hasattr(cls, "browser"):
            cls.browser.close()
        if hasattr(cls, "server"):
            cls.server.kill()
            cls.server.communicate()
        super().tearDownClass()

    def exact(self, than=None):
        """Waits for a full picture at an address other than `than`. Returns the address."""
        fits = "p.complete && p.naturalWidth === innerWidth && p.naturalHeight === innerHeight"
        for _ in range(6000):
            now = self.browser.value(
                f"(p => document.body.dataset.whole === '1' && {fits} ? p.src : '')"
                "(document.getElementById('picture'))"
            )
            if now and now != than:
                return now
            time.sleep(0.01)
        raise AssertionError("no picture comes: " + str(self.browser.value(
            "document.getElementById('state').textContent")))

    def rest(self):
        """Waits until no more pictures come of what happened before. Returns the address."""
        now = None
        while now != (now := self.exact()) or not self.status()["exact"]:
            time.sleep(0.5)
        return now

    def mouse(self, kind, x, y, **more):
        self.browser.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, **more)

    def status(self):
        return self.browser.call(
            "Runtime.evaluate",
            expression="fetch('/status?' + token).then(a => a.json())",
            awaitPromise=True,
            returnByValue=True,
        )["result"]["value"]

    def ready(self, query):
        """Waits until the control exists, is enabled and is visible."""
        for _ in range(1000):
            if self.browser.value(f"(c => !!c && !c.disabled && !c.parentNode.hidden)"
                                  f"(document.querySelector('{query}'))"):
                return
            time.sleep(0.01)
        raise AssertionError(query)

    def choose(self, query, change):
        self.ready(query)
        self.browser.value(f"(c => {{ c.{change}; c.dispatchEvent(new Event('input')); }})"
                           f"(document.querySelector('{query}'))")


class InBrowser(Page):
    KEPT = ["--keep-all"]

    @staticmethod
    def write():
        program.write_nrrd("v.nhdr", program.noise((24, 28, 32)))
        return "v.nhdr"

    def test_each_control_changes_the_picture(self):
        before = self.exact()
        self.browser.value("document.getElementById('panel').open = true")
        for query, value in (
            ("[data-set=opacity]", "value = '-0.5'"), ("[data-set=background]", "value = '#203040'"),
            ("#parallel", "checked = true"), ("#parallel", "checked = false"), ("#clip", "checked = true"),
            ("#box input", "value = '12'"), ("#clip", "checked = false"),
            ("#shading", "checked = false"),
            ("#shading", "checked = true"), ("#head", "checked = false"),
            ("#round", "value = '90'"), ("#up", "value = '-40'"), ("#head", "checked = true"),
            ("[data-set=classify]", "value = 'post'"), ("[data-set=classify]", "value = 'pre'"),
            ("[data-set=h]", "value = '0.1'"), ("[data-set=method]", "value = 'axis'"),
            ("[data-set=show]", "value = 'lists'"), ("[data-set=show]", "value = 'merge'"),
            ("[data-set=show]", "value = ''"), ("#occlusion", "checked = true"),
            ("#cueing", "checked = true"), ("#fading", "value = '0.2'"), ("#head", "checked = false"),
            ("#shadows", "checked = true"), ("#anisotropy", "value = '0.5'"),
            ("#cueing", "checked = false"), ("#occlusion", "checked = false"),
        ):
            self.choose(query, value)
            before = self.exact(before)
        self.assertEqual(self.status()["effects"], "shadows")
        self.assertEqual(self.shown_effects(), {"shadows": True, "anisotropy": True, "light-cells": True})
        self.assertTrue(self.browser.value("document.getElementById('emission').disabled"))
        self.browser.value("document.getElementById('panel').open = false")

    def shown_effects(self):
        """Returns the checked boxes and the visible numbers of the effects, once there are two."""
        shown = {}
        for _ in range(1000):
            shown = self.browser.value(
                "Object.fromEntries([...document.querySelectorAll('#effects input')].filter("
                "c => c.type === 'checkbox' ? c.checked : !c.parentNode.hidden).map("
                "c => [c.id, true]))")
            if len(shown) == 2:
                break
            time.sleep(0.01)
        return shown

    def test_drags_keys_and_functions_change_the_picture(self):
        before = self.rest()
        cameras = [self.status()["camera"]]

        def changed():
            nonlocal before
            before = self.exact(before)
            cameras.append(self.status()["camera"])
            self.assertNotEqual(cameras[-1], cameras[-2])

        self.mouse("mousePressed", 200, 100, button="left", buttons=1, clickCount=1)
        self.mouse("mouseMoved", 260, 120, button="left", buttons=1)
        self.mouse("mouseReleased", 260, 120, button="left", clickCount=1)
        changed()
        self.mouse("mouseWheel", 200, 100, deltaX=0, deltaY=-200)
        changed()
        for kind in ("keyDown", "keyUp"):
            self.browser.call("Input.dispatchKeyEvent", type=kind, key="f", code="KeyF", text="f")
        changed()
        self.browser.value(
            "(s => { s.value = 'bone'; s.dispatchEvent(new Event('change')); })"
            "(document.getElementById('function'))"
        )
        before = self.exact(before)
        self.assertEqual(self.status()["camera"], cameras[-1] + " --tf bone")

    def key(self, kind, key, code, modifiers=0):
        self.browser.call("Input.dispatchKeyEvent", type=kind, key=key, code=code,
                          modifiers=modifiers)

    def sent(self):
        """Waits until the page has sent all events. Returns the lines since the last call."""
        for _ in range(1000):
            if self.browser.value("!sending && !events.length"):
                return self.browser.value("log.splice(0)")
            time.sleep(0.01)
        raise AssertionError("events do not go")

    def test_held_keys_and_buttons_are_released(self):
        self.exact()
        self.browser.value("log = []; kept = put; put = line => { log.push(line); kept(line); };")
        self.key("keyDown", "w", "KeyW")
        self.key("keyDown", "Control", "ControlLeft", 2)
        self.key("keyUp", "w", "KeyW", 2)
        self.key("keyUp", "Control", "ControlLeft")
        self.assertEqual(self.sent(), ["hold w", "let w +control"])
        self.key("keyDown", "d", "KeyD")
        self.mouse("mousePressed", 200, 100, button="left", buttons=1, clickCount=1)
        self.browser.value("dispatchEvent(new Event('blur'))")
        self.key("keyUp", "d", "KeyD")
        self.mouse("mouseReleased", 200, 100, button="left", clickCount=1)
        lines = [line for line in self.sent() if not line.startswith("move")]
        self.assertEqual(lines, ["hold d", "press left", "let d", "release left"])
        for kind in "keyDown", "keyUp":
            self.key(kind, "t", "KeyT")
        self.assertEqual(self.sent(), [])
        self.browser.value("put = kept")
        self.exact()

    def touch(self, kind, *points):
        self.browser.call("Input.dispatchTouchEvent", type=kind,
                          touchPoints=[{"x": x, "y": y, "id": i} for i, (x, y) in enumerate(points)])

    def test_a_finger_drags_and_two_fingers_zoom(self):
        self.exact()
        self.browser.value("log = []; kept = put; put = line => { log.push(line); kept(line); };")
        self.touch("touchStart", (200, 100))
        self.touch("touchMove", (260, 120))
        self.touch("touchEnd")
        self.assertEqual(self.sent(), ["move 200 100", "press left", "move 260 120", "move 260 120",
                                       "release left"])
        # Fingers twice as far apart come as close as log(2) / -log(0.88) wheel steps.
        self.touch("touchStart", (150, 100))
        self.touch("touchStart", (150, 100), (200, 100))
        self.touch("touchMove", (150, 100), (250, 100))
        self.touch("touchEnd")
        lines = self.sent()
        self.assertEqual(lines[:3], ["move 150 100", "press left", "release left"])
        steps = [float(line.split()[1]) for line in lines if line.startswith("wheel")]
        self.assertAlmostEqual(sum(steps), math.log(2) / -math.log(0.88), 3)
        self.assertEqual([line for line in lines[3:] if not line.startswith("wheel")], ["move 250 100"])
        # The browser takes the pointer away.
        self.touch("touchStart", (200, 100))
        self.touch("touchCancel")
        self.assertEqual(self.sent()[-1], "release left")
        self.browser.value("put = kept")

    def test_a_tapped_key_flies(self):
        """The page may send the press and the release together."""
        self.exact()
        before = self.status()["camera"]
        self.browser.value("events.push('hold w', 'let w'), send(), 0")
        for _ in range(1000):
            if self.status()["camera"] != before:
                return
            time.sleep(0.01)
        raise AssertionError("the eye has not moved")

    def test_a_reloaded_page_shows_current_settings_and_warnings(self):
        before = self.exact()
        chosen = "[document.getElementById('function').value, " \
                 "+document.querySelector('[data-set=opacity]').value]"
        for name, power in ("ct-bone", -0.5), ("", 0):
            self.browser.value(
                f"(s => {{ s.value = '{name}'; s.dispatchEvent(new Event('change')); }})"
                "(document.getElementById('function'))")
            before = self.exact(before)
            self.browser.value(f"set('opacity', String(10 ** {power}))")
            before = self.exact(before)
            self.browser.call("Page.reload")
            self.exact()
            for _ in range(1000):
                if self.browser.value(chosen) == [name, power]:
                    break
                time.sleep(0.01)
            self.assertEqual(self.browser.value(chosen), [name, power])
            for _ in range(300):
                said = self.browser.value("document.getElementById('state').textContent")
                if "Hounsfield" in said:
                    break
                time.sleep(0.01)
            self.assertIn("Hounsfield", said)
        # the note covers parts of the page that other tests click on
        self.browser.value("noted = -NOTE_MS; say('exact')")


class SceneInBrowser(Page):
    KEPT = []

    @staticmethod
    def write():
        gaussians.write_scene("v.ply", gaussians.many(500, degree=1), 1)
        return "v.ply"

    def labels(self):
        """Returns the labels of the controls that can be seen."""
        return set(self.browser.value(
            "[...document.querySelectorAll('#panel label')].filter(l => l.offsetParent !== null)"
            ".map(l => l.firstChild.textContent.trim())"))

    def test_only_controls_that_apply_are_shown(self):
        self.exact()
        self.browser.value("panel.open = document.getElementById('papers').open = true")
        self.ready("#order")
        shown = {"Order", "Footprint", "Harmonics", "Opacity", "Background", "Early termination", "Parallel view",
                 "Clip box", "Eye-dome lighting"}
        for order, more in ("depth", set()), ("lists", {"Method", "Blend start (h)", "Debug view"}), ("depth", set()):
            self.choose("#order", f"value = '{order}'")
            for _ in range(500):
                if self.labels() == shown | more:
                    break
                time.sleep(0.01)
            self.assertEqual(self.labels(), shown | more)
        self.exact()

    def test_each_control_changes_the_picture(self):
        before = self.exact()
        for query, value in (
            ("#order", "value = 'lists'"), ("[data-set=h]", "value = '0.1'"), ("[data-set=method]", "value = 'axis'"),
            ("#kernel", "value = 'exact'"), ("#sh", "value = '0'"), ("[data-set=opacity]", "value = '0.5'"),
            ("[data-set=background]", "value = '#203040'"), ("#order", "value = 'depth'"),
            ("#kernel", "value = ''"), ("#sh", "value = ''"), ("#order", "value = 'lists'"),
            ("#parallel", "checked = true"), ("#clip", "checked = true"), ("#box input", "value = '0'"),
            ("#box label:last-child input", "value = '0.1'"),
        ):
            self.choose(query, value)
            before = self.exact(before)
        camera = self.status()["camera"]
        for option in "--order lists", "--ortho ", "--clip-box 0,":
            self.assertIn(option, camera)
        self.browser.call("Page.reload")
        self.exact()
        self.ready("#order")
        for _ in range(500):
            said = self.browser.value("state.textContent")
            if said.startswith("exact, 500 Gaussians by lists, "):
                break
            time.sleep(0.01)
        self.assertTrue(said.startswith("exact, 500 Gaussians by lists, "), said)
        self.assertEqual(self.browser.value("[order.value, document.querySelector('[data-set=background]').value]"),
                         ["lists", "#203040"])
        self.assertEqual(self.browser.value("[parallel.checked, clip.checked, box.hidden, faces[0].value]"),
                         [True, True, False, "0"])
        for query, value in ("#order", "value = 'depth'"), ("#clip", "checked = false"), ("#parallel", "checked = false"):
            self.choose(query, value)
        self.exact()


class CloudInBrowser(Page):
    KEPT = ["--radius=2x"]

    @staticmethod
    def write():
        shutil.copy(os.path.join(program.DATASETS, "lamp.ply"), "v.ply")
        return "v.ply"

    def test_each_control_of_light_changes_the_picture(self):
        before = self.exact()
        self.browser.value("panel.open = true")
        self.ready("#shading")
        self.assertFalse(self.browser.value("shading.checked"))  # colours of a camera
        for query, value in (
            ("#edl", "checked = true"), ("#edl-strength", "value = '2'"), ("#edl-radius", "value = '4'"),
            ("#shading", "checked = true"), ("#head", "checked = false"), ("#round", "value = '90'"),
            ("#up", "value = '-40'"), ("#edl", "checked = false"), ("#shading", "checked = false"),
        ):
            self.choose(query, value)
            before = self.exact(before)
        self.choose("#shading", "checked = true")
        self.choose("#edl", "checked = true")
        self.exact(before)
        status = self.status()
        self.assertEqual(status["effects"], "eye-dome lighting")
        self.assertIn("--effects edl --edl-strength 2 --edl-radius 4", status["camera"])
        self.assertIn("--light ", status["camera"])


if __name__ == "__main__":
    program.main()
