"""Tests that one phantom, acquired in several ways and stored in several formats, gives the same
picture. Left, right, front and head are where radiologists expect them.

The phantom is a function of the position in the patient, in millimetres to the left, the back and
the head. It has a body, a nose in front, a marker at the left and a marker at the head. It has no
symmetry."""
import itertools
import os
import shutil

import numpy

import program

NOSE, LEFT, HEAD = (0, -24, 6), (24, 0, -10), (-6, 4, 34)
SIZES = {NOSE: 6, LEFT: 7, HEAD: 5}
TO_RAS, TO_LAS = numpy.diag([-1.0, -1, 1, 1]), numpy.diag([1.0, -1, 1, 1])
SHOWS_MARKERS = b"values data\n119 1 1 1 0\n120 1 1 1 0.5\n200 1 1 1 0.9\n"
SHOWS_ALL = b"values data\n20 0.9 0.6 0.4 0\n60 0.9 0.6 0.4 0.3\n100 0.9 0.6 0.4 0.3\n200 1 1 1 0.9\n"


def phantom(p):
    """Returns the values: 80 in the body, 200 in the markers, with soft edges."""

    def inside(distance, value):
        return value * numpy.clip(0.5 - distance / 4, 0, 1)

    axes = numpy.array([22.0, 18, 28])
    stretched = numpy.linalg.norm(p / axes, axis=-1)
    value = inside((stretched - 1) * 22, 80)
    for centre, radius in SIZES.items():
        value = numpy.maximum(value, inside(numpy.linalg.norm(p - centre, axis=-1) - radius, 200))
    return numpy.rint(value).astype("u2")


def turned(degrees, axis):
    """Returns the rotation about an axis, by Rodrigues' formula."""
    a, (x, y, z) = numpy.radians(degrees), axis / numpy.linalg.norm(axis)
    k = numpy.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return numpy.eye(3) + numpy.sin(a) * k + (1 - numpy.cos(a)) * k @ k


def acquisition(i, j, k, half=44, middle=(3, -5, 7), place=(0, 0, 0)):
    """Returns the affine from (i, j, k) to the patient, and the values. `i`, `j` and `k` are the
    steps from voxel to voxel. The values fill a box of 2 * half across, centred at `middle` of the
    phantom. The phantom is moved to `place`."""
    steps = numpy.array([i, j, k], float).T
    sizes = [2 * int(half / n) + 1 for n in numpy.linalg.norm(steps, axis=0)]
    affine = numpy.eye(4)
    affine[:3, :3] = steps
    corner = middle - steps @ ((numpy.array(sizes) - 1) / 2)
    index = numpy.stack(numpy.meshgrid(*map(numpy.arange, sizes), indexing="ij"), axis=-1)
    values = phantom(index @ steps.T + corner).transpose(2, 1, 0)
    affine[:3, 3] = corner + place
    return affine, numpy.ascontiguousarray(values)


OBLIQUE = 2 * turned(25, (1, 0.3, 0)) @ turned(15, (0, 0, 1))
TILT = numpy.radians(20)
# Steps along i, j and k, and the ends of the body that they point to, written by hand.
ACQUISITIONS = {
    "axial": ((2, 0, 0), (0, 2, 0), (0, 0, 2), ["L", "P", "S"]),
    "coronal": ((2, 0, 0), (0, 0, -2), (0, 2, 0), ["L", "I", "P"]),
    "sagittal": ((0, 2, 0), (0, 0, -2), (-2, 0, 0), ["P", "I", "R"]),
    "oblique": (*OBLIQUE.T, ["LPI", "PSR", "SAL"]),
    "gantry tilt": (
        (2, 0, 0),
        (0, 2 * numpy.cos(TILT), 2 * numpy.sin(TILT)),
        (0, 0, 2),
        ["L", "PS", "S"],
    ),
    "mirrored": ((-2, 0, 0), (0, 2, 0), (0, 0, 2), ["R", "P", "S"]),  # no scanner makes such files
}


def nrrd_geometry(space, affine):
    vector = lambda v: "(" + ",".join(repr(float(x)) for x in v) + ")"
    directions = " ".join(vector(affine[:3, a]) for a in range(3))
    return f"space: {space}\nspace directions: {directions}\nspace origin: {vector(affine[:3, 3])}"


