"""Tests the installed library, which programs find by pkg-config or by CMake. As a shared and as a
static library it draws the same picture as the program. Only the functions of its headers are
visible."""
import array
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

CMAKE, BUILD, SOURCE, CC, CXX = sys.argv[1:]
DATA = os.path.join(SOURCE, "datasets", "tooth.nhdr")
EXAMPLES = {name: os.path.join(SOURCE, "lib", f"{name}.c")
            for name in ("example", "example_memory")}
STRICT = ["-std=c11", "-D_POSIX_C_SOURCE=200809L", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]
VIEW = ["--size", "320x240", "--view", "iso", "--azimuth", "30", "--background", "0,0,0.25"]


def run(*command, **options):
    result = subprocess.run(command, capture_output=True, text=True, timeout=300, **options)
    if result.returncode:
        raise AssertionError(f"{command}: {result.returncode}\n{result.stdout}{result.stderr}")
    return result.stdout


def write_tanglecube(path):
    """Writes the volume of example_memory.c, computed independently."""
    size = 96
    x = [(i - (size - 1) / 2) / 16 for i in range(size)]
    part = [v * v * (v * v - 5) for v in x]
    with open(path, "wb") as f:
        for k in part:
            for j in part:
                array.array("f", (-11.8 - i - j - k for i in part)).tofile(f)


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
        volume = os.path.join(cls.folder.name, "tanglecube.raw")
        data = os.path.join(cls.folder.name, "tanglecube.trip")
        write_tanglecube(volume)
        run(cls.program, "brick", volume, "--size", "96,96,96", "--type", "float", "--range",
            "0:100", "-o", data)
        cls.expected_memory = os.path.join(cls.folder.name, "expected_memory.exr")
        run(cls.program, "render", data, "-o", cls.expected_memory, "--size", "320x240",
            "--background", "0,0,0")

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
        self.assert_same(picture, self.expected)

    def draw_memory(self, program, *slices):
        """Runs the example of a volume in memory. The program bricks the same values from a file."""
        picture = self.path("memory.exr")
        run(program, self.path("memory.trip"), picture, *slices, env=self.environment)
        self.assert_same(picture, self.expected_memory)

    def assert_same(self, picture, expected):
        with open(picture, "rb") as one, open(expected, "rb") as other:
            self.assertTrue(one.read() == other.read(), f"{picture} differs from {expected}")

    def test_the_examples_draw_the_same_pictures_as_the_program(self):
        for name, source in EXAMPLES.items():
            run(CC, *STRICT, "-o", self.path(name), source,
                *self.pkg_config("--cflags", "--libs"))
        self.draw(self.path("example"))
        self.draw_memory(self.path("example_memory"))
        self.draw_memory(self.path("example_memory"), "slices")

    def test_cmake_finds_the_library(self):
        folder = self.path("project")
        os.mkdir(folder)
        version = self.pkg_config("--modversion")[0]
        with open(os.path.join(folder, "CMakeLists.txt"), "w") as f:
            f.write("cmake_minimum_required(VERSION 3.22)\nproject(examples C)\n"
                    f"find_package(Triptych {version} REQUIRED)\n")
            for name, source in EXAMPLES.items():
                f.write(f"add_executable({name} {source})\n"
                        f"target_link_libraries({name} Triptych::triptych)\n")
        run(CMAKE, "-S", folder, "-B", folder, "-G", "Ninja", f"-DCMAKE_C_COMPILER={CC}",
            f"-DCMAKE_PREFIX_PATH={self.prefix}")
        run(CMAKE, "--build", folder)
        self.draw(os.path.join(folder, "example"))
        self.draw_memory(os.path.join(folder, "example_memory"))

    def test_the_static_library_draws_the_same_picture(self):
        flags = self.pkg_config("--static", "--cflags", "--libs")
        static = [os.path.join(self.libraries, "libtriptych.a") if flag == "-ltriptych" else flag
                  for flag in flags]
        self.assertNotEqual(flags, static)
        run(CC, *STRICT, "-o", self.path("static"), EXAMPLES["example"], *static)
        needed = run("readelf", "-d", self.path("static"))
        self.assertNotIn("libtriptych", needed)
        self.draw(self.path("static"))

    def test_the_headers_compile_as_c_plus_plus(self):
        with open(self.path("a.cpp"), "w") as f:
            f.write("#include <triptych_brick.h>\n#include <cstdio>\nint main() { triptych *t;"
                    " triptych_volume volume{}; (void)volume;"
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
