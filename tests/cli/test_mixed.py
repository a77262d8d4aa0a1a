"""Tests of volumes beside Gaussian scenes in one picture. The expected pictures are closed forms: even
fog has the transmittance (1 - o)^length, and tests/gaussians/definition.py draws each Gaussian alone."""
import json
import os
import sys

import numpy

import program
from test_gaussians import options_of, row, view_of, write_scene

sys.path.insert(0, os.path.join(os.environ["TRIP_SOURCE_DIR"], "tests", "gaussians"))
import definition  # noqa: E402

VOXELS, SCALE = 17, 0.5
HIGH = SCALE * (VOXELS - 1)  # values are interpolated between the outermost voxels: world z from 0 to 8
CLEAR = ("--background", "0,0,0,0", "--no-shading")
WHITE, GREEN, DENSE = (0.8, 0.8, 0.8, 0.1), (0.1, 0.7, 0.2, 0.05), (0.9, 0.5, 0.1, 0.3)


def write_fog(name, fog):
    """Writes a cube of fog: a colour, and its opacity over the length of a voxel."""
    values = 1 + numpy.indices((VOXELS,) * 3).sum(axis=0) % 2  # all in the even part of the function
    program.write_nrrd(name + ".nrrd", values.astype("u1"))
    entry = " ".join(map(str, fog))
    program.write(name + ".tf", f"0 {entry}\n3 {entry}\n".encode())


def write_objects(path, *objects):
    program.write(path, json.dumps({"objects": objects}).encode())


def fog_object(name, move=(-4, -4, 0), scale=SCALE, **more):
    return {"data": name + ".nrrd", "tf": name + ".tf", "translate": list(move), "scale": scale, **more}


def lengths(view, enter, leave):
    """Returns how far each ray goes between two heights z, in voxels. The view goes along -z."""
    width, height = view["size"]
    if view.get("ortho_height"):
        return numpy.full((height, width, 1), (enter - leave) / SCALE)
    tangent = numpy.tan(numpy.radians(view["fov"]) / 2) * 2 / height
    x = (numpy.arange(width) + 0.5 - width / 2)[None, :] * tangent
    y = (numpy.arange(height) + 0.5 - height / 2)[:, None] * tangent
    return (numpy.sqrt(1 + x * x + y * y) * (enter - leave) / SCALE)[:, :, None]


def over(front, back):
    return front + (1 - front[:, :, 3:]) * back


def fog_between(view, enter, leave, *fogs):
    """Returns the picture of fogs that fill the same place: optical depths and emitted light add up."""
    enter, leave = min(HIGH, enter), max(0, leave)
    length = lengths(view, enter, max(leave, 0)) if enter > leave else numpy.zeros((*view["size"][::-1], 1))
    depths = [-numpy.log(1 - fog[3]) for fog in fogs]
    colour = sum(d * numpy.array(fog[:3]) for d, fog in zip(depths, fogs)) / sum(depths)
    alpha = 1 - numpy.exp(-sum(depths) * length)
    return numpy.dstack([alpha * colour, alpha])


def expected(view, rows, *fogs):
    """Composites Gaussians, each drawn alone, and the fog between them from the top down."""
    picture = numpy.zeros((*view["size"][::-1], 4))
    at = 100
    for one in sorted(rows, key=lambda r: -r[2]):
        picture = over(picture, fog_between(view, at, one[2], *fogs))
        write_scene("one.ply", [one])
        picture = over(picture, definition.draw(definition.read_ply("one.ply"), view))
        at = one[2]
    return over(picture, fog_between(view, at, -100, *fogs))


def expected_distances(view, rows, fog):
    """Returns the mean distance of all that each pixel shows, weighted by its share of alpha. Even fog with the
    optical depth k for each unit of length has the mean 1 / k - L exp(-k L) / (1 - exp(-k L)) in a length L."""
    k = -numpy.log(1 - fog[3]) / SCALE
    stretch = lengths(view, SCALE, 0)[:, :, 0]
    seen, total, clear, at = 0, 0, 1, HIGH
    for one in [*sorted(rows, key=lambda r: -r[2]), None]:
        until = min(HIGH, max(0, one[2])) if one is not None else 0
        length = (at - until) * stretch
        alpha = 1 - numpy.exp(-k * length)
        inside = 1 / k - length * numpy.exp(-k * length) / numpy.maximum(alpha, 1e-30)
        seen = seen + clear * alpha
        total = total + clear * alpha * ((view["eye"][2] - at) * stretch + numpy.where(alpha > 0, inside, 0))
        clear = clear * (1 - alpha)
        at = until
        if one is not None:
            write_scene("one.ply", [one])
            alpha = definition.draw(definition.read_ply("one.ply"), view)[:, :, 3]
            seen = seen + clear * alpha
            total = total + clear * alpha * (view["eye"][2] - one[2]) * stretch
            clear = clear * (1 - alpha)
    return total / seen