def write_series(folder, affine, values):
    """Writes one file for each slice. The order of the names is not the order of the slices."""
    os.makedirs(folder, exist_ok=True)
    spacing = numpy.linalg.norm(affine[:3, :3], axis=0)
    rows = (affine[:3, :2] / spacing[:2]).T.ravel()
    for k, image in enumerate(values):
        place = affine[:3, 3] + k * affine[:3, 2]
        name = os.path.join(folder, f"{k * 7 % len(values):03d}.dcm")
        program.write_dicom(name, image, k, spacing, place, rows)


def write_frames(path, affine, values):
    """Writes all slices into one file, in mixed order."""
    spacing = numpy.linalg.norm(affine[:3, :3], axis=0)
    rows = (affine[:3, :2] / spacing[:2]).T.ravel()
    order = [k * 7 % len(values) for k in range(len(values))]
    places = [affine[:3, 3] + k * affine[:3, 2] for k in order]
    program.write_dicom(path, values[order], 0, spacing, places[0], rows, places)


class Camera:
    """A view of the patient from the front, the left and above, computed in the test. The rows of
    `to_patient` are the axes of the world in the patient. options() returns the options for this
    world."""

    SIZE, FOV = 128, 30
    EYE, LOOK, UP = (75, -180, 70), (0, 0, 4), (0, 0, 1)

    def __init__(self):
        self.scale = 0.5 * self.SIZE / numpy.tan(numpy.radians(self.FOV / 2))
        self.forward = numpy.subtract(self.LOOK, self.EYE)
        self.forward = self.forward / numpy.linalg.norm(self.forward)
        self.right = numpy.cross(self.forward, self.UP)
        self.right /= numpy.linalg.norm(self.right)
        self.up = numpy.cross(self.right, self.forward)

    def project(self, p):
        """Returns a pixel position, with x to the right and y down."""
        way = numpy.subtract(p, self.EYE)
        depth = way @ self.forward
        x, y = way @ self.right / depth, way @ self.up / depth
        return numpy.array([self.SIZE / 2 + self.scale * x, self.SIZE / 2 - self.scale * y])

    def options(self, to_patient):
        point = lambda p: ",".join(repr(float(v)) for v in to_patient.T @ numpy.array(p))
        size = f"{self.SIZE}x{self.SIZE}"
        return ["--size", size, "--fov", self.FOV, "--up", point(self.UP)] + [
            f"--{name}={point(p)}" for name, p in (("eye", self.EYE), ("look", self.LOOK))
        ]


def blobs(alpha):
    """Returns the centres (x, y) of connected visible regions, from left to right."""
    left = {(int(y), int(x)) for y, x in zip(*numpy.nonzero(alpha > 0.3))}
    middles = []
    while left:
        edge, piece = [left.pop()], []
        while edge:
            y, x = edge.pop()
            piece.append((x, y))
            near = {(y + a, x + b) for a in (-1, 0, 1) for b in (-1, 0, 1)} & left
            left -= near
            edge += near
        middles.append(tuple(numpy.mean(piece, axis=0)))
    return sorted(middles)


