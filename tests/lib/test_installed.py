"""Tests the installed library, which programs in C and C++ find by pkg-config or by CMake. As a shared
and as a static library it draws the same picture as the program. Only the functions of its headers are
visible. All tests use a tree that was installed with DESTDIR and then moved."""
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
EXAMPLE_CPP = os.path.join(SOURCE, "lib", "example.cpp")
STRICT = ["-std=c11", "-D_POSIX_C_SOURCE=200809L", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]
STRICT_CPP = ["-Wall", "-Wextra", "-pedantic", "-Werror"]
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
        stage = os.path.join(cls.folder.name, "stage")
        run(CMAKE, "--install", BUILD, "--prefix", "/opt/triptych", env=dict(os.environ, DESTDIR=stage))
        os.rename(os.path.join(stage, "opt", "triptych"), cls.prefix)
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

    def draw_body(self, program):
        """Runs the C++ example. Its body is 16 voxels thick and has opacity 0.1 a voxel."""
        picture = self.path("body.png")
        shutil.rmtree(self.path("body.trip"), ignore_errors=True)
        printed = run(program, self.path("body.trip"), picture, env=self.environment)
        middle, corner = ([float(word) for word in line.split()] for line in printed.splitlines())
        opacity = 1 - (1 - 0.1) ** 16
        for value, expected in zip(middle, (opacity, 0, 0, opacity)):
            self.assertLess(abs(value - expected), 1 / 255)
        self.assertEqual(corner, [0, 0, 0, 0])
        with open(picture, "rb") as f:
            self.assertEqual(f.read(8), b"\x89PNG\r\n\x1a\n")

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

    def cmake_project(self, language, sources):
        """Builds programs with CMake, each with the shared and with the static library. Returns their
        folder."""
        folder = self.path("project " + language)
        os.mkdir(folder)
        version = self.pkg_config("--modversion")[0]
        with open(os.path.join(folder, "CMakeLists.txt"), "w") as f:
            f.write(f"cmake_minimum_required(VERSION 3.22)\nproject(examples {language})\n"
                    f"find_package(Triptych {version} REQUIRED COMPONENTS static)\n")
            for name, source in sources.items():
                f.write(f"add_executable({name} {source})\n"
                        f"target_link_libraries({name} Triptych::triptych)\n"
                        f"add_executable({name}_static {source})\n"
                        f"target_link_libraries({name}_static Triptych::triptych_static)\n")
        run(CMAKE, "-S", folder, "-B", folder, "-G", "Ninja", f"-DCMAKE_C_COMPILER={CC}",
            f"-DCMAKE_CXX_COMPILER={CXX}", f"-DCMAKE_PREFIX_PATH={self.prefix}")
        run(CMAKE, "--build", folder)
        for name in sources:
            self.assertIn("libtriptych", run("readelf", "-d", os.path.join(folder, name)))
            self.assertNotIn("libtriptych", run("readelf", "-d", os.path.join(folder, name + "_static")))
        return folder

    def test_cmake_finds_the_library_for_c(self):
        folder = self.cmake_project("C", EXAMPLES)
        for kind in "", "_static":
            self.draw(os.path.join(folder, "example" + kind))
            self.draw_memory(os.path.join(folder, "example_memory" + kind))

    def test_cmake_finds_the_library_for_c_plus_plus(self):
        folder = self.cmake_project("CXX", {"example_cpp": EXAMPLE_CPP})
        for kind in "", "_static":
            self.draw_body(os.path.join(folder, "example_cpp" + kind))

    def test_cmake_refuses_what_is_not_there(self):
        folder = self.path("refused")
        os.mkdir(folder)
        for wanted, says in (("9.0", "not accept"), ("COMPONENTS sculpture", "no component sculpture")):
            with open(os.path.join(folder, "CMakeLists.txt"), "w") as f:
                f.write("cmake_minimum_required(VERSION 3.22)\nproject(examples C)\n"
                        f"find_package(Triptych {wanted} REQUIRED)\n")
            result = subprocess.run(
                [CMAKE, "-S", folder, "-B", folder, "-G", "Ninja", f"-DCMAKE_C_COMPILER={CC}",
                 f"-DCMAKE_PREFIX_PATH={self.prefix}"], capture_output=True, text=True, timeout=300)
            self.assertNotEqual(result.returncode, 0)
            self.assertIn(says, " ".join(result.stderr.split()))

    def static_flags(self):
        flags = self.pkg_config("--static", "--cflags", "--libs")
        static = [os.path.join(self.libraries, "libtriptych.a") if flag == "-ltriptych" else flag
                  for flag in flags]
        self.assertNotEqual(flags, static)
        return static

    def test_the_static_library_draws_the_same_picture(self):
        static = self.static_flags()
        run(CC, *STRICT, "-o", self.path("static"), EXAMPLES["example"], *static)
        needed = run("readelf", "-d", self.path("static"))
        self.assertNotIn("libtriptych", needed)
        self.draw(self.path("static"))

    def test_pkg_config_finds_the_library_for_c_plus_plus(self):
        shared = self.pkg_config("--cflags", "--libs")
        for name, flags in (("cpp", shared), ("cpp_static", self.static_flags())):
            run(CXX, "-std=c++11", *STRICT_CPP, "-o", self.path(name), EXAMPLE_CPP, *flags)
            self.draw_body(self.path(name))

    def test_the_headers_compile_as_c_and_c_plus_plus(self):
        include = self.pkg_config("--cflags")
        others = [name for name in ("g++", "clang++-14") if shutil.which(name)]
        for header in "triptych.h", "triptych_brick.h":
            code = self.path("alone.c")
            with open(code, "w") as f:
                f.write(f"#include <{header}>\nint main(void) {{ triptych *t; return triptych_create(&t); }}\n")
            for standard in "c99", "c11", "c17":
                run(CC, "-x", "c", f"-std={standard}", *STRICT_CPP, "-fsyntax-only", *include, code)
            for compiler in {CXX, *others}:
                for standard in "c++11", "c++14", "c++17", "c++20":
                    run(compiler, "-x", "c++", f"-std={standard}", *STRICT_CPP, "-Wold-style-cast", "-Wshadow",
                        "-fsyntax-only", *include, code)

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

    def test_the_target_installable_makes_all_installed_files(self):
        if not shutil.which("ninja"):
            self.skipTest("ninja is missing")
        installed = set()
        commands = set(run("ninja", "-C", BUILD, "-t", "commands", "installable").split())
        made = {os.path.relpath(os.path.join(BUILD, word), BUILD) for word in commands}
        for folder, _, files in os.walk(BUILD):
            if "cmake_install.cmake" not in files:
                continue
            with open(os.path.join(folder, "cmake_install.cmake")) as f:
                for path in re.findall(r'"(' + re.escape(os.path.abspath(BUILD)) + r'/[^"]*)"', f.read()):
                    if os.path.isfile(path) and not path.endswith((".cmake", ".pc")):
                        installed.add(os.path.relpath(path, BUILD))
        self.assertIn("triptych", installed)
        self.assertEqual(installed - made, set())

    def test_the_library_name_has_the_version(self):
        library = os.path.realpath(os.path.join(self.libraries, "libtriptych.so"))
        version = self.pkg_config("--modversion")[0]
        self.assertEqual(os.path.basename(library), f"libtriptych.so.{version}")
        self.assertIn(f"[libtriptych.so.{version.split('.')[0]}]", run("readelf", "-d", library))


unittest.main(argv=sys.argv[:1])
