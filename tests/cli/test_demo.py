"""Tests of demo.sh and of the installation of packages. Stand-ins replace apt-get, dpkg and cmake,
so that nothing is installed. The stand-in of the build copies the tested program."""
import json
import os
import pty
import re
import shutil
import signal
import subprocess
import time
import unittest

import program

ROOT = os.environ["TRIP_SOURCE_DIR"]
SMALL = {"gcc", "cmake", "libpng-dev"}
LARGE = {"g++", "libopenvdb-dev", "libopenimageio-dev", "libgl1-mesa-dri"}
TOOLS = ("sh cat cp date dirname awk sed grep df tail mktemp rm mkdir env tr head sleep chmod touch").split()

# Each stand-in notes its call. The folder $STATE has a file for each installed package.
STAND_INS = {
    "dpkg-query": """
for package; do :; done
[ ! -e "$STATE/installed/$package" ] || printf 'install ok installed'
""",
    "dpkg": ': >"$STATE/dpkg$1"',
    "apt-get": """
kind=install packages=
for word; do
    case $word in
    --print-uris) kind=plan ;;
    update) kind=update ;;
    -* | [A-Z]*::* | install) ;;
    *) packages="$packages $word" ;;
    esac
done
set -- $packages
case $kind in
update) echo "dlstatus:1:50.0:Retrieving file 1 of 2" >&3 ;;
plan)
    echo "0 upgraded, $# newly installed, 0 to remove and 9 not upgraded."
    echo "Need to get 3500 kB of archives."
    echo "After this operation, 1.5 GB of additional disk space will be used." ;;
install)
    echo "apt-get$packages" >>"$STATE/calls"
    [ ! -e "$STATE/wait" ] || { : >"$STATE/waits"; sleep 60; }
    if [ -e "$STATE/apt-fails" ]; then
        echo "E: Failed to fetch libpng-dev" >&2
        exit 100
    fi
    echo "dlstatus:1:50.5:Retrieving file 1 of $#" >&3
    echo "pmstatus:dpkg-exec:0.0:Running dpkg" >&3
    echo "pmstatus:gcc:40.1234:Unpacking gcc (amd64)" >&3
    for package; do : >"$STATE/installed/$package"; done
    echo "pmstatus:gcc:90.1234:Installed gcc (amd64)" >&3 ;;
esac
""",
    "cmake": """
echo "cmake $*" >>"$STATE/calls"
case $1 in
--preset)
    mkdir -p build/release
    touch build/release/CMakeCache.txt build/release/build.ninja
    case "$*" in
    *TRIP_SMALL=ON*) echo TRIP_SMALL:BOOL=ON >build/release/CMakeCache.txt ;;
    *TRIP_SMALL=OFF*) echo TRIP_SMALL:BOOL=OFF >build/release/CMakeCache.txt ;;
    esac ;;
--build)
    for n in 1 2 3 4; do echo "[$n/4] Building C object cli/a$n.c.o"; done
    if [ -e "$STATE/build-fails" ]; then
        echo "cli/a4.c:1: error: expected a semicolon"
        exit 1
    fi
    printf '#!/bin/sh\\nexec "%s" "$@"\\n' "$PROGRAM" >build/release/triptych
    chmod +x build/release/triptych ;;
esac
""",
    "gcc": "echo 12",
    "id": 'cat "$STATE/user"',
}


