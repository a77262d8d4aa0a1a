"""Records that are not what the index says of their brick, under right checksums: no renderer draws
them, and the one line that says so names the file and the place."""
import os
import shutil
import struct

import craft
import numpy
import program

VIEW = ("--size=40x40", "--look=20,15,10", "--eye=80,-60,70")
FAR = 2147483647 - 64


class Records(program.ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        program.write_nrrd("a.nrrd", program.ball((20, 30, 40)))
        assert program.call("brick", "a.nrrd", "-o", "a.trip", "-q").returncode == 0
        gl = program.call("render", "a.trip", "-o", "can.exr", "--renderer=gl", *VIEW)
        cls.renderers = ["cpu", "reference", *([] if gl.returncode else ["gl"])]
        if gl.returncode:
            print("skipped for gl: " + gl.stderr, end="", flush=True)

    def change_record(self, axis, place, bits):
        """Puts `bits` (a mask and a value) into a record and says where it is in which file."""
        shutil.rmtree("b.trip", ignore_errors=True)
        shutil.copytree("a.trip", "b.trip")
        data = craft.Dataset("a.trip")
        records = data.planes[f"{axis}.voxels"]
        at = place if place >= 0 else len(records) + place
        (old,) = struct.unpack_from("<I", records, at)
        struct.pack_into("<I", records, at, (old & ~bits[0]) | bits[1])
        data.write("b.trip")
        return f"b.trip/{axis}.voxels: byte {at}: "

    def refused(self, where, says):
        for name in self.renderers:
            # The view sees three lists, some with weight at few pixels alone.
            self.fails(
                1, "render", "b.trip", "-o", "b.exr", f"--renderer={name}", "--h=0", *VIEW,
                says=where,
            )
            self.assertFalse(os.path.exists("b.exr"))
        self.assertIn(says, self.fails(1, "info", "--verify", "b.trip", says=where).stderr)

    def test_a_place_outside_the_bricks_bounds(self):
        for axis, place, bits in (
            ("x", 0, (0xFF, 0xFF)),
            ("y", -4, (0xFF00, 0xFF00)),
            ("z", 4096, (0xFFFF, 0x4040)),
        ):
            self.refused(
                self.change_record(axis, place, bits), "the splat is outside its brick's bounds"
            )

    def test_the_one_that_was_drawn_once(self):
        path = os.path.join(os.environ["TRIP_SOURCE_DIR"], "tests/regress/record_outside_brick.trip")
        for name in self.renderers:
            self.fails(
                1, "render", path, "-o", "b.exr", f"--renderer={name}", "--size=40x40",
                says="voxels: byte 12: the splat is outside its brick's bounds",
            )

    def test_a_code_outside_the_bricks_range(self):
        for axis in "xz":
            data = craft.Dataset("a.trip")
            (first,) = struct.unpack_from("<I", data.planes[f"{axis}.voxels"], 0)
            for brick in data.bricks("xyz".index(axis)):
                data.put("<2H", brick + 12, (first >> 16) + 1, 65535)
            shutil.rmtree("b.trip", ignore_errors=True)
            shutil.copytree("a.trip", "b.trip")
            data.write("b.trip")
            self.refused(f"b.trip/{axis}.voxels: byte ", "the value is outside its brick's range")

    def test_near_the_end_of_the_largest_grid(self):
        """What lies there is drawn as elsewhere, and a record that would lie beyond is refused."""
        data = craft.Dataset("a.trip")
        tile_log2, slab_sheets = data.number("<I", 224), data.number("<I", 228)
        offset = FAR >> 7 << 7
        self.assertTrue(max(tile_log2, slab_sheets.bit_length() - 1) <= 7)
        for axis in range(3):
            data.put("<Q", 48 + 8 * axis, 2147483647)
            for brick in data.bricks(axis):
                u, v = struct.unpack_from("<2I", data.index, brick)
                tiles = offset >> tile_log2
                data.put("<2I", brick, u + tiles, v + tiles)
            for slab in data.slabs(axis):
                data.put("<I", slab + 20, data.number("<I", slab + 20) + offset // slab_sheets)
        view = (
            "--size=40x40",
            f"--look={offset + 20},{offset + 15},{offset + 10}",
            f"--eye={offset + 80},{offset - 60},{offset + 70}",
        )
        shutil.copytree("a.trip", "far.trip")
        data.write("far.trip")
        for name in self.renderers:
            renderer = f"--renderer={name}"
            near = self.picture("a.trip", renderer, *VIEW)
            far = self.picture("far.trip", renderer, *view)
            self.assertGreater(near[..., 3].max(), 0.5)
            self.assertLessEqual(float(numpy.abs(near - far).max()), 1e-3, name)
        struct.pack_into("<I", data.planes["z.voxels"], 0, 0xFFFFFFFF)
        data.write("far.trip")
        for name in self.renderers:
            self.fails(
                1, "render", "far.trip", "-o", "b.exr", f"--renderer={name}", "--h=0", *view,
                says="far.trip/z.voxels: byte 0: ",
            )


if __name__ == "__main__":
    program.main()