SPLATS = [row((0.2, 0.1, 12), (1, 0, 0), 0.6, (0.5, 0.4, 0.3)),  # before the fog
          row((-0.3, 0.2, 6.1), (0, 1, 0), 0.9, (0.5, 0.6, 0.2)),  # inside it
          row((0.1, -0.4, 3.3), (0, 0, 1), 0.7, (0.9, 0.4, 0.5)),
          row((0, 0, -3), (1, 1, 0), 0.95, (1.5, 1, 0.1))]  # behind it
VIEWS = (view_of((0, 0, 30), (0, 0, 4), (0, 1, 0), (48, 32), 8),
         view_of((0, 0, 30), (0, 0, 4), (0, 1, 0), (48, 32), ortho_height=3))


class Mixed(program.ProgramTest):
    def assert_picture(self, wanted, *arguments):
        """Compares a picture, all of whose rays meet the fog, with the expected one, in 1/255. The data set
        rounds its numbers. So a few pixels with an alpha near 1/255 may count it or not."""
        apart = numpy.sort(255 * abs(self.picture(*arguments, *CLEAR) - wanted).max(axis=2).ravel())
        self.assertLess(apart[-1], 1, arguments)
        self.assertLess(apart[-5], 0.05, arguments)

    def test_gaussians_before_inside_and_behind_fog(self):
        write_fog("fog", WHITE)
        for number, rows in enumerate([SPLATS[:1], SPLATS[1:2], SPLATS[3:], SPLATS]):
            write_scene(f"splats{number}.ply", rows)
            write_objects("a.json", fog_object("fog"), {"data": f"splats{number}.ply"})
            for view in VIEWS:
                wanted = expected(view, rows, WHITE)
                for renderer in "cpu", "reference", "integral", *program.GL:
                    self.assert_picture(wanted, "a.json", *options_of(view), "--renderer", renderer)

    def test_distances_are_means_over_fog_and_gaussians(self):
        write_fog("fog", WHITE)
        write_scene("splats.ply", SPLATS)
        write_objects("a.json", fog_object("fog"), {"data": "splats.ply"})
        write_objects("b.json", fog_object("fog"))
        for view in VIEWS:
            for path, rows in ("a.json", SPLATS), ("b.json", []):
                wanted = expected_distances(view, rows, WHITE)
                for renderer in "cpu", "reference", *program.GL:
                    by = path, *options_of(view), "--renderer", renderer, *CLEAR
                    self.works("render", *by, "--depth", "z.exr", "-o", "far.exr")
                    drawn = program.read_exr_channels("z.exr")[1][..., 0]
                    apart = numpy.sort(abs(drawn - wanted).ravel())
                    self.assertLess(apart[-5], 0.02, (path, renderer, apart[-9:]))
                    self.assertTrue((program.read_exr("far.exr") == self.picture(*by)).all(), renderer)
        self.works("render", "a.json", "--eye=0,0,30", "--look=0,0,60", "--depth", "z.exr", "-o", "far.exr")
        self.assertTrue(numpy.isposinf(program.read_exr_channels("z.exr")[1]).all())

    def test_the_order_of_objects_does_not_matter(self):
        write_fog("fog", DENSE)
        write_scene("splats.ply", SPLATS)
        wanted = expected(VIEWS[0], SPLATS, DENSE)
        objects = fog_object("fog"), {"data": "splats.ply"}
        for path, order in ("a.json", objects), ("b.json", objects[::-1]):
            write_objects(path, *order)
            self.assert_picture(wanted, path, *options_of(VIEWS[0]))

    def test_fogs_in_the_same_place_add_up(self):
        write_fog("fog", WHITE)
        write_fog("green", GREEN)
        write_scene("splats.ply", SPLATS)
        write_objects("a.json", fog_object("fog"), {"data": "splats.ply"}, fog_object("green"))
        write_objects("b.json", fog_object("fog"), fog_object("green"))
        for view in VIEWS:
            self.assert_picture(expected(view, SPLATS, WHITE, GREEN), "a.json", *options_of(view))
            self.assert_picture(expected(view, [], WHITE, GREEN), "b.json", *options_of(view))

    def test_fog_in_front_hides_fog_behind(self):
        write_fog("fog", WHITE)
        write_fog("dense", DENSE)
        view = VIEWS[1]
        there = {"a": fog_object("dense"), "b": fog_object("fog", (-4, -4, 20))}
        wanted = over(fog_between(view, 100, -100, WHITE), fog_between(view, 100, -100, DENSE))
        for path, names in ("a.json", "ab"), ("b.json", "ba"):
            write_objects(path, *(there[name] for name in names))
            self.assert_picture(wanted, path, "--ortho=3", "--eye=0,0,60", "--look=0,0,4", "--up=0,1,0",
                                "--size=48x32")

    def test_a_turned_volume_meets_gaussians_where_it_stands(self):
        """A cube that is turned by a quarter about its middle fills the same place."""
        write_fog("fog", WHITE)
        write_scene("splats.ply", SPLATS)
        # (x, y, z) -> (x, -z, y): the cube from (-4, -4, 0) on needs the z of its y, and the y of its z
        write_objects("a.json", fog_object("fog", (-4, 4, 0), rotate={"axis": [1, 0, 0], "degrees": 90}),
                      {"data": "splats.ply"})
        self.assert_picture(expected(VIEWS[0], SPLATS, WHITE), "a.json", *options_of(VIEWS[0]))

    def test_place_does_what_a_scene_file_does(self):
        write_fog("fog", WHITE)
        write_scene("splats.ply", SPLATS)
        self.works("brick", "fog.nrrd", "--tf", "fog.tf", "-o", "fog.trip", "-q", "--force")
        by = "fog.trip", "splats.ply", "--tf", "fog.tf", *options_of(VIEWS[0])
        self.assert_picture(expected(VIEWS[0], SPLATS, WHITE), *by, "--place", "-4,-4,0,0.5")
        self.assert_picture(expected(VIEWS[0], SPLATS, WHITE), *by, "--place", "-4,-4,0,0.5;0,0,0")
        for bad in "1,2", "1,2,3,0", "1,2,3,-1", "x", "1,2,nan", "1,2,3;;4,5,6", "1,2,3,4,5":
            self.leaves_nothing(2, *("render", *by, "-o", "a.png"), "--place", bad, says="--place")

    def test_threads_do_not_change_a_bit(self):
        write_scene("splats.ply", SPLATS)
        program.write_nrrd("noise.nrrd", program.noise((24, 24, 24)))
        write_objects("a.json", {"data": "noise.nrrd", "translate": [-12, -12, 0]}, {"data": "splats.ply"})
        one = self.picture("a.json", "--size=64x64", "--threads", "1")
        for options in ("--threads", "2"), ("--threads", "5"):
            self.assertTrue((one == self.picture("a.json", "--size=64x64", *options)).all())

    def test_slabs_take_no_matter_from_the_light(self):
        """A volume beside a scene is drawn in slabs. Its shadows are those of the volume alone."""
        tooth = os.path.join(program.DATASETS, "tooth.nhdr")
        write_scene("far.ply", [row((-500, -500, -500))])
        write_objects("both.json", {"data": tooth}, {"data": "far.ply"})
        view = ("--size", "90x90", "--eye", "250,-340,220", "--look", "25,48,56", "--up", "0,0,1", "--fov", "30",
                "--background", "0,0,0,0")
        apart = [255 * abs(self.picture("both.json", *view, "--effects", effect) -
                           self.picture(tooth, *view, "--lod", "0", "--effects", effect)).mean()
                 for effect in ("none", "shadows", "occlusion")]
        self.assertLess(max(apart[1:]), 1.2 * apart[0])

    def test_settings_without_meaning_are_refused(self):
        write_fog("fog", WHITE)
        write_scene("splats.ply", SPLATS)
        write_objects("a.json", fog_object("fog"), {"data": "splats.ply"})
        for options in ("--order", "lists"), ("--lod", "1"), ("--show", "merge"):
            self.leaves_nothing(2, "render", "a.json", "-o", "a.png", *options,
                                says="does not apply to a picture with volumes beside other objects")
        for options in ("--error", "1"), ("--emission", "fog.trip", "--effects", "emission"):
            self.leaves_nothing(2, "render", "a.json", "-o", "a.png", *options,
                                says=f"{options[0]}: does not apply to several objects in one picture")
        for bad in {"tf": 3}, {"tf": ""}, {"tf": "missing.tf"}:
            write_objects("b.json", {**fog_object("fog"), **bad})
            self.assertNotEqual(program.call("render", "b.json", "-o", "a.png").returncode, 0)
        write_objects("b.json", {"data": "splats.ply", "tf": "fog.tf"})
        self.leaves_nothing(2, "render", "b.json", "-o", "a.png", says="leave out tf")
        mirror = [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]
        write_objects("b.json", {"data": "fog.nrrd", "matrix": mirror})
        self.leaves_nothing(2, "render", "b.json", "-o", "a.png", says="without mirroring")

    def test_one_volume_has_the_function_of_the_file(self):
        """Even fog that lies where its file says has the transmittance 0.9 for each voxel."""
        write_fog("fog", WHITE)
        write_objects("a.json", {"data": "fog.nrrd", "tf": "fog.tf"})
        picture = self.picture("a.json", "--eye", "8,8,100", "--look", "8,8,0", "--ortho", "8", "--size=8x8", *CLEAR)
        self.assertLess(abs(picture[..., 3] - (1 - 0.9 ** (VOXELS - 1))).max(), 1e-3)

    def test_a_small_memory_is_kept_or_refused(self):
        write_scene("splats.ply", SPLATS)
        program.write_nrrd("noise.nrrd", program.noise((32, 32, 32)))
        write_objects("a.json", {"data": "noise.nrrd"}, {"data": "splats.ply"})
        stats = self.stats("a.json", "--memory", "256M", "--size", "100x100")
        self.assertLessEqual(stats["peak_rss_bytes"], 256 << 20)
        self.leaves_nothing(1, "render", "a.json", "-o", "a.png", "--memory", "256M", "--size", "4000x4000",
                            says="raise --memory")


if __name__ == "__main__":
    program.main()
