"""Tests of scripts/: packages come from the mirrors that the machine itself uses."""
import glob
import os
import re
import shutil
import subprocess
import unittest

import program

ROOT = os.environ["TRIP_SOURCE_DIR"]
ONE_LINE = """deb-src http://sources.example/debian bookworm main
deb [arch=amd64 signed-by=/k.gpg] http://security.example/debian bookworm-security main
# deb http://off.example/debian bookworm main
deb [arch=amd64 signed-by=/k.gpg] http://one.example/some/debian/ bookworm main contrib
"""
DEB822 = """Types: deb
URIs: http://security.example/debian
Suites: bookworm-security
Components: main

Enabled: no
Types: deb
URIs: http://off.example/debian
Suites: bookworm
Components: main

Types: deb
URIs: https://two.example/debian
Suites: bookworm-updates bookworm
Components: main
"""


@unittest.skipUnless(shutil.which("apt-get"), "apt-get is missing")
class Mirror(program.ProgramTest):
    def mirror(self, one_line="", deb822=""):
        """Runs mirror.sh for a machine that has only these sources and was never updated."""
        for folder in "sources.list.d", "apt.conf.d", "preferences.d":
            os.makedirs(os.path.join("apt", folder), exist_ok=True)
        for name, text in ("sources.list", one_line), ("sources.list.d/a.sources", deb822):
            with open(os.path.join("apt", name), "w") as f:
                f.write(text)
        with open("apt.conf", "w") as f:
            f.write(f'Dir::Etc "{self.folder}/apt";\nDir::State::Lists "{self.folder}/lists";\n')
        return subprocess.run(
            [os.path.join(ROOT, "scripts/mirror.sh"), "bookworm"],
            env={**os.environ, "APT_CONFIG": os.path.join(self.folder, "apt.conf")},
            capture_output=True, text=True, check=False,
        )

    def test_one_line_sources_are_read(self):
        self.assertEqual(self.mirror(one_line=ONE_LINE).stdout, "http://one.example/some/debian\n")

    def test_deb822_sources_are_read(self):
        self.assertEqual(self.mirror(deb822=DEB822).stdout, "https://two.example/debian\n")

    def test_sources_with_a_suite_name_are_read(self):
        run = self.mirror(one_line=ONE_LINE.replace(" bookworm ", " oldstable "))
        self.assertEqual(run.stdout, "http://one.example/some/debian\n")

    def test_a_machine_without_sources_gives_one_error_line(self):
        run = self.mirror()
        self.assertEqual((run.returncode, run.stdout), (1, ""))
        self.assertRegex(run.stderr, r"\Amirror: [^\n]*bookworm\n\Z")


class Scripts(program.ProgramTest):
    def test_no_script_names_a_host(self):
        for path in glob.glob(os.path.join(ROOT, "scripts", "*.sh")):
            with open(path) as f:
                text = "".join(line for line in f if not line.lstrip().startswith("#"))
            self.assertFalse(re.search(r"https?://\w", text), path)


if __name__ == "__main__":
    program.main()