class Demo(program.ProgramTest):
    def setUp(self):
        self.state = os.path.join(self.folder, self.id().split(".")[-1])
        self.clone = os.path.join(self.state, "a clone")
        os.makedirs(os.path.join(self.state, "installed"))
        os.makedirs(os.path.join(self.state, "bin"))
        self.put("user", "0\n")
        for name, text in STAND_INS.items():
            self.stand_in(name, text)
        for name in TOOLS:
            self.stand_in(name, f'exec {shutil.which(name)} "$@"\n')
        os.makedirs(os.path.join(self.clone, "datasets"))
        for name in "tooth.nhdr", "tooth.raw":
            if os.path.exists(os.path.join(ROOT, "datasets", name)):
                shutil.copy(os.path.join(ROOT, "datasets", name), os.path.join(self.clone, "datasets"))
        shutil.copytree(os.path.join(ROOT, "scripts"), os.path.join(self.clone, "scripts"))
        shutil.copy(os.path.join(ROOT, "demo.sh"), self.clone)

    def put(self, name, text=""):
        with open(os.path.join(self.state, name), "w") as f:
            f.write(text)

    def stand_in(self, name, text):
        path = os.path.join(self.state, "bin", name)
        if os.path.lexists(path):
            os.remove(path)
        with open(path, "x") as f:
            f.write("#!/bin/sh\n" + text)
        os.chmod(path, 0o755)

    def environment(self):
        return {"PATH": os.path.join(self.state, "bin"), "STATE": self.state, "PROGRAM": program.PROGRAM,
                "HOME": self.state, "XDG_CACHE_HOME": os.environ["XDG_CACHE_HOME"]}

    def script(self, *command):
        return subprocess.run(command, cwd="/", env=self.environment(), capture_output=True, text=True,
                              stdin=subprocess.DEVNULL, timeout=120, check=False)

    def demo(self):
        return self.script(os.path.join(self.clone, "demo.sh"))

    def calls(self):
        """Returns the calls since the last time."""
        path = os.path.join(self.state, "calls")
        if not os.path.exists(path):
            return []
        with open(path) as f:
            text = f.read().splitlines()
        os.remove(path)
        return text

    def install(self, small=False):
        arguments = ["--small"] if small else []
        run = self.script(os.path.join(self.clone, "scripts", "install-dependencies.sh"), *arguments)
        self.assertEqual(run.returncode, 0, run.stderr)
        self.calls()

    def assert_picture(self, run):
        path = os.path.join(self.clone, "demo", "tooth.png")
        self.assertIn(f"The picture: {path}\n", run.stdout)
        self.works("render", os.path.join(ROOT, "datasets", "tooth.nhdr"), "-o", "expected.png")
        with open(path, "rb") as picture, open("expected.png", "rb") as expected:
            self.assertTrue(picture.read() == expected.read())

    def test_the_picture_comes_before_most_packages(self):
        run = self.demo()
        self.assertEqual((run.returncode, run.stderr), (0, run.stderr))
        self.assert_picture(run)
        calls = self.calls()
        small, large = (set(call.split()[1:]) for call in calls if call.startswith("apt-get"))
        self.assertTrue(SMALL <= small and LARGE <= large)
        self.assertFalse(small & large)
        self.assertEqual([call for call in calls if "apt-get" not in call], [
            "cmake --preset release -DBUILD_TESTING=OFF -DTRIP_WERROR=ON -DTRIP_SMALL=ON",
            "cmake --build --preset release --target triptych",
            "cmake --preset release -DTRIP_SMALL=OFF",
            "cmake --build --preset release --target installable"])
        first, rest = run.stdout.split("Step 3 of 4")
        for text in ("Step 1 of 4", f"Packages: {len(small)}, 4 MB to fetch, 1501 MB on disk", "Fetching: 50 %",
                     "Installing: 40 %", "Installing: 90 %", "Step 2 of 4", "Building: 50 %  2 of 4",
                     "Building: 100 %  4 of 4", "The picture: ", "Time: ", "Ctrl-C"):
            self.assertIn(text, first)
            first = first[first.index(text):]
        for text in f"Packages: {len(large)}, ", "Step 4 of 4", "Building: 100 %  4 of 4", "All is built":
            self.assertIn(text, rest)

    def test_a_second_run_configures_nothing(self):
        self.demo()
        self.calls()
        run = self.demo()
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assert_picture(run)
        self.assertEqual(self.calls(), ["cmake --build --preset release --target installable"])

    def test_a_build_of_check_sh_stays(self):
        self.install()
        os.makedirs(os.path.join(self.clone, "build", "release"))
        for name, text in ("CMakeCache.txt", "BUILD_TESTING:BOOL=ON\nTRIP_SMALL:BOOL=OFF\n"), ("build.ninja", ""):
            with open(os.path.join(self.clone, "build", "release", name), "w") as f:
                f.write(text)
        run = self.demo()
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assert_picture(run)
        self.assertEqual(self.calls(), ["cmake --build --preset release --target installable"])
        # A new package does not make the program smaller either.
        os.remove(os.path.join(self.state, "installed", "libopenvdb-dev"))
        self.assertEqual(self.demo().returncode, 0)
        self.assertEqual(self.calls(), ["apt-get libopenvdb-dev",
                                        "cmake --build --preset release --target installable"])

    def test_with_all_packages_the_whole_program_is_built_at_once(self):
        self.install()
        run = self.demo()
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assert_picture(run)
        self.assertEqual(self.calls(), ["cmake --preset release -DBUILD_TESTING=OFF -DTRIP_WERROR=ON",
                                        "cmake --build --preset release --target installable"])

    def test_ctrl_c_keeps_the_picture_and_a_later_run_goes_on(self):
        self.install(small=True)
        self.put("wait")
        process = subprocess.Popen(
            [os.path.join(self.clone, "demo.sh")], env=self.environment(), text=True,
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True)
        while process.poll() is None and not os.path.exists(os.path.join(self.state, "waits")):
            time.sleep(0.02)
        os.killpg(process.pid, signal.SIGINT)
        out, err = process.communicate(timeout=30)
        self.assertEqual(process.returncode, -signal.SIGINT, err)
        self.assertIn("The picture: ", out)
        self.assertRegex(err, r"demo: stopped; the picture and build/release/triptych stay")
        self.assertNotIn("failed", err)
        for name in "wait", "dpkg--configure":
            os.remove(os.path.join(self.state, name))
        self.calls()
        run = self.demo()
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertIn("cmake --preset release -DTRIP_SMALL=OFF", self.calls())
        self.assertTrue(os.path.exists(os.path.join(self.state, "dpkg--configure")))

    def test_a_user_without_root_gets_the_picture_or_the_command(self):
        self.put("user", "1000\n")
        run = self.demo()
        self.assertEqual(run.returncode, 1)
        self.assertRegex(run.stderr, r"\Ainstall-dependencies: run as root, install sudo, or ask for: "
                                     r"apt-get install --no-install-recommends cmake [^\n]*\n\Z")
        self.put("user", "0\n")
        self.install(small=True)
        self.put("user", "1000\n")
        run = self.demo()
        self.assertEqual(run.returncode, 1)
        self.assert_picture(run)
        self.assertRegex(run.stderr, r"demo: the other packages are not installed; the picture and "
                                     r"build/release/triptych stay\n\Z")

    def test_sudo_that_refuses_gives_the_command(self):
        self.put("user", "1000\n")
        self.stand_in("sudo", "echo 'sudo: a password is required' >&2; exit 1\n")
        run = self.demo()
        self.assertEqual(run.returncode, 1)
        self.assertRegex(run.stderr, r"install-dependencies: sudo refused; ask for: apt-get install [^\n]*\n\Z")

    def test_failures_of_apt_are_shown(self):
        self.put("apt-fails")
        run = self.demo()
        self.assertEqual(run.returncode, 1)
        self.assertRegex(run.stderr, r"E: Failed to fetch libpng-dev\n"
                                     r"install-dependencies: apt-get failed; missing: cmake [^\n]*\n\Z")
        os.remove(os.path.join(self.state, "bin", "apt-get"))
        self.assertRegex(self.demo().stderr, r"install-dependencies: apt-get is missing; [^\n]*\n\Z")

    def test_failures_of_the_build_are_shown(self):
        self.put("build-fails")
        run = self.demo()
        self.assertEqual(run.returncode, 1)
        self.assertRegex(run.stderr, r"error: expected a semicolon\n"
                                     r"(follow_ninja: failed\n)?demo: building failed; [^\n]*build.log\n\Z")
        self.assertNotIn("The picture", run.stdout)
        # The next run draws before it installs the rest, too.
        os.remove(os.path.join(self.state, "build-fails"))
        self.calls()
        run = self.demo()
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertIn("TRIP_SMALL=ON", self.calls()[0])
        self.assertLess(run.stdout.index("The picture"), run.stdout.index("Packages: "))

    def test_a_full_disk_is_found_before_the_work(self):
        df = "echo 'Filesystem 1048576-blocks Used Available Capacity Mounted on'\necho '/dev/x 9 9 %d 99%% /'\n"
        self.stand_in("df", df % 1000)
        run = self.demo()
        self.assertEqual(run.returncode, 1)
        self.assertRegex(run.stderr, r"\Ainstall-dependencies: the packages need 1505 MB, but [^\n]* has 1000 MB free\n\Z")
        self.assertEqual(self.calls(), [])
        self.stand_in("df", df % 5000)
        self.install()
        self.stand_in("df", df % 50)
        run = self.demo()
        self.assertEqual(run.returncode, 1)
        self.assertRegex(run.stderr, r"\Ademo: the build needs 60 MB, but [^\n]*a clone has 50 MB free\n\Z")

    def test_a_terminal_shows_each_step_of_the_build(self):
        self.install()
        ours, theirs = pty.openpty()
        process = subprocess.Popen([os.path.join(self.clone, "demo.sh")], env=self.environment(),
                                   stdin=theirs, stdout=theirs, stderr=theirs)
        os.close(theirs)
        text = b""
        try:
            while part := os.read(ours, 4096):
                text += part
        except OSError:  # the end of a terminal
            pass
        os.close(ours)
        self.assertEqual(process.wait(60), 0, text)
        for n in range(1, 5):
            self.assertIn(f"\rBuilding: {25 * n} %  {n} of 4\x1b[K".encode(), text)


