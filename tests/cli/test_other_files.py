"""Tests files that are no volumes. One line says what each is, and which program or option reads
it."""
import bz2
import gzip
import io
import json
import os
import struct
import tarfile
import zipfile

import numpy

import program

ARRAY = numpy.arange(10 * 12 * 14, dtype="<f4").reshape(10, 12, 14)
PATH = {"triptych_path": 1, "frames_per_second": 10, "keys": [
    {"seconds": s, "eye": [1, 2, 3 + s], "look": [0, 0, 0], "up": [0, 0, 1], "fov": 30}
    for s in (0, 2)]}


def ply(*lines):
    return "\n".join(("ply", "format ascii 1.0") + lines + ("end_header", "0 0 0", "")).encode()


def npy(array):
    out = io.BytesIO()
    numpy.save(out, array)
    return out.getvalue()


def mrc():
    head = bytearray(1024)
    struct.pack_into("<4i", head, 0, 14, 12, 10, 2)
    head[208:214] = b"MAP \x44\x44"
    return bytes(head) + ARRAY.tobytes()


def archive(make, mode):
    out = io.BytesIO()
    with make(out, mode) as f:
        if mode == "w":
            f.writestr("x", b"y")
        else:
            f.addfile(tarfile.TarInfo("x"))
    return out.getvalue()


def analyze():
    head = bytearray(348)
    struct.pack_into("<i", head, 0, 348)
    return bytes(head)


def exodus():
    """A classic netCDF header with two dimensions and no variable."""
    def name(text):
        return struct.pack(">I", len(text)) + text.encode() + bytes(-len(text) % 4)
    return (b"CDF\x01" + struct.pack(">I", 0) + struct.pack(">2I", 10, 2) + name("num_nodes") +
            struct.pack(">I", 8) + name("num_el_blk") + struct.pack(">I", 1) + bytes(16))


VERTICES = "element vertex 3", "property float x", "property float y", "property float z"

