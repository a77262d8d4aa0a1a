"""Tests names with characters that terminals act on. No command writes them to a terminal unchanged, and a
message stays one line."""
import json
import os
import re
import subprocess

import program

# An escape sequence, a line feed, a mark that reverses the writing, and a byte that is not UTF-8.
BAD = os.fsdecode(b"e\x1b[31mv\nil\xe2\x80\xae\xc2\x9b\xff")
SHOWN = r"e\x1b[31mv\nil\xe2\x80\xae\xc2\x9b\xff"


class Names(program.ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        program.write_nrrd(BAD + ".nrrd", program.noise((6, 7, 8)))
        program.call("brick", BAD + ".nrrd", "-o", BAD + ".trip", "-q")
        program.write(BAD + ".tf", b"0 0 0 0 0\n255 1 1 1 1\n")
        program.write(BAD + ".ply", b"ply\nformat ascii 1.0\nelement vertex 1\nend_header\n")
        program.write(BAD + ".json", b'{"triptych_path": 1, "x": 1}')

    def clean(self, *arguments, shows=True, timeout=60):
        """Runs a command. Returns its text, which must show the name with escapes."""
        run = subprocess.run([program.PROGRAM, *arguments], capture_output=True, timeout=timeout,
                             check=False, stdin=subprocess.DEVNULL)
        text = run.stdout + run.stderr
        self.assertNotRegex(text, rb"[\x00-\x08\x0b-\x1f\x7f\xff]", arguments)
        for marks in b"\xe2\x80\xae", b"\xc2\x9b", b"v\nil":
            self.assertNotIn(marks, text, arguments)
        if shows:
            self.assertIn(SHOWN.encode(), text, arguments)
        return run

    def test_commands_show_the_names_of_their_inputs(self):
        for command in (
            ("info", BAD + ".nrrd"),
            ("info", BAD + ".trip"),
            ("info", BAD + ".tf"),
            ("info", BAD + ".json"),
            ("info", BAD + ".ply"),
            ("info", BAD + ".missing"),
            ("info", "--verify", BAD + ".nope.trip"),
            ("brick", BAD + ".ply", "-o", "a.trip"),
            ("brick", BAD + ".nrrd", "-o", BAD + ".trip"),  # exists already
            ("render", BAD + ".nrrd", "-o", "a.png", "--size", "16x16"),
            ("render", BAD + ".nrrd", "-o", BAD + ".png", "--size", "16x16"),
            ("render", BAD + ".trip", "-o", BAD + ".gif", "--size", "16x16"),
            ("render", BAD + ".trip", "-o", BAD + ".png", "--size", "16x16", "--explain"),
            ("render", BAD + ".trip", "-o", "a.png", "--tf", BAD + ".missing"),
            ("render", BAD + ".trip", "-o", "a.png", "--path", BAD + ".json"),
            ("render", BAD + ".trip", "-o", "a.png", "--size", BAD),
            ("render", BAD + ".trip", "-o", "a.png", "--renderer", BAD),
            ("render", BAD + ".trip", "-o", "a.png", "--effects", "emission", "--emission",
             BAD + ".missing.trip"),
            ("render", BAD + ".trip", "--" + BAD),
            ("render", BAD + ".nrrd", "-o", "a.png", "--coordinates", BAD + ",,"),
            ("tf", "show", BAD + ".missing"),
            ("tf", "convert", BAD + ".tf", BAD + ".unknown"),
            ("tf", BAD),
            ("cache", BAD),
            ("view", BAD + ".missing"),
            ("view", BAD + ".trip", "--script", BAD + ".missing"),
            ("serve", BAD + ".missing"),
            ("bench", BAD),
            ("accuracy", BAD + ".missing.trip"),
            (BAD,),
        ):
            with self.subTest(command=command):
                self.clean(*command)

    def test_the_cache_lists_names(self):
        self.clean("render", BAD + ".nrrd", "-o", "a.png", "--size", "16x16", shows=False)
        # The notes of a data set are JSON, so their texts are UTF-8.
        text = self.clean("cache", "list", shows=False).stdout
        self.assertIn(SHOWN[:-4].encode(), text)
        json.loads(self.works("cache", "list", "--json").stdout)

    def test_converted_functions_have_escaped_names(self):
        for form in "tf", "paraview", "vp", "vp.json", "slicer", "vtk":
            self.clean("tf", "convert", BAD + ".tf", "-", "--format", form, shows=False)

    def test_a_printed_command_names_the_same_file(self):
        """bash reads the word that `info` prints back as the name."""
        text = self.clean("info", BAD + ".nrrd").stdout.decode()
        word = re.search(r"to draw it +triptych render (.*) -o NAME.png\n", text)[1]
        back = subprocess.run(["bash", "-c", f"printf %s {word}"], capture_output=True, check=True)
        self.assertEqual(back.stdout, os.fsencode(BAD + ".nrrd"))

    def test_texts_in_volumes_are_escaped(self):
        values = program.noise((6, 7, 8))
        lines = b"NRRD0004\ntype: uint8\ndimension: 3\nsizes: 8 7 6\nencoding: raw\n"
        key = os.fsencode(BAD).replace(b"\n", b"")
        for more in (b"content: " + key, b"key:=" + key, b"# " + key, b"space: " + key,
                     b"units: " + key, b"labels: \"" + key + b"\" \"b\" \"c\"", key):
            program.write("t.nrrd", lines + more + b"\n\n" + values.tobytes())
            for command in ("info", "t.nrrd"), ("info", "--json", "t.nrrd"), \
                           ("render", "t.nrrd", "-o", "a.png", "--size", "16x16"):
                self.clean(*command, shows=False)


if __name__ == "__main__":
    program.main()
