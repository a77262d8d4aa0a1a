"""Tests of faults of the machine: missing rights, a full disk, too little memory, Ctrl-C, a closed
terminal, a closed standard output. Each gives one error line and exit status 1, and leaves no file under the final
name."""
import fcntl
import json
import os
import pathlib
import resource
import shutil
import signal
import socket
import subprocess
import tempfile
import termios
import time
import unittest
import urllib.parse
import urllib.request

import program

NOBODY = 65534
ROOT = os.getuid() == 0


def leftovers():
    return sorted(n for n in os.listdir(".") if "out" in n)


class Trouble(program.ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        os.chmod(".", 0o755)
        subprocess.run([program.GENERATE, "cloud", "--size", "160", "-o", "cloud.nrrd"], check=True)
        program.write_nrrd("small.nrrd", program.noise((20, 30, 40)))
        for name in "cloud", "small":
            run = program.call("brick", f"{name}.nrrd", "-o", f"{name}.trip", "-q", "--keep-all")
            assert run.returncode == 0, run.stderr

    # Rights

    def as_nobody(self, *arguments):
        """Like fails(1, ...), as a user without rights."""
        identity = {"user": NOBODY, "group": NOBODY, "extra_groups": []} if ROOT else {}
        try:
            run = program.call("--version", **identity)
        except PermissionError:
            run = None
        if not run or run.returncode:
            self.skipTest("another user cannot run the program where it lies")
        self.fails(1, *arguments, **identity)

    def test_unreadable_input_is_refused(self):
        shutil.copy("small.nrrd", "secret.nrrd")
        shutil.copytree("small.trip", "secret.trip")
        shutil.copytree("small.trip", "part.trip")
        os.chmod("secret.nrrd", 0)
        os.chmod("secret.trip", 0)
        os.chmod("part.trip/y0.voxels", 0)
        folder = tempfile.mkdtemp(prefix="trip-cli-")
        os.chmod(folder, 0o777)
        try:
            self.as_nobody("brick", "secret.nrrd", "-o", f"{folder}/a.trip", "-q")
            self.as_nobody("render", "secret.trip", "-o", f"{folder}/a.png")
            self.as_nobody("render", "part.trip", "-o", f"{folder}/a.png")
            self.as_nobody("info", "--verify", "part.trip")
            self.assertEqual(os.listdir(folder), [])
        finally:
            os.chmod("secret.trip", 0o755)
            shutil.rmtree(folder)

    def test_a_folder_without_write_permission_is_refused(self):
        os.makedirs("locked", exist_ok=True)
        os.chmod("locked", 0o555)
        self.as_nobody("brick", "small.nrrd", "-o", "locked/out.trip", "-q")
        self.as_nobody("render", "small.trip", "-o", "locked/out.png", "--size", "20x20")
        self.assertEqual(os.listdir("locked"), [])

    def test_messages_name_the_remedy(self):
        for command in ["brick", "-o", "out.trip"], ["render", "-o", "out.png"], ["serve"]:
            says = "folder, or by a pattern in quotes"
            self.fails(2, *command, "small.nrrd", "cloud.nrrd", says=says)
        self.fails(2, "small.nrrd", says="triptych render small.nrrd -o")
        self.fails(1, "brick", "small.nrrd", "-o", "cloud.trip", says="--force")
        says = "preset:bone?"
        self.fails(1, "render", "small.trip", "-o", "out.png", "--tf", "bonee", says=says)
        self.assertEqual(leftovers(), [])

    def test_impossible_output_paths_are_refused(self):
        for output in (
            "missing/out.trip",
            "small.nrrd/out.trip",
            "/proc/out.trip",
            "n" * 300 + ".trip",
            "/",
        ):
            self.fails(1, "brick", "small.nrrd", "-o", output, "-q")
        os.makedirs("folder.png", exist_ok=True)
        for output in (
            "missing/out.png",
            "small.nrrd/out.png",
            "/proc/out.png",
            "n" * 300 + ".png",
            "folder.png",
            "small.trip/x/out.png",
        ):
            self.fails(1, "render", "small.trip", "-o", output, "--size", "20x20")
        os.symlink("/dev/full", "a-link")
        for stats in "missing/out.json", "a-link", "folder.png", "small.nrrd/s":
            self.fails(
                1, "render", "small.trip", "-o", "s.png", "--size", "20x20", "--stats", stats
            )
        self.assertTrue(os.path.islink("a-link"))

    # Disk

    def refused(self, *arguments, says):
        """Checks that `render` fails with status 2 and changes no file."""
        def files():
            found = [os.path.join(f, n) for f, _, names in os.walk(".") for n in names]
            return {n: pathlib.Path(n).read_bytes() for n in found
                    if os.path.isfile(n) and "cloud" not in n}

        before = files()
        self.fails(2, "render", *arguments, says=says)
        self.assertEqual(files(), before, arguments)

    def test_input_files_are_not_replaced(self):
        os.makedirs("slices", exist_ok=True)
        volume = program.noise((4, 20, 20))
        for k, image in enumerate(volume):
            program.write_tiff(f"slices/s-{k:03d}.tif", image)
        program.write_exr("volume.exr", volume[0].astype("f4"))
        program.write_raw("data.raw", volume)
        program.write("detached.nhdr", b"NRRD0004\ntype: uint8\ndimension: 3\nsizes: 20 20 4\n"
                                       b"encoding: raw\ndata file: data.raw\n\n")
        program.write("grey.tf", b"0 0 0 0 0\n255 1 1 1 1\n")
        key = dict(eye=[9, 50, 9], look=[9, 9, 9], up=[0, 0, 1], fov=30)
        path = dict(triptych_path=1, keys=[dict(key, seconds=0, function="grey.tf")])
        program.write("path.json", json.dumps(path).encode())
        os.symlink("grey.tf", "link.tf")
        read = "is an input file"
        for arguments in (
            ["volume.exr", "-o", "volume.exr"],
            ["volume.exr", "-o", "a.png", "--depth", "./volume.exr"],
            ["detached.nhdr", "-o", "a.png", "--stats", "data.raw"],
            ["slices", "-o", "slices/s-000.tif"],
            ["slices/s-%03d.tif", "-o", "slices/s-002.tif"],
            ["slices/s-%03d.tif", "-o", "slices/s.tif", "--orbit", "3"],
            ["small.trip", "-o", "a.png", "--tf", "grey.tf", "--stats", "grey.tf"],
            ["small.trip", "-o", "a.png", "--tf", "grey.tf#one", "--stats", "grey.tf"],
            ["small.trip", "-o", "a.png", "--tf", "link.tf", "--stats", "../%s/grey.tf"
             % os.path.basename(os.getcwd())],
            ["small.trip", "-o", "a.png", "--path", "path.json", "--stats", "path.json"],
            ["small.trip", "-o", "a.png", "--path", "path.json", "--stats", "grey.tf"],
        ):
            self.refused(*arguments, says=read)
        among = "would lie among the input files"
        self.refused("small.trip", "-o", "a.png", "--stats", "small.trip/index.trip", says=among)
        self.refused("slices", "-o", "slices/picture.png", says=among)
        self.refused("small.trip", "-o", "small.trip/picture.png", says=among)
        self.refused("slices/*.tif", "-o", "slices/picture.tif", says="the pattern of the input slices")
        self.fails(2, "tf", "convert", "small.nrrd", "small.nrrd", "--force", "--format", "tf",
                   says=read)
        self.works("tf", "convert", "grey.tf", "grey.tf", "--force")

    def test_two_results_cannot_have_the_same_name(self):
        for arguments in (
            ["-o", "a.exr", "--depth", "a.exr"],
            ["-o", "a.exr", "--depth", "./a.exr"],
            ["-o", "a.png", "--stats", "a.png"],
            ["-o", "a.exr", "--depth", "b.exr", "--stats", "b.exr"],
            ["-o", "a.exr", "--depth", "small.trip/../a.exr", "--orbit", "2"],
            ["-o", "a.png", "--orbit", "2", "--stats", "a-001.png"],
        ):
            self.refused("small.trip", *arguments, says="would be written twice")
        self.works("render", "small.trip", "--size", "9x9", "-o", "a.png", "--orbit", "2",
                   "--stats", "a.png")

    def test_a_full_disk_leaves_no_output(self):
        if not ROOT:
            self.skipTest("only root can mount a small file system")
        os.makedirs("disk", exist_ok=True)
        mount = subprocess.run(
            ["mount", "-t", "tmpfs", "-o", "size=2m", "tmpfs", "disk"],
            capture_output=True,
            check=False,
        )
        if mount.returncode:
            self.skipTest("this machine lets nobody mount a file system")
        try:
            self.fails(1, "brick", "cloud.nrrd", "-o", "disk/out.trip", "-q", says="the disk has")
            self.assertEqual(os.listdir("disk"), [])
            with open("disk/filler", "wb") as f:
                f.write(bytes((2 << 20) - 40000))
            for extension in "png", "tif", "exr", "jpg":
                self.fails(
                    1,
                    "render",
                    "small.trip",
                    "-o",
                    f"disk/out.{extension}",
                    "--size",
                    "900x900",
                    "--background",
                    "0.3,0.5,0.7",
                )
            self.assertEqual(os.listdir("disk"), ["filler"])
        finally:
            subprocess.run(["umount", "disk"], check=True)

    def test_a_limit_on_file_sizes_leaves_no_output(self):
        def limited():
            resource.setrlimit(resource.RLIMIT_FSIZE, (200000, 200000))

        for arguments in (
            ("brick", "cloud.nrrd", "-o", "out.trip", "-q", "--keep-all"),
            ("brick", "cloud.nrrd", "-o", "out.trip", "-q", "--keep-all", "--memory", "28M"),
        ):
            self.fails(1, *arguments, preexec_fn=limited, says="ulimit -f")
        picture = ("render", "small.trip", "-o", "out.exr", "--size", "600x600")
        self.fails(1, *picture, "--background", "0.3,0.5,0.7", preexec_fn=limited, says="ulimit -f")
        self.assertEqual(leftovers(), [])

    def test_stats_follow_no_link_and_keep_the_file_mode(self):
        draw = ("render", "small.trip", "-o", "s.png", "--size", "20x20", "--stats", "s.json")
        with open("victim", "w") as f:
            f.write("not to be touched")
        os.symlink("victim", "s.json.partial")
        with open("s.json", "w") as f:
            os.chmod("s.json", 0o600)
        self.works(*draw)
        with open("victim") as f:
            self.assertEqual(f.read(), "not to be touched")
        with open("s.json") as f:
            self.assertEqual(json.load(f)["size"], [20, 20])
        self.assertEqual(os.stat("s.json").st_mode & 0o777, 0o600)
        self.assertTrue(os.path.islink("s.json.partial"))

    def test_a_data_set_with_a_foreign_file_is_not_replaced(self):
        shutil.copytree("small.trip", "out.trip")
        with open("out.trip/notes.txt", "w") as f:
            f.write("mine")
        self.fails(1, "brick", "small.nrrd", "-o", "out.trip", "-q", "--force", says="notes.txt")
        self.assertEqual(leftovers(), ["out.trip"])
        self.works("info", "--verify", "out.trip")
        os.remove("out.trip/notes.txt")
        self.works("brick", "small.nrrd", "-o", "out.trip", "-q", "--force")
        self.assertEqual(leftovers(), ["out.trip"])
        shutil.rmtree("out.trip")

    # Pipes and standard output

    def test_waiting_for_a_pipe_can_be_interrupted(self):
        os.mkfifo("f.tf")
        for arguments in ("brick", "small.nrrd"), ("render", "small.trip"):
            output = "out.trip" if arguments[0] == "brick" else "out.png"
            process = program.start(*arguments, "-o", output, "--tf", "f.tf")
            time.sleep(0.5)
            process.send_signal(signal.SIGINT)
            out, err = process.communicate(timeout=60)
            self.assertEqual(process.returncode, 1, err)
            self.assertRegex(err.decode(), r"\Atriptych: [^\n]*interrupted\n\Z")
            self.assertEqual(leftovers(), [])

    def test_a_pipe_is_read_to_its_end(self):
        os.mkfifo("g.tf")
        process = program.start(
            "render", "small.trip", "-o", "s.png", "--size", "20x20", "--tf", "g.tf"
        )
        with open("g.tf", "w") as f:
            f.write("values data\n0 1 1 1 0\n")
            f.flush()
            time.sleep(0.3)
            f.write("255 1 1 1 1\n")
        out, err = process.communicate(timeout=60)
        self.assertEqual((process.returncode, err), (0, b""))

    def test_a_full_or_closed_standard_output_is_an_error(self):
        for arguments in (
            ("info", "small.trip"),
            ("info", "--json", "small.trip"),
            ("--help",),
            ("render", "small.trip", "-o", "s.png", "--size", "20x20", "--stats", "-"),
            ("brick", "small.nrrd", "-o", "small2.trip", "--force"),
        ):
            with open("/dev/full", "w") as full:
                self.fails(1, *arguments, stdout=full, says="standard output")
            self.fails(
                1, *arguments, stdout=None, preexec_fn=lambda: os.close(1), says="standard output"
            )
        self.works("info", "--verify", "small2.trip")

    def test_closed_streams_write_nothing_into_the_data_set(self):
        run = subprocess.run(
            [program.PROGRAM, "brick", "small.nrrd", "-o", "quiet.trip"],
            check=False,
            preexec_fn=lambda: [os.close(fd) for fd in range(3)],
        )
        self.assertEqual(run.returncode, 1)
        self.works("info", "--verify", "quiet.trip")

    def unread(self, *arguments, lines=0, **options):
        """Runs the program with a reader of standard output that ends after some lines. Returns the
        exit status and stderr."""
        run = program.start(*arguments, **options)
        self.addCleanup(run.kill)
        for _ in range(lines):
            self.assertTrue(run.stdout.readline())
        run.stdout.close()
        err = run.stderr.read().decode()
        run.stderr.close()
        return run.wait(timeout=120), err

    def test_pictures_are_written_although_nobody_reads_standard_output(self):
        os.makedirs("unread", exist_ok=True)
        pictures = [f"p-{i:03d}.png" for i in range(12)]
        video = bool(shutil.which("ffmpeg"))
        for lines in 0, 1:
            draw = ["render", "small.trip", "--size", "64x64", "--orbit", 12, "-o", "unread/p.png"]
            self.assertEqual(self.unread(*draw, "--explain", lines=lines), (0, ""))
            self.assertEqual(sorted(os.listdir("unread")), pictures)
            if video:
                self.assertEqual(self.unread(*draw[:-1], "unread/p.mp4", lines=lines), (0, ""))
                self.assertEqual(sorted(os.listdir("unread")), [*pictures, "p.mp4"])
                self.assertGreater(os.path.getsize("unread/p.mp4"), 1000)
                os.remove("unread/p.mp4")
            for name in pictures:
                os.remove(f"unread/{name}")
        self.assertEqual(self.unread("brick", "small.nrrd", "-o", "out.trip"), (0, ""))
        self.works("info", "--verify", "out.trip")
        self.assertEqual(leftovers(), ["out.trip"])
        shutil.rmtree("out.trip")

    def test_pictures_are_written_although_nobody_reads_the_messages(self):
        values = program.noise((20, 30, 40), "f4")
        values[3] = float("nan")
        program.write_nrrd("holes.nrrd", values)
        out, into = os.pipe()
        os.close(out)
        try:
            for arguments in (["render", "holes.nrrd", "-o", "holes.png", "--size", "40x40"],
                              ["brick", "holes.nrrd", "-o", "holes.trip"]):
                self.assertEqual(program.start(*arguments, stdout=into, stderr=into).wait(60), 0)
                self.assertTrue(os.path.exists(arguments[3]))
            self.assertEqual(program.start("info", "none.trip", stderr=into).wait(60), 1)
        finally:
            os.close(into)
            shutil.rmtree("holes.trip", ignore_errors=True)
        self.assertEqual([n for n in os.listdir(".") if n.startswith("holes.")
                          and n not in ("holes.nrrd", "holes.png")], [])

    def test_commands_that_print_end_as_other_programs_do(self):
        self.works("render", "small.nrrd", "-o", "s.png", "--size", "20x20")
        for arguments in (["info", "small.trip"], ["info", "--json", "small.trip"],
                          ["info", "small.nrrd"], ["cache", "list"], ["cache", "list", "--json"],
                          ["tf", "list"], ["tf", "show", "--tf", "grey", "small.trip"], ["--help"],
                          ["--version"]):
            self.assertEqual(self.unread(*arguments), (-signal.SIGPIPE, ""), arguments)

    def test_serving_goes_on_although_nobody_reads_standard_output(self):
        if "SERVE" in program.SWITCHED_OFF:
            self.skipTest("built without serve")
        run = program.start("serve", "small.trip", "--port", "0")
        self.addCleanup(run.kill)
        address = run.stdout.readline().decode().split()[-1]
        run.stdout.close()
        for _ in range(3):
            with urllib.request.urlopen(address, timeout=30) as page:
                self.assertIn(b"<html", page.read().lower())
            reader = socket.create_connection(urllib.parse.urlsplit(address)[1].split(":"))
            reader.sendall(b"GET / HTTP/1.1\r\nHost: x\r\n\r\n")
            reader.close()  # nobody reads the answer
        self.assertIsNone(run.poll())
        run.send_signal(signal.SIGTERM)
        run.stderr.close()
        self.assertIn(run.wait(timeout=60), (0, 1))

    def test_an_ending_ffmpeg_is_one_line(self):
        os.makedirs("bin", exist_ok=True)
        path = os.path.abspath("bin") + os.pathsep + os.environ["PATH"]
        for script, says in (("kill -9 $$", "Killed"), ("exit 3", "status 3"),
                             ("head -c 100 >/dev/null; echo no codec >&2; exit 1", "no codec"),
                             ("head -c 5000000 >/dev/null; kill -SEGV $$", "Segmentation fault")):
            program.write("bin/ffmpeg", f"#!/bin/sh\n{script}\n".encode())
            os.chmod("bin/ffmpeg", 0o755)
            self.leaves_nothing(1, "render", "small.trip", "-o", "out.mp4", "--size", "128x128",
                                "--orbit", 60, says=says, env=dict(os.environ, PATH=path))

    # Memory

    def test_too_little_memory_is_one_line(self):
        for size in "1", "1K", "1M", "4M":
            self.fails(1, "brick", "cloud.nrrd", "-o", "out.trip", "-q", "--memory", size)
        for renderer in "cpu", "reference":
            self.fails(
                1, "render", "cloud.trip", "-o", "out.png", "--memory", "1M", "--renderer", renderer
            )
        self.fails(
            1, "render", "cloud.trip", "-o", "out.png", "--memory", "64M", "--size", "60000x60000"
        )
        self.assertEqual(leftovers(), [])

    def test_the_memory_named_in_the_message_is_enough(self):
        """The error line names an amount of memory, with which the same command works."""
        run = self.fails(
            1, "brick", "cloud.nrrd", "-o", "out.trip", "-q", "--memory", "5M", "--threads", "2"
        )
        needed = run.stderr.split("--memory ")[1].split()[0]
        self.works(
            "brick",
            "cloud.nrrd",
            "-o",
            "enough.trip",
            "-q",
            "--memory",
            needed,
            "--threads",
            "2",
            "--keep-all",
        )
        self.works("info", "--verify", "enough.trip")
        shutil.rmtree("enough.trip")

    # Ctrl-C

    def interrupt(self, seconds, signals, *arguments):
        """Sends the signals once the process has used `seconds` of processor time. Returns its exit
        status and stderr."""
        process = program.start(*arguments)
        program.await_handler(process)
        while process.poll() is None and program.processor_seconds(process) < seconds:
            time.sleep(0.01)
        for number in signals:
            process.send_signal(number)
        try:
            _, err = process.communicate(timeout=120)
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()
            self.fail(f"goes on after Ctrl-C: {arguments}")
        return process.returncode, err.decode()

    def check_interrupted(self, signals, *arguments):
        """Interrupts the command after several amounts of processor time. At least one signal must
        arrive before the command ends."""
        met = 0
        for seconds in 0, 0.1, 0.2, 0.4, 0.8, 1.6:
            status, err = self.interrupt(seconds, signals, *arguments)
            if status == 0:
                break
            self.assertEqual(status, 1)
            note = r"(triptych: note: [^\n]* of 400 pictures are written\n)?"  # of a turntable
            self.assertRegex(err, r"\Atriptych: [^\n]*interrupted[^\n]*\n" + note + r"\Z")
            self.assertFalse(os.path.exists(arguments[3]))
            met += 1
        self.assertGreater(met, 0)

    def test_interrupted_bricking_leaves_nothing(self):
        for number in signal.SIGINT, signal.SIGTERM:
            self.check_interrupted(
                [number], "brick", "cloud.nrrd", "-o", "out.trip", "--keep-all", "--threads", "1"
            )
            shutil.rmtree("out.trip", ignore_errors=True)
        self.works("brick", "cloud.nrrd", "-o", "out.trip", "-q")
        self.works("info", "--verify", "out.trip")
        self.assertEqual(leftovers(), ["out.trip"])
        shutil.rmtree("out.trip")

    def begin(self, *arguments, **options):
        """Starts a run, and waits until it has a temporary file or folder beside its output."""
        before = set(os.listdir("."))
        run = program.start(*arguments, **options)
        self.addCleanup(run.kill)
        while run.poll() is None and set(os.listdir(".")) == before:
            time.sleep(0.001)
        self.assertIsNone(run.poll())
        return run, before

    def test_every_signal_that_ends_the_program_leaves_nothing(self):
        video = [["render", "cloud.trip", "-o", "out.mp4", "--orbit", 400, "--size", "200x200"]]
        for number in signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT:
            for arguments in (["brick", "cloud.nrrd", "-o", "out.trip", "--keep-all"],
                              *(video if shutil.which("ffmpeg") else [])):
                run, before = self.begin(*arguments)
                run.send_signal(number)
                _, err = run.communicate(timeout=60)
                self.assertEqual(run.returncode, 1, err)
                self.assertRegex(err.decode(), r"\Atriptych: [^\n]*interrupted[^\n]*\n"
                                 r"(triptych: note: out.mp4: [^\n]*no video is written\n)?\Z")
                self.assertEqual(set(os.listdir(".")), before, (number, arguments))

    def test_a_closed_terminal_leaves_nothing(self):
        """The program is alone on a terminal, which ends with all its readers."""
        for arguments in (["brick", "cloud.nrrd", "-o", "out.trip", "--keep-all"],
                          ["render", "cloud.trip", "-o", "out.tif", "--size", "3000x3000"]):
            inner, outer = os.openpty()

            def take_terminal():
                os.setsid()
                fcntl.ioctl(outer, termios.TIOCSCTTY, 0)

            run, before = self.begin(*arguments, stdin=outer, stdout=outer, stderr=outer,
                                     preexec_fn=take_terminal)
            os.close(outer)
            os.close(inner)
            self.assertEqual(run.wait(timeout=60), 1)
            self.assertEqual(leftovers(), [])
            self.assertLessEqual(set(os.listdir(".")), before)

    def test_interrupted_drawing_leaves_nothing(self):
        self.check_interrupted(
            [signal.SIGINT],
            "render",
            "cloud.trip",
            "-o",
            "out.png",
            "--renderer",
            "reference",
            "--size",
            "600x600",
        )
        if os.path.exists("out.png"):
            os.remove("out.png")
        self.assertEqual(leftovers(), [])
        self.check_interrupted(
            [signal.SIGINT],
            "render",
            "cloud.trip",
            "-o",
            "turn.png",
            "--orbit",
            "400",
            "--size",
            "200x200",
        )
        for name in os.listdir("."):
            self.assertNotRegex(name, r"\.tmp$|partial")


if __name__ == "__main__":
    program.main()
