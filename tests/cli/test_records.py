"""Tests records that contradict their brick in the index, under valid checksums. No renderer draws
them, and one error line names the file and the offset."""
import json
import os
import shutil
import struct

import craft
import numpy
import program

VIEW = ("--size=40x40", "--look=20,15,10", "--eye=80,-60,70")
LARGEST = 16777216
FAR = LARGEST - 64


class Records(program.ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        program.write_nrrd("a.nrrd", program.ball((20, 30, 40)))
        assert program.call("brick", "a.nrrd", "-o", "a.trip", "-q").returncode == 0
        cls.renderers = "cpu", "reference", *program.GL

    def change_block(self, axis, number, change):
        """Changes the words of one block of a list. Returns the file and the offset as in the error
        line. `change` gets the presence, the masks, and the words behind them."""
        shutil.rmtree("b.trip", ignore_errors=True)
        shutil.copytree("a.trip", "b.trip")
        data = craft.Dataset("a.trip")
        _, _, at, _, words = list(data.runs("xyz".index(axis)))[number]
        plane = data.planes[f"{axis}0.voxels"]
        block = list(struct.unpack_from(f"<{words}Q", plane, at))
        codes = 1 + bin(block[0]).count("1")
        block = change(block[:1], block[1:codes], block[codes:])
        struct.pack_into(f"<{words}Q", plane, at, *block)
        data.write("b.trip")
        return f"b.trip/{axis}0.voxels: byte {at}: "

    def refused(self, where, says):
        for name in self.renderers:
            # The view uses three lists, some of them at few pixels only.
            self.fails(
                1, "render", "b.trip", "-o", "b.exr", f"--renderer={name}", "--h=0", *VIEW,
                says=where,
            )
            self.assertFalse(os.path.exists("b.exr"))
        self.assertIn(says, self.fails(1, "info", "--verify", "b.trip", says=where).stderr)

    def measured(self, name):
        """Returns the bytes that each stage of `bench stream` reads."""
        run = self.works("bench", "stream", name, "--json", "--renderer=cpu", "--size=40x40",
                         "--repeat=1")
        report = json.loads(run.stdout)
        rows = report["tables"]["stages"]["rows"]
        return {row["key"]: row["bytes_read"] for row in rows if "bytes_read" in row}

    def test_lists_may_come_in_any_order(self):
        data = craft.Dataset("a.trip")
        first = data.list_at(0)
        lists = [data.index[at : at + 320] for at in map(data.list_at, range(data.lists))]
        data.index[first : first + 320 * data.lists] = b"".join(reversed(lists))
        data.names.reverse()
        shutil.rmtree("b.trip", ignore_errors=True)
        shutil.copytree("a.trip", "b.trip")
        data.write("b.trip")
        self.works("info", "--verify", "b.trip")
        for name in self.renderers:
            for classify in "pre", "post":
                pictures = []
                for folder in "a.trip", "b.trip":
                    self.works("render", folder, "-o", "x.exr", f"--renderer={name}",
                               f"--classify={classify}", "--h=0", *VIEW)
                    with open("x.exr", "rb") as picture:
                        pictures.append(picture.read())
                self.assertEqual(pictures[0], pictures[1], (name, classify))
        self.assertEqual(self.measured("a.trip"), self.measured("b.trip"))

    def test_a_position_outside_the_bricks_bounds_is_refused(self):
        """Moves the last square of a run to the last square of the tile, which is outside the
        grid."""

        def move(present, masks, codes):
            last = 1 << present[0].bit_length() - 1
            return [present[0] & ~last | 1 << 63, *masks, *codes]

        for axis, number in (("x", 0), ("y", -1), ("z", 10)):
            where = self.change_block(axis, number, move)
            self.refused(where, "a voxel is outside its brick's bounds")

    def test_more_squares_than_masks_are_refused(self):
        change = lambda present, masks, codes: [2**64 - 1, *masks, *codes]
        self.refused(self.change_block("y", 0, change), "more squares than its block has room for")

    def test_masks_with_fewer_voxels_than_the_run_are_refused(self):
        def drop(present, masks, codes):
            return [*present, masks[0] & masks[0] - 1, *masks[1:], *codes]

        self.refused(self.change_block("z", -2, drop), "as many voxels as the index says")

    def test_an_empty_mask_is_refused(self):
        """Moves the voxels of a block's first square to its second."""

        def empty(present, masks, codes):
            bits = bin(masks[0]).count("1")
            free = [n for n in range(64) if not masks[1] >> n & 1][:bits]
            return [*present, 0, masks[1] | sum(1 << n for n in free), *masks[2:], *codes]

        self.refused(self.change_block("x", 0, empty), "a mask is empty")

    def test_a_record_once_drawn_outside_its_brick_is_refused(self):
        path = os.path.join(os.environ["TRIP_SOURCE_DIR"], "tests/regress/record_outside_brick.trip")
        for name in self.renderers:
            self.fails(
                1, "render", path, "-o", "b.exr", f"--renderer={name}", "--size=40x40",
                says="voxels: byte 0: a voxel is outside its brick's bounds",
            )

    def test_a_code_outside_the_bricks_range_is_refused(self):
        for axis in "xz":
            data = craft.Dataset("a.trip")
            for brick in data.bricks("xyz".index(axis)):
                data.put("<2H", brick + 12, data.number("<H", brick + 12) + 1, 65535)
            shutil.rmtree("b.trip", ignore_errors=True)
            shutil.copytree("a.trip", "b.trip")
            data.write("b.trip")
            self.refused(f"b.trip/{axis}0.voxels: byte ", "a value is outside its brick's range")

    def test_voxels_near_the_end_of_the_largest_grid_are_drawn(self):
        """They are drawn as elsewhere, and a record beyond the grid is refused."""
        data = craft.Dataset("a.trip")
        tile_log2, slab_sheets = data.number("<I", 264), data.number("<I", 268)
        offset = FAR >> 7 << 7
        self.assertTrue(max(tile_log2, slab_sheets.bit_length() - 1) <= 7)
        for axis in range(3):
            data.put("<Q", 48 + 8 * axis, LARGEST)
        for number in range(data.lists):
            data.put("<3Q", data.list_at(number) + 16, *3 * [LARGEST])
            for brick in data.bricks(number):
                u, v = struct.unpack_from("<2I", data.index, brick)
                tiles = offset >> tile_log2
                data.put("<2I", brick, u + tiles, v + tiles)
            for slab in data.slabs(number):
                data.put("<I", slab + 28, data.number("<I", slab + 28) + offset // slab_sheets)
        view = (
            "--size=40x40",
            f"--look={offset + 20},{offset + 15},{offset + 10}",
            f"--eye={offset + 80},{offset - 60},{offset + 70}",
        )
        shutil.copytree("a.trip", "far.trip")
        data.write("far.trip")
        # a fixed number, since the automatic number depends on the size of the grid
        post = ("--classify=post", "--samples-per-sheet=2")
        for name in self.renderers:
            for by in ("--classify=pre",), post:
                if by == post and name == "reference":
                    self.fails(1, "render", "far.trip", "-o", "b.exr", "--renderer=reference",
                               *view, says="the whole volume takes 16 bytes per voxel")
                    continue
                near = self.picture("a.trip", f"--renderer={name}", *by, *VIEW)
                far = self.picture("far.trip", f"--renderer={name}", *by, *view)
                self.assertGreater(near[..., 3].max(), 0.5)
                self.assertLessEqual(float(numpy.abs(near - far).max()), 1e-3, (name, by))
        struct.pack_into("<Q", data.planes["z0.voxels"], 0, 2**64 - 1)
        data.write("far.trip")
        for name in self.renderers:
            self.fails(
                1, "render", "far.trip", "-o", "b.exr", f"--renderer={name}", "--h=0",
                "--classify=pre", *view,
                says="far.trip/z0.voxels: byte 0: ",
            )


if __name__ == "__main__":
    program.main()