class Reconfigured(program.ProgramTest):
    @unittest.skipUnless(shutil.which("cmake") and shutil.which("ninja"), "cmake or ninja is missing")
    @unittest.skipIf(program.SWITCHED_OFF, "a part is switched off")
    def test_the_whole_program_reuses_the_objects_of_the_small_one(self):
        commands = {}
        for small in "ON", "OFF":
            subprocess.run(["cmake", "--preset", "release", "-B", f"{self.folder}/build", "-DBUILD_TESTING=OFF",
                            f"-DTRIP_SMALL={small}"], cwd=ROOT, check=True, capture_output=True)
            with open("build/compile_commands.json") as f:
                commands[small] = {re.search(r" -o (\S+)", c["command"])[1]: c["command"] for c in json.load(f)}
        changed = {re.sub(r"CMakeFiles/[^/]*/|\.o$", "", name) for name, command in commands["ON"].items()
                   if commands["OFF"].get(name) != command}
        self.assertEqual(changed, {
            "common/image_helper.c", "preprocess/readers/read_netcdf4.c", "preprocess/readers/read_vdb.c",
            "datasets/generate.c", "datasets/landscape.c", "datasets/landscape_cells.c",
            "datasets/cloud_landscape.c", "datasets/scene_landscape.c", "datasets/tree.c", "datasets/without/vdb.c",
            "preprocess/points/without/neighbour_tree.c", "render/without/gl.c", "view/without/view.c",
            "serve/without/serve.c", "render/cpu/kernels/isa.c"})
        self.assertGreater(len(commands["ON"]), 300)


if __name__ == "__main__":
    program.main()
