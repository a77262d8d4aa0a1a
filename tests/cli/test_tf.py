"""Tests of `triptych tf`: list, show, convert, and refused input."""
import json
import os
import stat
import xml.etree.ElementTree

import program

STEP = b"-400 0.6 0.3 0.2 0\n150 0.9 0.6 0.5 0.01\n150 1 0.9 0.8 0.3\n3000 1 1 0.9 0.9\n"


class Tf(program.ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        program.write("step.tf", STEP)
        program.write_nrrd("ball.nrrd", program.ball((20, 20, 20)))
        cls.works(cls(), "brick", "ball.nrrd", "-q")

    def shown(self, *arguments):
        """Returns the points that `tf show` prints."""
        lines = self.works("tf", "show", *arguments).stdout.decode().splitlines()
        self.assertRegex(lines[0], "^unit ")
        return [tuple(map(float, line.split())) for line in lines[2:]]

    def test_every_listed_preset_can_be_shown(self):
        lines = self.works("tf", "list").stdout.decode().splitlines()[1:]
        made = 0
        for line in lines:
            name = line.split()[0]
            if "histogram" in line:
                made += 1
                self.fails(2, "tf", "show", name, says="needs a histogram")
                self.shown("--tf", name, "ball.trip")
            else:
                self.assertGreater(len(self.shown(name)), 2)
        self.assertEqual(made, 6)
        self.assertGreater(len(lines), 14)

    def test_the_stored_transfer_function_can_be_shown_and_edited(self):
        points = self.shown("ball.trip")
        self.assertEqual(points, self.shown("ball.nrrd"))
        self.assertEqual(points, self.shown("--tf", "auto", "ball.trip"))
        text = self.works("tf", "show", "ball.trip").stdout
        program.write("edited.tf", text)
        view = ["ball.trip", "--size", "32x32"]
        as_kept = self.picture(*view)
        self.assertTrue((as_kept == self.picture(*view, "--tf", "edited.tf")).all())

    def test_presets_over_the_range_are_adapted_to_the_data(self):
        self.assertEqual([p[0] for p in self.shown("ball.trip", "--tf", "grey")], [0, 20, 80, 200])
        self.assertEqual([p[0] for p in self.shown("grey", "--range=-100:100")],
                         [-100, -80, -20, 100])
        self.assertEqual([p[0] for p in self.shown("grey")], [0, 0.1, 0.4, 1])

    def test_converted_files_can_be_read_back(self):
        for name in ("a.json", "a.vp", "a.vp.json", "a.xml", "a.tf"):
            self.works("tf", "convert", "step.tf", name)
            points = self.shown(name)
            self.assertEqual([p[1:] for p in points], [
                (0.6, 0.3, 0.2, 0), (0.9, 0.6, 0.5, 0.01), (1, 0.9, 0.8, 0.3), (1, 1, 0.9, 0.9)])
            for got, expected in zip(points, (-400, 150, 150, 3000)):
                self.assertAlmostEqual(got[0], expected, places=9)
        self.works("tf", "convert", "step.tf", "vtk.xml", "--format", "vtk")
        self.assertEqual(len(self.shown("vtk.xml")), 4)

    def test_other_parsers_can_read_converted_files(self):
        """Uses the JSON and XML parsers of Python's standard library."""
        out = lambda form: self.works("tf", "convert", "step.tf", "-", "--format", form).stdout
        colour_map = json.loads(out("paraview"))[0]
        self.assertEqual(colour_map["RGBPoints"][:4], [-400, 0.6, 0.3, 0.2])
        self.assertEqual(colour_map["Points"][-4:], [3000, 0.9, 0.5, 0])
        self.assertEqual(colour_map["ColorSpace"], "RGB")
        component = json.loads(out("vp.json"))["volumeProperties"][0]["components"][0]
        self.assertEqual(component["scalarOpacity"]["points"][-1], {"x": 3000, "y": 0.9})
        self.assertEqual(component["rgbTransferFunction"]["points"][0]["color"], [0.6, 0.3, 0.2])
        preset = xml.etree.ElementTree.fromstring(out("slicer")).find("VolumeProperty").attrib
        numbers = list(map(float, preset["scalarOpacity"].split()))
        self.assertEqual(numbers[0], len(numbers) - 1)
        self.assertEqual(numbers[1:3] + numbers[-2:], [-400, 0, 3000, 0.9])
        numbers = list(map(float, preset["colorTransfer"].split()))
        self.assertEqual(numbers[0], len(numbers) - 1)
        values = numbers[1::4]
        self.assertEqual(sorted(set(values)), values)  # no value occurs twice
        root = xml.etree.ElementTree.fromstring(out("vtk"))
        points = root.findall("Component/ScalarOpacity/PiecewiseFunction/Point")
        self.assertEqual([float(p.get("Value")) for p in points], [0, 0.01, 0.3, 0.9])
        lines = out("vp").decode().splitlines()
        self.assertEqual(len(lines), 9)
        self.assertEqual(len(lines[8].split()), 1 + int(lines[8].split()[0]))

    def test_only_force_replaces_an_existing_file(self):
        program.write("there.tf", b"0 0 0 0 0\n")
        os.chmod("there.tf", 0o600)
        self.leaves_nothing(1, "tf", "convert", "ct-bone", "there.tf", says="--force")
        self.assertEqual(len(self.shown("there.tf")), 1)
        self.works("tf", "convert", "ct-bone", "there.tf", "--force")
        self.assertEqual(len(self.shown("there.tf")), 5)
        self.assertEqual(stat.S_IMODE(os.stat("there.tf").st_mode), 0o600)

    def test_wrong_usage_is_one_line(self):
        for arguments in (
            [], ["lst"], ["show"], ["convert", "grey"], ["show", "grey", "bone"],
            ["list", "grey"], ["list", "--force"], ["show", "grey", "--force"],
            ["convert", "grey", "a.txt"], ["convert", "grey", "a.b.xml"],
            ["show", "grey", "--tf", "bone"], ["show", "grey", "--range=1"],
            ["show", "grey", "--range=2:1"], ["convert", "grey", "-", "--format=x"],
        ):
            self.leaves_nothing(2, "tf", *arguments)

    def test_bad_input_is_one_line_and_no_file(self):
        program.write("bad.xml", b"<MRML><VolumeProperty scalarOpacity='2 0 1'")
        program.write("bad.vp", b"1\n2\n")
        program.write("bad.json", b"{")
        program.write("laughs.xml", b'<!DOCTYPE a [<!ENTITY b "cc">]><a>&b;</a>')
        program.write("empty.tf", b"")
        for name in ("bad.xml", "bad.vp", "bad.json", "laughs.xml", "empty.tf", "none.tf", "none",
                     "/dev/null", "."):
            self.leaves_nothing(1, "tf", "convert", name, "out.tf")
            self.fails(1, "tf", "show", name)
        self.leaves_nothing(1, "tf", "convert", "grey", "no/such/folder/a.tf")

    def test_colour_maps_without_opacities_leave_the_background_empty(self):
        """The map for surfaces would be a solid box: the tooth's surroundings are a quarter of its
        range. The corners of the box stay background."""
        colours = '"RGBPoints": [0, 0.2, 0.3, 0.8, 0.5, 0.9, 0.9, 0.9, 1, 0.7, 0, 0.1]'
        point = '<Point x="%d" o="1" r="1" g="%d" b="0"/>'
        program.write("plain.json", ("[{%s}]" % colours).encode())
        program.write("opaque.json", ('[{%s, "Points": [0, 1, 0.5, 0, 1, 1, 0.5, 0]}]' % colours).encode())
        program.write("map.xml", f'<ColorMap space="RGB">{point % (0, 0)}{point % (1, 1)}</ColorMap>'.encode())
        tooth = os.path.join(program.DATASETS, "tooth.nhdr")
        for name in "plain.json", "opaque.json", "map.xml":
            run = self.works("render", tooth, "-o", "a.exr", "--size=96x96", "--view=front", "--ortho", "fit",
                             "--tf", name, "--background=none")
            self.assertEqual(run.stderr.count("has colours without opacities"), 1, run.stderr)
            alpha = program.read_exr("a.exr")[..., 3]
            corners = [alpha[y, x] for y in (2, -3) for x in (2, -3)]
            self.assertEqual(max(corners), 0, name)
            self.assertGreater(alpha[48, 48], 0.99)
            shown = (alpha > 0.5).mean()
            self.assertLess(shown, 0.6)
            self.assertGreater(shown, 0.2)
        run = self.works("render", tooth, "-o", "a.exr", "--tf", "plain.json", "--window=800", "--level=900")
        self.assertNotIn("without opacities", run.stderr)


if __name__ == "__main__":
    program.main()
