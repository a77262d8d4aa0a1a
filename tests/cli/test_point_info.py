"""Tests `info` of clouds of points: text, JSON, one line for a damaged file, and memory that does not
grow with the file."""
import json
import os
import resource
import struct
import sys
import unittest

import program

sys.path.insert(0, os.path.join(os.environ["TRIP_SOURCE_DIR"], "tests", "preprocess"))
import las_records  # noqa: E402

FILES = os.path.join(os.environ["TRIP_SOURCE_DIR"], "tests", "regress", "points")
SANITIZED = bool(os.environ.get("TRIP_SANITIZE"))


DATA_BYTES = 32 << 20


def limit_memory():
    resource.setrlimit(resource.RLIMIT_DATA, (DATA_BYTES, DATA_BYTES))


def write_sparse(path, head, bytes_after):
    program.write(path, head)
    with open(path, "r+b") as file:
        file.truncate(len(head) + bytes_after)


def write_cloud(name, count):
    """Writes a cloud of `count` points at one place, with a hole for the data."""
    if name == "a.las":
        head = las_records.las(0, las_records.records_of(0, 0), count=count, lo=las_records.OFFSET,
                               hi=las_records.OFFSET)
        write_sparse(name, head, 20 * count)
    elif name == "a.ply":
        head = ("ply\nformat binary_little_endian 1.0\n" + f"element vertex {count}\n" +
                "".join(f"property float {a}\n" for a in "xyz") + "end_header\n").encode()
        write_sparse(name, head, 12 * count)
    else:
        head = ("VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
                f"WIDTH {count}\nHEIGHT 1\nPOINTS {count}\nDATA binary\n").encode()
        write_sparse(name, head, 12 * count)


class PointInfo(program.ProgramTest):
    def test_text_and_json_of_a_las_file(self):
        """The counts of classes and the bounds are those that the file's source states."""
        path = os.path.join(FILES, "1.2-with-color.copc.laz")
        done = json.loads(self.works("info", path, "--json").stdout)
        self.assertEqual(done["kind"], "cloud of points")
        self.assertEqual(done["format"], "COPC 1.4, point format 7")
        self.assertEqual((done["points"], done["left_out"], done["empty"]), (1065, 0, 0))
        self.assertEqual(done["attributes"], ["colour", "intensity", "classification", "returns", "gps time"])
        self.assertEqual(sum(done["classes"].values()), 1065)
        for got, true in zip(sum(done["bounds"], []),
                             (635619.85, 848899.7, 406.59, 638982.55, 853535.43, 586.38)):
            self.assertAlmostEqual(got, true, 6)
        text = self.works("info", path).stdout.decode()
        self.assertIn("\nbounds       x 635619.85 to 638982.55, y 848899.7 to 853535.43, z 406.59 to 586.38\n", text)
        self.assertIn("\nnote         the colours use 8 of 16 bits (0 to 249), and are read as 8 bits\n", text)

    def test_scans_and_grids(self):
        rows = "1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n10 20 30 1\n"
        program.write("a.ptx", f"2\n2\n10 20 30\n{rows}0 0 0 0\n1 2 3 0.5\n0 0 0 0\n4 5 6 0.25\n".encode())
        done = json.loads(self.works("info", "a.ptx", "--json").stdout)
        self.assertEqual((done["points"], done["empty"], done["scans"], done["posed_scans"], done["grid"]),
                         (2, 2, 1, 1, [2, 2]))
        self.assertEqual(done["bounds"], [[11, 22, 33], [14, 25, 36]])
        self.assertEqual(done["intensity"], [0.25, 0.5])
        text = self.works("info", "a.ptx").stdout.decode()
        for line in "empty cells  2", "range grid   2 x 2", "scans        1, of these 1 with a pose":
            self.assertIn(line + "\n", text)

    def test_hostile_names_are_printed_visibly(self):
        name = b"a\x1b[31m\n"
        records = las_records.records_of(0, 5, 1)
        program.write("a.las", las_records.las(0, records, 4, vlrs=[
            ("LASF_Spec", 4, struct.pack("<2xBB32s156x", 1, 0, name))]))
        text = self.works("info", "a.las").stdout
        self.assertNotIn(b"\x1b", text)
        self.assertIn(b"further      a\\x1b[31m", text)
        json.loads(self.works("info", "a.las", "--json").stdout)

    def test_a_damaged_file_gets_one_line(self):
        for name in sorted(os.listdir(FILES)):
            with open(os.path.join(FILES, name), "rb") as file:
                data = file.read()
            short = name.split(".")[0] + "." + name.split(".")[-1]
            for bytes_left in (20, 300, len(data) // 2, len(data) - 30):
                program.write(short, data[:min(bytes_left, len(data) - 1)])
                done = self.fails(1, "info", short)
                self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
                self.assertTrue(done.stderr.startswith(f"triptych: read: {short}: "), done.stderr)
            os.remove(short)

    @unittest.skipIf(SANITIZED, "sanitizers enlarge the memory of the process")
    def test_memory_does_not_grow_with_the_file(self):
        """Each file is larger than the memory that the process may take."""
        for name in "a.las", "a.ply", "a.pcd":
            write_cloud(name, 5000000)
            self.assertGreater(os.path.getsize(name), 50 << 20)
            done = json.loads(self.works("info", name, "--json", preexec_fn=limit_memory).stdout)
            self.assertEqual(done["points"], 5000000)
            os.remove(name)
        with open("a.xyz", "wb") as file:
            for _ in range(1000):
                file.write(b"1.000000000000000000 2.000000000000000000 3.000000000000000000\n" * 900)
        self.assertGreater(os.path.getsize("a.xyz"), 50 << 20)
        done = json.loads(self.works("info", "a.xyz", "--json", preexec_fn=limit_memory).stdout)
        self.assertEqual(done["bounds"], [[1, 2, 3], [1, 2, 3]])


if __name__ == "__main__":
    program.main()