# name, contents, texts of the line
FILES = [
    ("a.stl", b"solid a\nfacet normal 0 0 1\nouter loop\n", "a mesh (STL)", "MeshLab"),
    ("binary", bytes(80) + struct.pack("<I", 2) + bytes(100), "a mesh (STL)", "MeshLab"),
    ("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "a mesh (OBJ)", "MeshLab"),
    ("obj", b"# made\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "a mesh (OBJ)", "MeshLab"),
    ("a.off", b"OFF\n3 1 0\n", "a mesh (OFF)", "MeshLab"),
    ("a.glb", b"glTF\2\0\0\0" + bytes(20), "glTF", "Blender"),
    ("a.gltf", b'{"asset":{"version":"2.0"}}', "glTF", "Blender"),
    ("a.vtk", b"# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\n", "legacy VTK", "ParaView"),
    ("a.vti", b'<?xml version="1.0"?>\n<VTKFile type="ImageData" version="0.1">\n',
     "VTK XML (ImageData)", "ParaView"),
    ("a.vts", b'<VTKFile version="0.1" type="StructuredGrid">\n', "VTK XML (StructuredGrid)",
     "ParaView"),
    ("a.ex2", exodus(), "Exodus", "ParaView"),
    ("xyz.bin", struct.pack(">3I", 3, 2, 2) + bytes(12 * 12), "PLOT3D", "ParaView"),
    ("a.mhd", b"ObjectType = Image\nNDims = 3\n", "MetaImage", "3D Slicer"),
    ("a.npy", npy(ARRAY), "NumPy array of 10 x 12 x 14",
     "--size 14,12,10 --type float --endian little --offset 128"),
    ("b.npy", npy(numpy.asfortranarray(ARRAY.astype(">i2"))), "NumPy array of 10 x 12 x 14",
     "--size 10,12,14 --type int16 --endian big --offset 128"),
    ("c.npy", npy(ARRAY[0]), "NumPy array", "numpy.load"),
    ("a.mrc", mrc(), "MRC or CCP4", "--size 14,12,10 --type float --endian little --offset 1024"),
    ("a.npz", archive(zipfile.ZipFile, "w"), "NumPy arrays (.npz)", "numpy.load"),
    ("a.zip", archive(zipfile.ZipFile, "w"), "ZIP archive", "unzip"),
    ("a.tar", archive(lambda f, m: tarfile.open(fileobj=f, mode=m), "w:"), "tar archive", "tar -xf"),
    ("a.7z", b"7z\xbc\xaf\x27\x1c\0\4" + bytes(20), "7z archive", "7z x"),
    ("a.xz", b"\xfd7zXZ\0\0\4" + bytes(20), "xz", "xz -dc"),
    ("v5.mat", b"MATLAB 5.0 MAT-file, Platform: GLNXA64".ljust(128) + bytes(20), "v5", "scipy.io"),
    ("v7.mat", b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(512) + b"\x89HDF\r\n\x1a\n" +
     bytes(20), "v7.3", "h5dump"),
    ("a.hdr", analyze(), "Analyze 7.5", "nibabel"),
    ("b.hdr", b"#?RADIANCE\n" + bytes(400), "Radiance", "not a volume"),
    ("a.fits", b"SIMPLE  =                    T".ljust(2880), "FITS", "astropy"),
    ("a.grb", b"GRIB" + bytes(40), "GRIB", "cdo"),
    ("a.pdf", b"%PDF-1.4\n%\xe2\xe3", "PDF", "not a volume"),
    ("a.mp4", b"\0\0\0\x18ftypmp42" + bytes(40), "video", "ffmpeg"),
    ("a.jpg", b"\xff\xd8\xff\xe0" + bytes(40), "JPEG", "convert"),
    ("a.csv", b"u,v,w\n1,2,3\n4,5,6\n7,8,9\n", "table of numbers", "NRRD"),
    ("a.txt", b"hello\n" * 9, "is text", "not a volume"),
    ("b.txt", b"{" + b"hello " * 900, "is text", "not a volume"),
    ("program", b"\x7fELF" + bytes(60), "a program", "not a volume"),
]

# Gaussian scenes that are cut short or lack a part.
DAMAGED_SCENES = [
    ("c.ply", ply(*VERTICES, *(f"property float {n}" for n in
                               ("f_dc_0", "opacity", "scale_0", "scale_1", "scale_2", "rot_0")))),
    ("d.ply", ply("element chunk 1", "property float min_x", "element vertex 3",
                  "property uint packed_position")),
    ("a.spz", gzip.compress(b"NGSP" + bytes(60))),
    ("b.spz", b"NGSP\4\0\0\0" + bytes(60)),
    ("a.sog", archive(zipfile.ZipFile, "w")),
    ("meta.json", b'{"means": {"files": ["a.webp"]}, "scales": [' + b"1, " * 2000),
    ("a.glb", b'glTF\2\0\0\0' + bytes(12) + b'{"extensionsUsed": ["KHR_gaussian_splatting"]}'),
    ("a.gltf", b'{"extensionsUsed": ["KHR_gaussian_splatting"]}'),
    ("a.ksplat", bytes([0, 1]) + bytes(5000)),
]

OWN = [
    ("path.json", json.dumps(PATH).encode(), "a camera path", "--path", "2 key frames, 2 seconds, 21 f"),
    ("a.tf", b"0 0 0 0 0\n5 1 1 1 1\n", "a transfer function", "tf show", "2 points from 0 to 5"),
    ("events.txt", b"# go\nmove 3 4\npress left\nrelease left\nwait\n", "a script", "--script",
     "4 events"),
    ("view.json", b'{"triptych_view": 2, "data": "x"}', "a view that", "triptych view", ""),
]


class OtherFiles(program.ProgramTest):
    def test_each_file_gets_a_line_that_says_what_reads_it(self):
        for name, data, *says in FILES:
            program.write(name, data)
            line = self.fails(1, "info", name, says=says[0]).stderr
            self.assertTrue(line.startswith(f"triptych: read: {name}: "), line)
            self.assertIn(says[1], line)
            os.remove(name)

    def test_every_command_prints_the_line(self):
        program.write("a.off", b"OFF\n3 1 0\n")
        program.write("path.json", json.dumps(PATH).encode())
        for name, says in (("a.off", "a mesh (OFF)"), ("path.json", "--path")):
            for command in ("render", name, "-o", "a.png"), ("brick", name, "-o", "a.trip"), \
                           ("view", name), ("serve", name):
                self.leaves_nothing(1, *command, says=says)

    def test_damaged_clouds_are_refused_with_their_names(self):
        for name, data in (("a.las", b"LASF" + bytes(300)), ("a.e57", b"ASTM-E57" + bytes(300)),
                           ("a.pcd", b"# .PCD v.7\nVERSION .7\nFIELDS x y z\n"),
                           ("a.ply", ply(*VERTICES))):
            program.write(name, data)
            for command in ("render", name, "-o", "a.png"), ("brick", name, "-o", "a.trip"):
                self.leaves_nothing(1, *command, says=f"triptych: read: {name}: ")

    def test_info_describes_a_cloud_of_points(self):
        rows = ply(*VERTICES) + b"2 0 0.001\n636000.125 850000.5 -1\n"
        faces = ply(*VERTICES, "element face 1", "property list uchar int vertex_indices") + \
            b"2 0 0.001\n636000.125 850000.5 -1\n3 0 1 2\n"
        for name, data in (("a.ply", rows), ("a.ply.gz", gzip.compress(rows)),
                           ("a.ply.bz2", bz2.compress(rows)), ("no-suffix", rows), ("m.ply", faces)):
            program.write(name, data)
            done = json.loads(self.works("info", name, "--json").stdout)
            self.assertEqual(done["points"], 3)
            self.assertEqual(done["bounds"], [[0, 0, -1], [636000.125, 850000.5, 0.001]])
            text = self.works("info", name).stdout.decode()
            for line in (f"cloud        {name}", "format       PLY, text", "points       3",
                         "attributes   positions only",
                         "bounds       x 0 to 636000.125, y 0 to 850000.5, z -1 to 0.001"):
                self.assertIn(line + "\n", text)
            self.assertEqual("faces are ignored" in text, name == "m.ply")
            os.remove(name)
        program.write("a.ply", rows)
        self.fails(2, "info", "a.ply", "--spacing", "1,1,1", says="cloud of points")

    def test_damaged_gaussian_scenes_are_refused_with_their_names(self):
        for name, data in DAMAGED_SCENES:
            program.write(name, data)
            for command in ("render", name, "-o", "a.png"), ("brick", name, "-o", "a.trip"):
                self.leaves_nothing(1, *command, says=f"triptych: read: {name}: ")

    def test_info_describes_a_gaussian_scene(self):
        program.write("a.splat", struct.pack("<6f8B", 1, 2, 3, 0.1, 0.2, 0.3, *range(8)) +
                      struct.pack("<6f8B", -1, 2, 9, 0.1, 0.2, 0.3, *range(8)) +
                      struct.pack("<6f8B", float("nan"), 2, 9, 0.1, 0.2, 0.3, *range(8)))
        done = self.works("info", "a.splat", "--json")
        self.assertIn("1 of 3 Gaussians hold a value that is not finite", done.stderr)
        self.assertEqual(json.loads(done.stdout), {
            "kind": "Gaussian scene", "format": ".splat", "gaussians": 2, "left_out": 1, "degree": 0,
            "antialiased": False, "flat": False, "up": "-y", "trainer": "",
            "bounds": [[-1, 2, 3], [1, 2, 9]]})
        text = self.works("info", "a.splat").stdout.decode()
        for line in ("scene        a.splat", "Gaussians    2", "left out     1",
                     "centres      x -1 to 1, y 2 to 2, z 3 to 9", "up           -y"):
            self.assertIn(line + "\n", text)
        self.fails(2, "info", "a.splat", "--spacing", "1,1,1", says="Gaussian scene")

    def test_the_options_for_raw_data_read_the_file(self):
        for name, data in ("a.npy", npy(ARRAY)), ("a.mrc", mrc()):
            program.write(name, data)
            line = self.fails(1, "info", name).stderr
            options = line[line.index("--size"):line.rindex("`")].split()
            info = self.brick(name, "a.trip", *options)
            self.assertEqual(info["dims"], [14, 12, 10], name)
            self.assertEqual((info["value_min"], info["value_max"]), (0, ARRAY.max()), name)

    def test_folders_of_other_programs(self):
        for folder, file, says in ("a.zarr", ".zgroup", "Zarr"), ("case", "system/controlDict", "OpenFOAM"):
            os.makedirs(os.path.dirname(os.path.join(folder, file)))
            program.write(os.path.join(folder, file), b"{}")
            self.fails(1, "info", folder, says=says)

    def test_files_that_options_read_are_described(self):
        for name, data, what, reader, contents in OWN:
            program.write(name, data)
            text = self.works("info", name).stdout.decode()
            for says in what, reader, contents:
                self.assertIn(says, text, name)
            made = json.loads(self.works("info", "--json", name).stdout)
            self.assertIn(what, made["about"])
        program.write("bad.tf", b"0 0 0\n")
        self.fails(1, "info", "bad.tf", says="line 1")

    def test_a_single_picture_is_drawn_with_a_note(self):
        program.write_png("one.png", program.noise((1, 20, 30))[0])
        text = self.works("info", "one.png").stdout.decode()
        self.assertIn("a single picture, drawn as one slice", text)


class LookAtValues(program.ProgramTest):
    def described(self, *arguments):
        return json.loads(self.works("info", "--json", *arguments).stdout)

    def test_the_range_the_type_and_the_command_are_printed(self):
        values = ARRAY.copy()
        values[2, 3, 4] = 1e6
        program.write_nrrd("v.nrrd", values)
        made = self.described("v.nrrd")
        self.assertEqual((made["value_min"], made["value_max"]), (0, 1e6))
        self.assertEqual((made["typical_min"], made["typical_max"]), (0, ARRAY.max()))
        self.assertEqual((made["share_read"], made["value_bytes"]), (1, ARRAY.nbytes))
        self.assertEqual(made["orientation"], "values")
        text = self.works("info", "v.nrrd").stdout.decode()
        self.assertIn("to draw it   triptych render v.nrrd -o NAME.png\n", text)

    def test_a_huge_volume_is_described_at_once(self):
        for size in (4096, 4096, 65536), (32768, 32768, 1024):
            name = "huge_{}x{}x{}_uint8.raw".format(*size)
            with open(name, "wb") as f:
                f.truncate(size[0] * size[1] * size[2])
            made = self.described(name) if not program.SANITIZED else {}
            self.assertEqual(made.get("dims", list(size)), list(size))
            self.assertLess(made.get("share_read", 0), 0.1)
            os.remove(name)

    def test_faults_of_the_values_are_printed_beside_the_header(self):
        program.write_nrrd("v.nrrd", program.noise((10, 12, 14)).astype("f4"), encoding="gzip")
        os.truncate("v.nrrd", os.path.getsize("v.nrrd") - 500)
        run = self.works("info", "v.nrrd")
        self.assertTrue(program.LINE.fullmatch(run.stderr), run.stderr)
        self.assertIn(b"14 x 12 x 10 voxels, float", run.stdout)


if __name__ == "__main__":
    program.main()
