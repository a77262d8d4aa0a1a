"""Tests the installed library, which programs find by pkg-config. As a shared and as a static
library it draws the same picture as the program. Only the functions of its headers are visible."""
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

CMAKE, BUILD, SOURCE, CC, CXX = sys.argv[1:]
DATA = os.path.join(SOURCE, "datasets", "tooth.nhdr")
VIEW = ["--size", "320x240", "--view", "iso", "--azimuth", "30", "--background", "0,0,0.25"]


def run(*command, **options):
    result = subprocess.run(command, capture_output=True, text=True, timeout=300, **options)
    if result.returncode:
        raise AssertionError(f"{command}: {result.returncode}\n{result.stdout}{result.stderr}")
    return result.stdout


@unittest.skipUnless(shutil.which("pkg-config"), "pkg-config is missing")
class Installed(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.prefix = os.path.join(cls.folder.name, "prefix")
        run(CMAKE, "--install", BUILD, "--prefix", cls.prefix)
        [pc] = [root for root, _, files in os.walk(cls.prefix) if "triptych.pc" in files]
        cls.libraries = os.path.dirname(pc)
        cls.environment = dict(os.environ, PKG_CONFIG_PATH=pc, LD_LIBRARY_PATH=cls.libraries)
        cls.program = os.path.join(cls.prefix, "bin", "triptych")
        cls.data = os.path.join(cls.folder.name, "tooth.trip")
        run(cls.program, "brick", DATA, "-o", cls.data)
        cls.expected = os.path.join(cls.folder.name, "expected.exr")
        run(cls.program, "render", cls.data, "-o", cls.expected, "--tf", "grey", *VIEW)

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def pkg_config(self, *options):
        return run("pkg-config", *options, "triptych", env=self.environment).split()

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def draw(self, program):
        """Runs the example. Its picture must equal the picture of the program, bit for bit."""
        picture = self.path("picture.exr")
        run(program, self.data, "grey", picture, env=self.environment, cwd=self.folder.name)
        with open(picture, "rb") as one, open(self.expected, "rb") as other:
            self.assertEqual(one.read(), other.read())

    def test_the_example_draws_the_same_picture_as_the_program(self):
        run(CC, "-std=c11", "-D_POSIX_C_SOURCE=200809L", "-Wall", "-Wextra", "-Werror", "-o",
            self.path("example"), os.path.join(SOURCE, "lib", "example.c"),
            *self.pkg_config("--cflags", "--libs"))
        self.draw(self.path("example"))

    def test_the_static_library_draws_the_same_picture(self):
        flags = self.pkg_config("--static", "--cflags", "--libs")
        static = [os.path.join(self.libraries, "libtriptych.a") if flag == "-ltriptych" else flag
                  for flag in flags]
        self.assertNotEqual(flags, static)
        run(CC, "-std=c11", "-D_POSIX_C_SOURCE=200809L", "-o", self.path("static"),
            os.path.join(SOURCE, "lib", "example.c"), *static)
        needed = run("readelf", "-d", self.path("static"))
        self.assertNotIn("libtriptych", needed)
        self.draw(self.path("static"))

    def test_the_headers_compile_as_c_plus_plus(self):
        with open(self.path("a.cpp"), "w") as f:
            f.write("#include <triptych_brick.h>\n#include <cstdio>\nint main() { triptych *t;"
                    " if (triptych_create(&t)) return 1; triptych_view view{}; view.width = 8;"
                    " int status = triptych_set_view(t, &view); std::puts(triptych_error(t));"
                    " triptych_destroy(t); return status == TRIPTYCH_USAGE ? 0 : 1; }\n")
        run(CXX, "-Wall", "-Wextra", "-Werror", "-o", self.path("cpp"), self.path("a.cpp"),
            *self.pkg_config("--cflags", "--libs"))
        self.assertIn("no data set is open", run(self.path("cpp"), env=self.environment))

    def test_only_functions_of_the_headers_are_visible(self):
        header = set()
        for name in "triptych.h", "triptych_brick.h":
            with open(os.path.join(SOURCE, "lib", name)) as f:
                header |= set(re.findall(r"^TRIPTYCH_API .*?\**(triptych_\w+)\(", f.read(), re.M))
        symbols = run("nm", "-D", "--defined-only", os.path.join(self.libraries, "libtriptych.so"))
        visible = {line.split()[-1] for line in symbols.splitlines()}
        self.assertEqual(visible, header)
        self.assertGreater(len(header), 30)

    def test_openvdb_is_loaded_only_for_its_files(self):
        module = os.path.join(self.prefix, "bin", "..", "libexec", "triptych", "triptych-openvdb.so")
        if not os.path.exists(module):
            self.skipTest("built without OpenVDB")
        loud = dict(os.environ, LD_DEBUG="files")
        cloud = os.path.join(SOURCE, "datasets", "wdas_cloud_sixteenth.vdb")
        for file, wanted in (DATA, False), (cloud, True):
            result = subprocess.run([self.program, "brick", file, "--dry-run"], env=loud,
                                    capture_output=True, text=True, timeout=300)
            self.assertEqual(result.returncode, 0, result.stderr[-500:])
            self.assertEqual(f"calling init: {module}" in result.stderr, wanted)
            self.assertEqual("libopenvdb" in result.stderr, wanted)

    def test_a_module_of_another_version_is_refused(self):
        if not os.path.exists(os.path.join(self.prefix, "libexec", "triptych", "triptych-openvdb.so")):
            self.skipTest("built without OpenVDB")
        cloud = os.path.join(SOURCE, "datasets", "wdas_cloud_sixteenth.vdb")
        beside = os.path.join(self.prefix, "bin", "triptych-openvdb.so")
        code = self.path("module.c")
        for text, says in (("int nothing;", "belongs to another version of this program"),
                           ("const void *trip_vdb_module(const void *h) { return h ? 0 : h; }",
                            "belongs to another version of this program"),
                           (None, "cannot load")):
            if text:
                with open(code, "w") as f:
                    f.write(text)
                run(CC, "-shared", "-fPIC", "-o", beside, code)
            else:
                with open(beside, "w") as f:
                    f.write("no library")
            result = subprocess.run([self.program, "brick", cloud, "--dry-run"],
                                    capture_output=True, text=True, timeout=300)
            os.remove(beside)
            self.assertEqual(result.returncode, 1)
            self.assertIn(says, result.stderr)
            self.assertEqual(result.stderr.count("\n"), 1, result.stderr)

    def test_the_library_name_has_the_version(self):
        library = os.path.realpath(os.path.join(self.libraries, "libtriptych.so"))
        version = self.pkg_config("--modversion")[0]
        self.assertEqual(os.path.basename(library), f"libtriptych.so.{version}")
        self.assertIn(f"[libtriptych.so.{version.split('.')[0]}]", run("readelf", "-d", library))


unittest.main(argv=sys.argv[:1])
