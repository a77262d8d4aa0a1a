"""Tests colours behind the volume in each format, commands that messages print, and the size that
`brick` and `info` print."""
import json
import os
import re
import shutil
import struct
import subprocess
import zlib

import numpy

import program

# Names and values of the basic colours, from CSS Color Module Level 4, section 6.1.
CSS = {
    "black": 0x000000, "silver": 0xC0C0C0, "gray": 0x808080, "grey": 0x808080, "white": 0xFFFFFF,
    "maroon": 0x800000, "red": 0xFF0000, "purple": 0x800080, "fuchsia": 0xFF00FF, "green": 0x008000,
    "lime": 0x00FF00, "olive": 0x808000, "yellow": 0xFFFF00, "navy": 0x000080, "blue": 0x0000FF,
    "teal": 0x008080, "aqua": 0x00FFFF,
}
COLOUR = 0.2, 0.4, 0.8  # of the volume
FOLDER = "it's a; folder $x"  # a shell acts on all of these characters


def read_png(path):
    """Returns the samples of a PNG file with 8 bits. PNG stores colours without alpha."""
    with open(path, "rb") as f:
        data = f.read()
    at, packed = 8, b""
    while at < len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        body = data[at + 8 : at + 8 + length]
        if kind == b"IHDR":
            width, height, bits, colours = struct.unpack_from(">IIBB", body)
        packed += body if kind == b"IDAT" else b""
        at += 12 + length
    assert bits == 8
    channels = {2: 3, 6: 4}[colours]
    raw, before, rows = zlib.decompress(packed), bytearray(width * channels), []
    for y in range(height):
        start = y * (width * channels + 1)
        row = bytearray(raw[start + 1 : start + 1 + width * channels])
        for i in range(len(row)):
            a = row[i - channels] if i >= channels else 0
            b, c = before[i], before[i - channels] if i >= channels else 0
            paeth = min((a, b, c), key=lambda v: abs(a + b - c - v))
            row[i] = (row[i] + (0, a, b, (a + b) // 2, paeth)[raw[start]]) % 256
        rows.append(row)
        before = row
    return numpy.array(rows, "u1").reshape(height, width, channels)


def read_tiff(path):
    """Returns the samples of a TIFF file with 16 bits and its tag ExtraSamples."""
    with open(path, "rb") as f:
        data = f.read()
    order = {b"II": "<", b"MM": ">"}[data[:2]]
    (at,) = struct.unpack_from(order + "I", data, 4)
    tags = {}
    for i in range(struct.unpack_from(order + "H", data, at)[0]):
        tag, kind, count = struct.unpack_from(order + "HHI", data, at + 2 + 12 * i)
        letter = {1: "B", 3: "H", 4: "I"}.get(kind)
        if letter:
            place = at + 10 + 12 * i
            if count * struct.calcsize(letter) > 4:
                (place,) = struct.unpack_from(order + "I", data, place)
            tags[tag] = struct.unpack_from(f"{order}{count}{letter}", data, place)
    assert set(tags[258]) == {16} and tags.get(284, (1,)) == (1,)
    strips = [data[offset : offset + count] for offset, count in zip(tags[273], tags[279])]
    if tags[259][0] != 1:  # Deflate
        strips = [zlib.decompress(strip) for strip in strips]
    rows = numpy.frombuffer(b"".join(strips), order + "u2")
    rows = rows.reshape(tags[257][0], tags[256][0], tags[277][0])
    if tags.get(317, (1,)) == (2,):  # differences along a row
        rows = numpy.cumsum(rows, axis=1, dtype="u2")
    return rows, tags.get(338)


def to_linear(v):
    """Returns the linear light of an sRGB value."""
    return v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4


class CommandLine(program.ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        program.write("one.tf", b"0 %g %g %g 0\n255 %g %g %g 0.2\n" % (COLOUR + COLOUR))
        program.write("low.tf", b"10 1 1 1 0\n20 1 1 1 0.5\n200 1 1 1 0.5\n")
        program.write_nrrd("ball.nrrd", program.ball((24, 24, 24)))
        cls.works(cls(), "brick", "ball.nrrd", "-q", "--tf", "one.tf")

    def draw(self, output, *options):
        run = self.works("render", "ball.trip", "-o", output, "--size=32", "--no-shading",
                         "--tf=one.tf", *options, program=program.PROGRAM)
        self.assertEqual(run.stderr, "")

    def test_names_and_digits_are_the_colours_of_css(self):
        wanted = {name: (rgb >> 16, rgb >> 8 & 255, rgb & 255, 255) for name, rgb in CSS.items()}
        wanted |= {"#1fe": (0x11, 0xFF, 0xEE, 255), "#12aBcd": (0x12, 0xAB, 0xCD, 255),
                   "#0f08": (0, 255, 0, 0x88), "#10203040": (16, 32, 48, 64),
                   "1,0.2,0": (255, 51, 0, 255), "transparent": (0, 0, 0, 0), "none": (0, 0, 0, 0)}
        for name, rgba in wanted.items():
            self.draw("a.png", "--background", name)
            self.assertEqual(tuple(read_png("a.png")[0, 0]), rgba, name)

    def test_each_format_keeps_a_transparent_background(self):
        for extension in "png", "tif", "exr":
            self.draw(f"a.{extension}", "--background", "transparent")
        png = read_png("a.png") / 255
        tiff, kind = read_tiff("a.tif")
        self.assertEqual(kind, (1,))  # associated alpha
        exr, tiff = program.read_linear_exr("a.exr"), tiff / 65535
        for picture in png, tiff, exr:
            self.assertEqual(picture[0, 0].max(), 0)
        within = exr[..., 3] > 0.2
        self.assertGreater(within.sum(), 100)
        self.assertLess(exr[..., 3].max(), 0.99)
        for channel, value in enumerate(COLOUR):
            self.assertLess(abs(png[within][:, channel] - value).max(), 0.51 / 255)
            for picture, stored in (tiff, value), (exr, to_linear(value)):
                alpha = picture[within][:, 3]
                self.assertLess(abs(picture[within][:, channel] - stored * alpha).max(), 1e-4)

    def test_formats_without_alpha_refuse_a_transparent_background(self):
        draw = "render", "ball.trip", "--size=32"
        for colour in "transparent", "1,1,1,0.5", "#ffffff00":
            for output in "a.jpg", "b.JPEG", "c.mp4":
                more = ["--orbit=2"] if output == "c.mp4" else []
                self.leaves_nothing(2, *draw, "-o", output, "--background", colour, *more,
                                    says=f"{output} cannot hold a transparent background")
        self.works(*draw, "-o", "a.jpg", "--background", "white")

    def shell(self, command):
        """Runs a printed command in a shell."""
        environment = dict(os.environ, PATH=os.path.dirname(program.PROGRAM) + ":" + os.environ["PATH"])
        return subprocess.run(command, shell=True, env=environment, capture_output=True, text=True)

    def commands(self, run):
        return re.findall(r"`(triptych [^`]*)`", run.stderr)

    def test_a_command_that_bricks_again_finds_the_volume(self):
        """The volume lies in another folder than the data set and the current folder."""
        os.makedirs(FOLDER, exist_ok=True)
        os.makedirs("sets", exist_ok=True)
        shutil.copy("ball.nrrd", FOLDER)
        os.rename("ball.nrrd", "moved.nrrd")
        for data_set in "sets/again.trip", f"{FOLDER}/again.trip", "again.trip":
            self.works("brick", f"{FOLDER}/ball.nrrd", "-q", "-o", data_set, "--range=150:255")
            view = "render", data_set, "-o", "a.png", "--size=20", "--tf", "low.tf"
            run = self.works(*view)
            command = re.search(r"to keep them: (triptych .*)\n", run.stderr)
            self.assertTrue(command, run.stderr)
            done = self.shell(command[1])
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(self.works(*view).stderr, "")
        os.rename("moved.nrrd", "ball.nrrd")
        self.works("render", f"{FOLDER}/ball.nrrd", "-o", "a.png", "--size=20", "-q")
        shutil.rmtree(FOLDER)

    def test_printed_commands_work_in_a_shell(self):
        os.makedirs(FOLDER, exist_ok=True)
        volume, raw = f"{FOLDER}/ball.nrrd", f"{FOLDER}/voxels.dat"
        shutil.copy("ball.nrrd", volume)
        program.write(raw, bytes(range(64)))
        drawing, viewing = self.commands(self.fails(2, volume, says="is no command"))
        self.assertEqual(self.shell(drawing.replace("PICTURE", "pasted") + " --size 16").returncode, 0)
        self.assertTrue(os.path.getsize("pasted.png"))
        self.assertEqual(self.shell(f"set -- {viewing}; printf %s \"$3\"").stdout, volume)
        (bricking,) = self.commands(self.fails(1, "render", raw, "-o", "a.png", says="no known format"))
        done = self.shell(bricking.replace("X,Y,Z", "4,4,4") + " --keep-all -o pasted.trip")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(self.info("pasted.trip")["kept"], 64)
        shutil.rmtree(FOLDER)

    def test_brick_and_info_print_the_size_of_all_files(self):
        for name, options in ("plain", []), ("bare", ["--halo=0", "--levels=0"]):
            path = f"{name}.trip"
            run = self.works("brick", "ball.nrrd", "-o", path, "--keep-all", *options)
            size = sum(os.path.getsize(os.path.join(path, f)) for f in os.listdir(path))
            self.assertEqual(self.info(path)["bytes"], size)
            lines = [re.search(rb"^size +(.*)$", text, re.M)[1]
                     for text in (run.stdout, self.works("info", path).stdout)]
            self.assertEqual(lines[0], lines[1])
            number, unit = re.match(rb"([\d.]+) (kB|MB) on disk", lines[0]).groups()
            self.assertAlmostEqual(float(number) * {b"kB": 1e3, b"MB": 1e6}[unit], size,
                                   delta=0.006 * size)  # three digits
            made = json.loads(self.works("brick", "ball.nrrd", "-o", path, "--force", "--keep-all",
                                         "--json", *options).stdout)
            self.assertEqual(made["bytes"], size)
            estimate = json.loads(self.works("brick", "ball.nrrd", "-o", path, "--keep-all",
                                             "--dry-run", "--json", *options).stdout)
            self.assertTrue(size / 2 < estimate["bytes"] < 2 * size, (estimate, size))

    def test_counts_of_voxels_are_whole_below_a_million(self):
        for edge, count in (12, "1728"), (99, "970299"), (100, "1.00 million"), (128, "2.10 million"):
            program.write_nrrd("edge.nrrd", program.noise((edge, edge, edge)))
            brick = "brick", "edge.nrrd", "--keep-all", "--levels=0", "--force", "-o", "edge.trip"
            self.assertIn(f" of {count} voxels, ".encode(), self.works(*brick, "--dry-run").stdout)
            self.works(*brick)
            drawn = self.works("render", "edge.trip", "-o", "edge.png", "--size=40", "--occluded=draw",
                               "--method=axis", "--opacity-scale=0.001").stdout.decode()
            self.assertIn(f"edge.png: 40 x 40, {count} voxels, ", drawn)

    def test_large_whole_values_have_all_digits(self):
        volume = numpy.zeros((4, 4, 4), "u4")
        volume[1, 2, 3] = 4000000001
        program.write_nrrd("ids.nrrd", volume)
        run = self.works("brick", "ids.nrrd", "--keep-all", "--force", "-o", "ids.trip")
        self.assertIn(b"values 0 to 4000000001\n", run.stdout)
        self.assertIn(b"\nvalues       0 to 4000000001\n", self.works("info", "ids.trip").stdout)

    def test_each_line_of_info_has_its_own_label(self):
        os.makedirs("sub", exist_ok=True)
        affine = -numpy.eye(4)
        affine[:3, :3] = numpy.diag([-1.0, -1, 1])
        affine[:3, :3][affine[:3, :3] == 0] = -0.0
        program.write_nifti("sub/labels.nii", program.noise((12, 12, 12)), affine)
        self.works("brick", "sub/labels.nii", "--keep-all", "--force", "-o", "labels.trip")
        for path in "sub/labels.nii", "labels.trip":
            text = self.works("info", path).stdout.decode()
            labels = [line[:12] for line in text.splitlines() if not line.startswith("list ")]
            self.assertEqual(len(labels), len(set(labels)), text)
            self.assertIn("world x      = -1 i + 0 j + 0 k + 0\n", text)  # no -0
        self.assertIn("source path  sub/labels.nii\nfile format  nifti\n", text)

    def test_info_tells_how_values_are_stored(self):
        """Integers of 8 and 16 bits are stored exactly. Floats have 2^16 codes, with a quarter of
        the range of values as a margin on either side (FORMAT.md)."""
        values = numpy.linspace(0, 1, 4096).reshape(16, 16, 16)
        for volume, line in (
            ((255 * values).astype("u1"), "1 byte a value, no normals; 255 steps of 1 from 0 to 255"),
            ((4095 * values).astype("u2"), "2 bytes a value, no normals; 65535 steps of 1 from 0 to 65535, "
                                           "with a margin around the values"),
            ((2 * values).astype("f4"), "2 bytes a value, no normals; 65535 steps of 4.58e-05 from -0.5 to "
                                        "2.5, with a margin around the values"),
        ):
            program.write_nrrd("steps.nrrd", volume)
            self.works("brick", "steps.nrrd", "--keep-all", "--normals=none", "--force", "-q")
            text = self.works("info", "steps.trip").stdout.decode()
            self.assertIn(f"stored as    {line}\n", text)


if __name__ == "__main__":
    program.main()
