"""Tests that the examples of README.md run unchanged and draw a picture."""
import os
import re
import shlex
import unittest

import program

try:
    import numpy
    from PIL import Image
except ImportError:
    print("skipped: python3-pil is not installed")
    raise SystemExit(program.SKIPPED)

ROOT = os.environ["TRIP_SOURCE_DIR"]
# Other tests cover these commands: they install, wait for a person, or measure for long.
ELSEWHERE = ("./demo.sh", "./check.sh", "export", "tests/compare/compare", "triptych view",
             "triptych serve", "triptych bench", "triptych accuracy")
# Replacements that make an example faster: smaller volumes, fewer pictures, a given error.
SMALLER = (("512x512x512", "128x128x128"), ("-s 512", "-s 128"), ("--memory 64M", "--memory 96M"),
           ("--orbit 60", "--orbit 3"), ("turn.mp4", "turn.png"), ("--size 512", "--size 96"))


def examples():
    """Yields the command lines in the shell blocks of README.md, without comments."""
    with open(os.path.join(ROOT, "README.md"), encoding="utf-8") as f:
        blocks = re.findall(r"^```sh\n(.*?)^```$", f.read(), re.S | re.M)
    for line in "".join(blocks).replace("\\\n", " ").splitlines():
        words = shlex.split(line, comments=True)
        if words:
            yield shlex.join(words)


def read_picture(path):
    with Image.open(path) as image:
        return numpy.asarray(image.convert("RGB")).astype(int)


class Readme(program.ProgramTest):
    def test_each_example_works_and_draws_a_picture(self):
        os.symlink(program.DATASETS, "datasets")
        pictures = 0
        for line in examples():
            if line.startswith(ELSEWHERE) or "--error" in line:
                continue
            for large, small in SMALLER:
                line = line.replace(large, small)
            name, *arguments = shlex.split(line)
            with self.subTest(line):
                try:
                    program.skip_what_is_switched_off(arguments)
                except unittest.SkipTest:
                    continue
                self.works(*arguments, program={"triptych": program.PROGRAM,
                                                "triptych-generate": program.GENERATE}[name], timeout=200)
                if "render" in arguments:
                    self.assert_not_empty(arguments[arguments.index("-o") + 1])
                    pictures += 1
        self.assertGreater(pictures, 6)

    def assert_not_empty(self, path):
        if not os.path.exists(path):
            path = path.replace(".png", "-000.png")
        pixels = read_picture(path)
        self.assertGreater((abs(pixels - pixels[0, 0]).max(axis=-1) > 16).mean(), 0.01, path)

    def test_all_examples_have_known_options(self):
        for line in examples():
            name, *arguments = shlex.split(line)
            if name != "triptych":
                continue
            text = self.works(arguments[0], "--help=all").stdout.decode()
            for option in arguments:
                if option.startswith("--"):
                    self.assertIn(option.split("=")[0], text, line)

    def test_the_page_is_short_and_its_links_exist(self):
        with open(os.path.join(ROOT, "README.md"), encoding="utf-8") as f:
            text = f.read()
        self.assertLessEqual(text.count("\n"), 140)
        for page in ("README.md", "CONTRIBUTING.md", *(f"docs/{n}" for n in os.listdir(os.path.join(ROOT, "docs"))
                                                     if n.endswith(".md"))):
            with open(os.path.join(ROOT, page), encoding="utf-8") as f:
                text = re.sub(r"```.*?```", "", f.read(), flags=re.S)
            for link in re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", text):
                if not link.startswith("http"):
                    target = os.path.join(ROOT, os.path.dirname(page), link)
                    self.assertTrue(os.path.exists(target), f"{page}: {link}")


if __name__ == "__main__":
    program.main()