class Orientation(program.ProgramTest):
    default = None

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        program.write("all.tf", SHOWS_ALL)
        program.write("markers.tf", SHOWS_MARKERS)

    def brick(self, source, *options):
        """Returns the output of `info --json`."""
        self.works("brick", source, "-o", "a.trip", "-q", "--force", "--tf", "all.tf", *options)
        return self.info("a.trip")

    def alike(self, picture, other, about, most, mean):
        difference = abs(picture - other)
        self.assertLess(difference.max(), most, about)
        self.assertLess(difference.mean(), mean, about)

    def check_box(self, info, affine, values, about):
        """Checks the world box of the grid: the patient's, with x to the right and y to the front.
        """
        ends = [(-0.5, n - 0.5) for n in values.shape[::-1]]
        corners = numpy.array([[*p, 1] for p in itertools.product(*ends)]) @ (TO_RAS @ affine)[:3].T
        box = [corners.min(axis=0), corners.max(axis=0)]
        numpy.testing.assert_allclose(info["bounds"], box, atol=1e-4, err_msg=about)

    def check_default_view(self, about):
        """Checks the default view, which is a little from the patient's left. Radiologists expect
        the patient's left on the right and lowest, the head at the top, and the nose on the
        left."""
        picture = self.picture("a.trip", "--size=96x96", "--tf=markers.tf", "--no-shading")
        seen = blobs(picture[..., 3])
        self.assertEqual(len(seen), 3, about)
        nose, head, left = seen
        self.assertLess(nose[0] + 4, head[0], about)
        self.assertLess(head[0] + 10, left[0], about)
        self.assertLess(head[1] + 15, nose[1], about)
        self.assertLess(nose[1] + 4, left[1], about)

    def check_same_default(self, about):
        """Compares the default view with the one of the first acquisition. The bound is loose,
        because each acquisition frames other voxels."""
        picture = self.picture("a.trip", "--size=96x96")
        if self.default is None:
            type(self).default = picture
            self.assertGreater(abs(picture - picture[:, ::-1]).mean(), 0.05)  # the picture has no symmetry
        self.alike(picture, self.default, about, most=0.6, mean=0.02)

    def check_markers(self, camera, to_patient, about):
        """Checks that each marker is at its projected position, and that nothing else is
        visible."""
        options = "a.trip", "--tf", "markers.tf", "--no-shading", *camera.options(to_patient)
        alpha = self.picture(*options)[..., 3].astype(float)
        rows, columns = numpy.indices(alpha.shape)
        for marker in SIZES:
            x, y = camera.project(marker)
            near = numpy.hypot(columns + 0.5 - x, rows + 0.5 - y) < 15
            weight = alpha * near
            self.assertGreater(weight.sum(), 20, about)
            middle = [((a + 0.5) * weight).sum() / weight.sum() for a in (columns, rows)]
            self.assertLess(numpy.hypot(*(middle - numpy.array([x, y]))), 1, (about, marker))
            alpha[near] = 0
        self.assertLess(alpha.max(), 0.02, about)

    def sources(self, affine, values, scanner):
        """Yields the axes of world space in the patient, and the file."""
        ras = TO_RAS[:3, :3]
        for space, change in (
            ("left-posterior-superior", numpy.eye(4)),
            ("RAS", TO_RAS),
            ("left-anterior-superior", TO_LAS),
        ):
            geometry = nrrd_geometry(space, change @ affine)
            program.write_nrrd("a.nrrd", values, geometry=geometry)
            yield ras, "a.nrrd"
        program.write_nifti("a.nii", values, TO_RAS @ affine)
        yield ras, "a.nii"
        if scanner:
            write_series(f"{scanner}", affine, values)
            yield ras, scanner
        if scanner == "gantry-tilt":
            write_frames("frames.dcm", affine, values)
            yield ras, "frames.dcm"

    def check_acquisition(self, name, scanner, first):
        """Checks every format of an acquisition, also against the picture `first` of another
        acquisition. Returns a picture of this acquisition."""
        affine, values = acquisition(*ACQUISITIONS[name][:3])
        camera, own = Camera(), None
        for to_patient, source in self.sources(affine, values, scanner):
            about = f"{name}, {source}"
            info = self.brick(source)
            self.assertEqual((info["space"], info["axes"]), ("RAS", ACQUISITIONS[name][3]), about)
            self.assertEqual(info["orientation"], "space", about)
            self.check_box(info, affine, values, about)
            picture = self.picture("a.trip", *camera.options(to_patient))
            if own is None:
                own = picture
                self.check_markers(camera, to_patient, about)
                self.check_same_default(about)
            self.check_default_view(about)
            # All formats have the same grid. Only the rounding of gradients along other axes
            # differs.
            self.alike(picture, own, about, most=0.005, mean=1e-4)
            # Another acquisition samples other positions, so that edges differ a little.
            self.alike(picture, own if first is None else first, about, most=0.5, mean=0.005)
        return own

    def test_every_acquisition_and_format_gives_the_same_picture(self):
        first = None
        for name in ACQUISITIONS:
            scanner = None if name == "mirrored" else name.replace(" ", "-")
            own = self.check_acquisition(name, scanner, first)
            first = own if first is None else first

    def test_every_renderer_draws_mirrored_and_sheared_grids(self):
        for name in "mirrored", "gantry tilt":
            affine, values = acquisition(*ACQUISITIONS[name][:3])
            program.write_nifti("a.nii", values, TO_RAS @ affine)
            self.brick("a.nii")
            for classify, most, mean in ("pre", 1, 0.05), ("post", 2, 0.1):
                options = f"--classify={classify}", *Camera().options(TO_RAS[:3, :3])
                expected = self.picture("a.trip", "--renderer=reference", *options)
                for renderer in "cpu", *program.GL:
                    given = f"--renderer={renderer}", *options
                    drawn = self.picture("a.trip", *given)
                    about = name, renderer, classify
                    self.alike(drawn, expected, about, most=most / 255, mean=mean / 255)

    def test_thick_slices_at_the_origin_keep_their_orientation(self):
        """The map is then diagonal, like the map of a file without orientation."""
        steps = (2, 0, 0), (0, 2, 0), (0, 0, 5)
        corner, _ = acquisition(*steps)
        affine, values = acquisition(*steps, place=-corner[:3, 3])
        self.assertTrue(numpy.array_equal(affine, numpy.diag([2, 2, 5, 1])))
        for _, source in self.sources(affine, values, "thick"):
            self.brick(source)
            self.check_default_view(source)

    def test_given_axes_equal_axes_in_the_file(self):
        given = {"axial": "LPS", "coronal": "LIP", "sagittal": "PIR", "mirrored": "RPS"}
        for name, letters in given.items():
            affine, values = acquisition(*ACQUISITIONS[name][:3])
            affine[:3, 3] = 0  # like a file without orientation
            program.write_nrrd("said.nrrd", values, geometry=nrrd_geometry("LPS", affine))
            program.write_nrrd("silent.nrrd", values, (2, 2, 2))
            program.write_nifti("said.nii", values, TO_RAS @ affine)
            said = self.brick("said.nrrd")
            expected = self.picture("a.trip", "--size=96x96")
            silent = self.brick("silent.nrrd", "--axes", letters)
            for key in "space", "axes", "index_to_world":
                self.assertEqual(silent[key], said[key], name)
            self.assertIn(f"--axes={letters}", silent["source"]["source_options"])
            self.check_default_view(name)
            picture = self.picture("a.trip", "--size=96x96")
            self.assertTrue(numpy.array_equal(picture, expected), name)
            self.brick("said.nii")
            self.alike(picture, self.picture("a.trip", "--size=96x96"), name, most=0.01, mean=5e-4)
        slices = program.noise((9, 10, 11)).astype("u2")
        os.makedirs("slices", exist_ok=True)
        for z, image in enumerate(slices):
            program.write_dicom(f"slices/{z}.dcm", image, z)
        for axes, source in ("PIR", "said.nrrd"), ("LIP", "said.nii"), ("LPS", "slices"):
            command = "brick", source, "-o", "b.trip", "-q", "--axes", axes
            self.fails(2, *command, says="gives its orientation in the patient")
        turned = "space dimension: 3\nspace directions: (0,1,0) (1,0,0) (0,0,1)"
        program.write_nrrd("turned.nrrd", slices, geometry=turned)
        command = "brick", "turned.nrrd", "-o", "b.trip", "--axes", "PIR"
        self.fails(2, *command, says="gives the directions of its axes")

    def test_axes_apply_to_volumes_drawn_directly(self):
        """--axes is also part of the key in the cache."""
        affine, values = acquisition(*ACQUISITIONS["sagittal"][:3])
        affine[:3, 3] = 0
        program.write_nrrd("silent.nrrd", values, (2, 2, 2))
        program.write_nrrd("said.nrrd", values, geometry=nrrd_geometry("LPS", affine))
        size = "--size=64x64"
        other = self.picture("silent.nrrd", size)
        own = self.picture("silent.nrrd", size, "--axes=PIR")
        self.assertTrue(numpy.array_equal(own, self.picture("said.nrrd", size)))
        self.assertGreater(abs(own - other).mean(), 0.02)

    def test_symmetric_objects_are_upright_and_sides_have_no_names(self):
        """The object has equal left and right halves, in slices from ear to ear of a file without
        orientation. The same file with directions gives the same picture."""
        steps = (0, 2, 0), (0, 0, -2), (-2, 0, 0)
        affine, _ = acquisition(*steps)
        index = numpy.stack(numpy.meshgrid(*[numpy.arange(45)] * 3, indexing="ij"), axis=-1)
        side, back, up = numpy.moveaxis(index @ affine[:3, :3].T + affine[:3, 3], -1, 0)
        wedge = (abs(side) < 15) & (back < 24) & (up > -24) & (up - back < 8)
        values = numpy.where(wedge, 200, 10).astype("u2").transpose(2, 1, 0)
        affine[:3, 3] = 0
        program.write_nrrd("said.nrrd", values, geometry=nrrd_geometry("LPS", affine))
        program.write_nrrd("silent.nrrd", values, (2, 2, 2))
        self.brick("said.nrrd")
        expected = self.picture("a.trip", "--size=96x96")
        self.works("brick", "silent.nrrd", "-o", "a.trip", "-q", "--force", "--tf", "all.tf")
        info = self.info("a.trip")
        self.assertEqual(info["source"]["mirror"], "z")
        self.assertNotIn("axes", info)
        self.assertNotIn("space", info["source"])
        text = self.works("info", "a.trip").stdout.decode()
        self.assertIn("mirror-symmetric across z", text)
        self.assertIn("orientation  guessed from the mirror symmetry\n", text)
        for end in "left", "right", "anterior", "superior":
            self.assertNotIn(f"to {end}", text)
        self.alike(self.picture("a.trip", "--size=96x96"), expected, "wedge", most=0.01, mean=5e-4)
        # An explicit --up wins over the guess, even if it is 0,0,1.
        upright = self.picture("a.trip", "--size=96x96", "--up=0,0,1")
        self.assertGreater(abs(upright - expected).mean(), 0.02)
        run = self.works("render", "silent.nrrd", "-o", "b.png", "--size=32x32", "--tf", "all.tf")
        self.assertIn("--up, --view and --axes say otherwise", run.stderr)
        run = self.works("render", "said.nrrd", "-o", "b.png", "--size=32x32", "--tf", "all.tf")
        self.assertNotIn("symmetric", run.stderr)

    def test_the_program_that_wrote_an_openvdb_file_decides_what_is_up(self):
        """The smoke in densityAndHeat.vdb, whose file names no program, rises along z: it was looked
        at. The cloud is by Houdini, where y is up."""
        sources = {}
        for name in "densityAndHeat", "wdas_cloud_sixteenth":
            path = os.path.join(program.DATASETS, f"{name}.vdb")
            run = self.works("brick", path, "-o", "a.trip", "--force")
            source = self.info("a.trip")["source"]
            sources[name] = source["orientation"], source["up"], "--axes" in run.stderr
            program.write("fog.tf", b"values normalised\n0 1 1 1 0\n1 1 1 1 1\n")
            view = "--size=64x64", "--view=front", "--tf=fog.tf"
            up = "--up=0,0,1" if source["up"] == "+z" else "--up=0,1,0"
            self.assertTrue(numpy.array_equal(self.picture("a.trip", *view),
                                              self.picture("a.trip", *view, up)))
        self.assertEqual(sources["densityAndHeat"], ("length", "+z", True))
        self.assertEqual(sources["wdas_cloud_sixteenth"], ("program", "+y", False))
        path = os.path.join(program.DATASETS, "densityAndHeat.vdb")
        self.assertNotIn("what is up", self.works("brick", path, "-o", "a.trip", "--force",
                                                  "--axes", "RAS").stderr)
        self.assertEqual(self.info("a.trip")["orientation"], "axes")

    def bright_from_middle(self, name):
        """Returns the offset in pixels from the centre of tests/regress/NAME to the centre of its
        bright part."""
        program.write("red.tf", b"values data\n49 0 0 1 0\n50 0 0 1 1\n200 0 0 1 1\n200 1 0 0 1\n")
        source = os.path.join(program.DATASETS, "..", "tests", "regress", name)
        self.works("brick", source, "-o", "a.trip", "-q", "--force", "--tf", "red.tf")
        # `pre` draws voxels. Interpolated values would be blue and hide the red ones.
        picture = self.picture("a.trip", "--size=96x96", "--no-shading", "--classify=pre")
        (whole,) = blobs(picture[..., 3])
        (bright,) = blobs(picture[..., 0])
        return numpy.subtract(bright, whole)

    def test_files_once_drawn_with_a_wrong_orientation(self):
        across, down = self.bright_from_middle("thick_slices_lps.nrrd")  # the head is bright
        self.assertLess(down, -15)
        across, down = self.bright_from_middle("space_ras.nrrd")  # the front at the left is bright
        self.assertGreater(across, 8)

    def test_a_missing_frame_is_refused_unless_allowed(self):
        """The file has frames at 0, 2, 4, 8, 10 and 12. With the gap allowed, they stay there."""
        values = program.noise((6, 8, 8)).astype("u2")
        places = [(0, 0, z) for z in (0, 2, 4, 8, 10, 12)]
        program.write_dicom("gap.dcm", values, 0, (1, 1, 2), places[0], frames=places)
        self.fails(1, "brick", "gap.dcm", "-o", "g.trip", "-q", says="frame 3: a slice is missing")
        run = self.works("brick", "gap.dcm", "-o", "g.trip", "-q", "--force", "--allow-gaps")
        self.assertIn("frame 3: a slice is missing", run.stderr)
        info = self.info("g.trip")
        self.assertAlmostEqual(info["spacing_min"][2], 2)
        self.assertAlmostEqual(info["spacing_max"][2], 4)
        even = [(0, 0, 2 * z) for z in range(6)]
        program.write_dicom("even.dcm", values, 0, (1, 1, 2), even[0], frames=even)
        self.assertEqual(
            self.works("brick", "even.dcm", "-o", "e.trip", "-q", "--allow-gaps").stderr, ""
        )

    def test_the_dicom_modality_selects_the_kind(self):
        values = program.noise((8, 16, 16), "u2") % 2000
        for modality, inter, kind in (
            ("MR", 0, "mr"),
            ("CT", -1024, "ct"),
            ("CT", 0, "simulation"),
            ("", -1024, "simulation"),
            ("PT", 0, "simulation"),
            ("ct\x1b[2J", -1024, "simulation"),
        ):
            shutil.rmtree("scan", ignore_errors=True)
            os.makedirs("scan")
            for z, image in enumerate(values):
                program.write_dicom(f"scan/{z}.dcm", image, z, modality=modality, inter=inter)
            self.works("brick", "scan", "-o", "s.trip", "-q", "--force")
            source = self.info("s.trip")["source"]
            self.assertEqual(source["function_kind"], kind, (modality, inter))

    def test_info_prints_the_directions_of_the_axes_in_words(self):
        affine, values = acquisition(*ACQUISITIONS["gantry tilt"][:3])
        program.write_nrrd("a.nrrd", values, geometry=nrrd_geometry("LPS", affine))
        self.brick("a.nrrd")
        words = self.works("info", "a.trip").stdout.decode()
        self.assertIn("space        RAS: x to right, y to anterior, z to superior\n", words)
        self.assertIn("orientation  from the space of the patient in the file\n", words)
        self.assertIn("i points to  left\n", words)
        self.assertIn("j points to  posterior, 20 degrees to superior\n", words)
        self.assertIn("k points to  superior\n", words)

    def test_bounds_of_uneven_grids_enclose_the_voxels(self):
        program.write_nrrd("u.nrrd", program.noise((4, 4, 4)))
        program.write("x.txt", b"0 1 2 6")
        program.write("y.txt", b"0 1 2 3")
        self.brick("u.nrrd", "--keep-all", "--coordinates", "x.txt,y.txt,y.txt")
        info = self.info("a.trip")
        for end, bounds in enumerate(([-0.5, -0.5, -0.5], [8, 3.5, 3.5])):
            numpy.testing.assert_allclose(info["bounds"][end], bounds, atol=1e-6)
            numpy.testing.assert_allclose(info["kept_bounds"][end], bounds, atol=1e-6)

    def test_info_prints_the_bounds_of_the_grid_and_the_kept_voxels(self):
        values = numpy.zeros((6, 7, 8), "u1")
        values[2:5, 1:3, 4:8] = 9
        affine = numpy.array([[0, -2.0, 0, 10], [3, 0, 0, 20], [0, 0, 0.5, -30], [0, 0, 0, 1]])
        program.write_nifti("a.nii", values, affine)
        self.brick("a.nii", "--range=5:10")
        info = self.info("a.trip")
        # i is y times 3, j is -x times 2, k is z times 1/2. Bounds add half a voxel on each side.
        self.assertEqual(info["bounds"], [[-3, 18.5, -30.25], [11, 42.5, -27.25]])
        self.assertEqual(info["kept_bounds"], [[5, 30.5, -29.25], [9, 42.5, -27.75]])

    def test_a_file_without_a_patient_has_no_anatomical_space(self):
        values = program.noise((8, 9, 10))
        for geometry in "spacings: 1 1 1", "space: 3D-right-handed\nspacings: 1 1 1":
            program.write_nrrd("plain.nrrd", values, geometry=geometry)
            self.works("brick", "plain.nrrd", "-o", "a.trip", "-q", "--force")
            self.assertNotIn("space", self.info("a.trip"))
            self.assertNotIn("axes", self.info("a.trip"))


if __name__ == "__main__":
    program.main()
