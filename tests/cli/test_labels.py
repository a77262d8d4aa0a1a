"""Tests that labels are drawn without interpolation, so that no colour appears that no label has. The
palettes follow from the transfer function, and the extents from the boxes of the voxels."""
import os

import numpy
import program

PALETTE = {1: (1, 0, 0), 5: (0, 1, 0), 9: (0, 0, 1)}
FLAT = ("--size=60x60", "--no-shading", "--background=0,0,0,0", "--tf", "opaque.tf",
        "--opacity-scale=1e6")
OBLIQUE = ("--azimuth=33", "--elevation=21")


def boxes():
    """A box of label 5 in a box of label 1, with label 9 beside them. Label 5 lies between the labels
    1 and 9, so interpolation would show it at their border."""
    volume = numpy.zeros((32, 32, 32), "u1")
    volume[5:22, 5:27, 5:27] = 1
    volume[9:17, 9:17, 5:14] = 5
    volume[22:27, 5:27, 5:27] = 9
    return volume


def function():
    """Labels are opaque within a tiny part of a voxel. All values between are white."""
    points = ["0 0 0 0 0", "0.01 0 0 0 0"]
    for value, rgb in PALETTE.items():
        colour = " ".join(map(str, rgb))
        points += [f"{value - 0.02} 1 1 1 0.9999", f"{value - 0.01} {colour} 0.9999",
                   f"{value + 0.01} {colour} 0.9999", f"{value + 0.02} 1 1 1 0.9999"]
    return "\n".join(points).encode() + b"\n"


def mixed(picture):
    """Returns the number of nearly opaque pixels whose colour is no label's."""
    opaque = picture[picture[..., 3] > 0.99][:, :3]
    apart = numpy.stack([abs(opaque - rgb).max(1) for rgb in PALETTE.values()])
    return (apart.min(0) > 0.02).sum()


class Labels(program.ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        program.write_nrrd("boxes.nrrd", boxes())
        program.write("opaque.tf", function())

    def test_no_pixel_has_a_colour_of_no_label(self):
        for renderer in "cpu", "reference", "integral", *program.GL:
            for view in OBLIQUE, ("--ortho=fit", "--view=front"), ("--ortho=fit", *OBLIQUE):
                flat = self.picture("boxes.nrrd", *FLAT, *view, "--renderer", renderer,
                                    "--samples=1")
                self.assertGreater((flat[..., 3] > 0.99).sum(), 300)
                self.assertEqual(mixed(flat), 0, (renderer, view))
        linear = self.picture("boxes.nrrd", *FLAT, *OBLIQUE, "--interpolation=linear")
        self.assertGreater(mixed(linear), 100)

    def test_coarse_levels_invent_no_label(self):
        """The borders of the labels lie within coarse voxels. Splats overlap, so a few pixels of pre
        mix two labels."""
        large = boxes().repeat(4, 0).repeat(4, 1).repeat(4, 2)
        program.write_nrrd("large.nrrd", numpy.roll(large, 1, (0, 1, 2)))
        self.works("brick", "large.nrrd", "-o", "large.trip", "--keep-all", "-q", "--levels-for", "both")
        for classify, share in ("post", 0), ("pre", 0.02):
            picture = self.picture("large.trip", *FLAT, *OBLIQUE, "--lod=20", "--samples=1",
                                   "--classify", classify)
            opaque = (picture[..., 3] > 0.99).sum()
            self.assertGreater(opaque, 1000)
            self.assertLessEqual(mixed(picture), share * opaque, classify)

    def test_a_note_names_the_choice_and_the_option(self):
        shown = ("-o", "a.png", "--size=20x20")
        said = self.works("render", "boxes.nrrd", *shown).stderr
        self.assertRegex(said, "note: boxes.nrrd: the values are labels.*--interpolation linear")
        said = self.works("render", "boxes.nrrd", *shown, "--tf", "opaque.tf").stderr
        self.assertIn("--interpolation linear", said)
        for given in "--interpolation=linear", "--interpolation=nearest", "--kernel=linear", "--classify=pre":
            self.assertNotIn("labels", self.works("render", "boxes.nrrd", *shown, given).stderr)

    def drawn(self, path, *options):
        return self.stats(path, "--size=20x20", *options)["interpolation"]

    def test_intent_and_name_decide_and_a_mask_stays_a_solid(self):
        rough = (boxes().astype("<u2") * 4000 + numpy.arange(32, dtype="<u2") * 7)
        program.write_nrrd("values.nrrd", rough)
        self.assertEqual(self.drawn("values.nrrd"), "linear")
        os.rename("values.nrrd", "head-labels.nrrd")
        self.assertEqual(self.drawn("head-labels.nrrd"), "nearest")
        program.write_nrrd("mask.nrrd", (boxes() > 0).astype("u1"))
        self.assertEqual(self.drawn("mask.nrrd"), "linear")
        self.assertEqual(self.drawn("mask.nrrd", "--interpolation=nearest"), "nearest")
        program.write_nifti("image.nii", rough)
        self.assertEqual(self.drawn("image.nii"), "linear")
        with open("image.nii", "rb") as file:
            header = bytearray(file.read())
        header[68:70] = (1002).to_bytes(2, "little")  # NIFTI_INTENT_LABEL
        program.write("atlas.nii", bytes(header))
        self.assertEqual(self.drawn("atlas.nii"), "nearest")


if __name__ == "__main__":
    program.main()
