"""Tests every option of every command. A wrong value gives one line and exit status 2, and each
valid value works."""
import concurrent.futures
import json
import os
import re
import subprocess

import program

NUMBERS = ["", "x", "nan", "inf", "-inf", "1e999", "1x", "0x", "--", "1,5", "½"]
POINTS = ["", "1", "1,2", "1,2,3,4", "1,2,x", "1,,3", "1,2,nan", "1,2,inf", "1 2 3", "a,b,c"]
COUNTS = ["", "0", "-1", "1.5", "x", "99999999999999999999", "1e3x"]
NAMES = ["", "nonsense", "MERGE", "merge,clip"]
SIZES = ["", "0", "-5", "x", "5Q", "5MM", "nan", "99999999999999999999999G", "M"]

# Wrong values of each option. None marks an option without a value.
BRICK = {
    "--color": NAMES + ["red", "RGB"],
    "--k": COUNTS + ["2", "65"],
    "--outliers": NUMBERS + ["0", "-1", "1001"],
    "--uncertainty": None,
    "--hyperlines": None,
    "--radius": ["", "0", "-1", "x", "1y", "xx", "nan", "inf", "1e13", "1e7x", "0x"],
    "--allow-gaps": None,
    "--series": COUNTS,
    "--axes": NAMES + ["PI", "PIRS", "pir", "PAR"],
    "--channel": ["", "-1", "1.5", "x", "9" * 20],
    "--time": ["", "-1", "1.5", "x", "9" * 20],
    "--fill": ["", "much", "nan", "1,2"],
    "--endian": NAMES,
    "--level-set": NAMES + ["refuse"],
    "--offset": ["", "-1", "x", "1.5", "9" * 30],
    "--size": ["", "1", "1,2", "0,1,1", "-1,1,1", "a,b,c", "1,2,3,4", "nan,1,1"],
    "--spacing": POINTS + ["0,1,1", "-1,1,1"],
    "--coordinates": ["", "x.txt", "x.txt,y.txt", "x.txt,y.txt,z.txt", "a,b,c,d"],
    "--type": ["", "nonsense", "uint7", "block"],
    "--range": ["", "1", "2:1", "a:b", "nan:1", "1:2:3", ":x"],
    "--tf": ["preset:nonsense", "preset:"],
    "--memory": SIZES,
    "--threads": COUNTS + ["100000"],
    "--tile": COUNTS + ["17", "8", "256"],
    "--slab-sheets": COUNTS + ["65"],
    "--keep-all": None,
    "--region": ["", "1:2", "1:2,3:4,5:6,", "1:2,3:4,6:5", "a:,:,:", "-1:,:,:"],
    "--force": None,
    "--json": None,
    "--code-bits": ["", "12", "0", "byte"],
    "--normals": ["", "nonsense", "3"],
    "--halo": ["", "2", "-1", "yes"],
    "--harmonics": NAMES + ["exact"],
    "--levels": ["", "-1", "25", "1.5", "yes"],
    "--levels-for": NAMES + ["means"],
    "--resume": None,
    "--dry-run": None,
    "--limits": None,
    "--quiet": None,
    "--grid": [],
    "--output": [],
}
RENDER = {
    "--color": NAMES + ["red", "RGB"],
    "--k": COUNTS + ["2", "65"],
    "--outliers": NUMBERS + ["0", "-1", "1001"],
    "--uncertainty": None,
    "--hyperlines": None,
    "--radius": ["", "0", "-1", "x", "1y", "xx", "nan", "inf", "1e13", "1e7x", "0x"],
    "--axes": NAMES + ["PI", "PIRS", "pir", "PAR"],
    "--channel": ["", "-1", "1.5", "x", "9" * 20],
    "--time": ["", "-1", "1.5", "x", "9" * 20],
    "--fill": ["", "much", "nan", "1,2"],
    "--clip-box": ["", "1", "1,2,3", "0,0,0,1,1,x", "0,0,0,1,1,0", "voxels:", "voxel:0,0,0,1,1,1"],
    "--clip-plane": ["", "1,2,3", "0,0,0,1", "1,2,3,x", "1,2,3,4,5"],
    "--show": NAMES,
    "--lod": ["", "-1", "1001", "fine"],
    "--max-bytes": ["", "-1", "0", "little"],
    "--max-ms": ["", "-1", "0", "1e10", "soon"],
    "--allow-gaps": None,
    "--series": COUNTS,
    "--grid": [],
    "--level-set": NAMES + ["refuse"],
    "--spacing": POINTS + ["0,1,1", "-1,1,1"],
    "--coordinates": ["", "x.txt", "x.txt,y.txt", "x.txt,y.txt,z.txt", "a,b,c,d"],
    "--size": [
        "",
        "0",
        "65537",
        "123456",
        "10x",
        "x10",
        "0x10",
        "10x0",
        "-1x10",
        "10x10x10",
        "99999999999x1",
        "1.5x2",
        "10 x 10",
    ],
    "--eye": POINTS,
    "--look": POINTS,
    "--up": POINTS + ["0,0,0"],
    "--fov": NUMBERS + ["0", "-5", "180"],
    "--ortho": NUMBERS + ["0", "-5", "Fit"],
    "--orbit": COUNTS + ["1000000"],
    "--place": ["1", "1,2", "1,2,3,0", "1,2,3,-1", "a,b,c", "1,2,nan", "1,2,3;4,5,6;7,8,9", "1,2,3,4,5"],
    "--path": [],
    "--fps": NUMBERS + ["0", "-1", "1e9"],
    "--in-flight": COUNTS + ["17"],
    "--view": NAMES + ["above", "FRONT"],
    "--azimuth": NUMBERS + ["1e9"],
    "--elevation": NUMBERS + ["1e9"],
    "--roll": NUMBERS + ["1e9"],
    "--zoom": NUMBERS + ["0", "-1", "1e9"],
    "--background": POINTS[:2] + ["1,2", "whit", "White", "2,0,0", "-1,0,0", "0,0,0,2",
                                       "nan,0,0", "#", "#12", "#12345", "#gggggg", "#fffffffff",
                                       "ffffff", "255,255,255"],
    "--tf": ["preset:nonsense", "preset:"],
    "--opacity-scale": NUMBERS + ["0", "-1", "1e9"],
    "--window": NUMBERS + ["0", "-5", "100"],
    "--level": NUMBERS + ["100"],
    "--light": POINTS + ["0,0,0", "heads", "point:", "point:1,2", "point:nan,0,0", "point:1e200,0,0",
                         "point:1e18,0,0", "points:1,2,3", "world:", "world:0,0,0", "World:1,2,3"],
    "--effects": NAMES + ["none,cueing", "cueing,", "auto,shade"],
    "--anisotropy": NUMBERS + ["1", "-1"],
    "--cueing": NUMBERS + ["0", "-1", "1.5"],
    "--edl-strength": NUMBERS + ["0", "-1", "101"],
    "--edl-radius": NUMBERS + ["0", "-1", "0.5", "65"],
    "--light-cells": COUNTS + ["7", "1025"],
    "--emission": [],
    "--temperature": NUMBERS + ["5", "5:", ":5", "2000:1000", "nan:5", "1:2:3"],
    "--h": NUMBERS + ["1", "-0.1", "1.5"],
    "--early-termination": NUMBERS + ["-0.1", "0.11"],
    "--quality": NAMES + ["best"],
    "--error": NUMBERS + ["0", "-1", "256"],
    "--report": [],
    "--kernel-radius": NUMBERS + ["0", "-1", "1e9"],
    "--low-pass": NAMES + ["gaussian"],
    "--low-pass-width": NUMBERS + ["-1", "17", "none"],
    "--weights": NAMES,
    "--order": NAMES,
    "--sheet": NUMBERS + ["0", "-1", "1e13"],
    "--sh": NUMBERS + ["-1", "4", "1.5"],
    "--sides": NAMES,
    "--normalise": None,
    "--flatten": NUMBERS + ["0", "0.5", "1e9"],
    "--target": NAMES,
    "--renderer": NAMES,
    "--method": NAMES,
    "--submit": NAMES + ["sprites,", ",", "sprites,triangles", "sprites,sprites"],
    "--classify": NAMES,
    "--compositing": NAMES + ["sheets"],
    "--samples-per-sheet": COUNTS + ["17"],
    "--traversal": NAMES,
    "--occluded": NAMES,
    "--field": NAMES,
    "--kernel": NAMES + ["sinc"],
    "--interpolation": NAMES + ["sinc"],
    "--tolerance": NUMBERS + ["0", "-1", "1"],
    "--samples": COUNTS + ["65"],
    "--memory": SIZES,
    "--engine": NAMES,
    "--threads": COUNTS + ["100000"],
    "--no-shading": None,
    "--explain": None,
    "--count": None,
    "--output": [],
    "--quiet": None,
    "--stats": [],
    "--depth": ["z.png", "z.jpg", "z"],
}
INFO = {
    "--verify": None,
    "--json": None,
    "--quiet": None,
    **{name: RENDER[name] for name in (
        "--allow-gaps", "--axes", "--channel", "--coordinates", "--fill", "--grid", "--level-set",
        "--series", "--spacing", "--time")},
}
COMMANDS = ("accuracy", "bench", "brick", "cache", "info", "render", "serve", "tf", "view")


def options_of(command):
    text = program.call(command, "--help=names").stdout.decode()
    return set(re.findall(r"^--[a-z][a-z-]*", text, re.M))


class Options(program.ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.source = os.path.join(program.DATASETS, "densityAndHeat.vdb")
        assert program.call("brick", cls.source, "-o", "a.trip", "-q").returncode == 0

    def all_fail(self, arguments):
        """Checks that each command fails with exit status 2 and leaves no file."""
        before = set(os.listdir("."))
        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            runs = list(pool.map(lambda a: program.call(*a), arguments))
        faults = [
            f"{r.args}: {r.returncode}: {r.stderr!r}"
            for r in runs
            if r.returncode != 2 or not program.LINE.fullmatch(r.stderr) or r.stdout
        ]
        self.assertEqual(faults, [], "\n".join(faults))
        self.assertEqual(set(os.listdir(".")), before)

    def test_the_tables_name_every_option(self):
        for command, table in ("brick", BRICK), ("render", RENDER), ("info", INFO):
            self.assertEqual(options_of(command) - set(table), set())

    def test_the_short_help_fits_a_screen(self):
        text = self.works("render", "--help").stdout.decode()
        self.assertLessEqual(text.count("\n"), 60)
        self.assertLessEqual(max(map(len, text.splitlines())), 79)
        self.assertTrue(set(re.findall(r"--[a-z][a-z-]*", text)) - {"--help"} <= options_of("render"))

    def test_help_of_a_command_is_its_help(self):
        for command in COMMANDS:
            self.assertEqual(self.works("help", command).stdout,
                             self.works(command, "--help").stdout)

    def test_man_pages_have_every_option(self):
        pages = os.path.join(os.path.dirname(__file__), "..", "..", "cli", "man")
        made = os.path.join(os.path.dirname(program.PROGRAM), "cli")
        for command in COMMANDS:
            page = f"triptych-{command}.1"
            folder = made if os.path.exists(os.path.join(made, page)) else pages
            with open(os.path.join(folder, page), encoding="utf-8") as f:
                lines = f.read().replace("\\-", "-").splitlines()
            heads = " ".join(l for before, l in zip(lines, lines[1:]) if before == ".TP")
            named = set(re.findall(r"--[a-z][a-z-]*", heads)) - {"--help"}
            self.assertEqual(named, options_of(command) - {"--help"}, command)

    def test_bash_completes_options_and_choices(self):
        script = os.path.join(os.path.dirname(__file__), "..", "..", "cli", "completion.bash")
        for words, expected in (
            (["triptych", "ren"], "render"),
            (["triptych", "render", "--clas"], "--classify"),
            (["triptych", "render", "--classify", "p"], "pre post"),
            (["triptych", "brick", "--lev"], "--level-set --levels --levels-for"),
        ):
            run = subprocess.run(
                ["bash", "-c", f'. "{script}"; COMP_WORDS=("${{@:2}}"); COMP_CWORD=$((${{#@}} - 2)); '
                 '_triptych "$1"; echo "${COMPREPLY[@]}"', "bash", program.PROGRAM, *words],
                capture_output=True, check=True, text=True)
            self.assertEqual(run.stdout.strip(), expected, run.stderr)

    def test_wrong_values_are_refused(self):
        wrong = []
        for command, table in ("brick", BRICK), ("render", RENDER), ("info", INFO):
            start = {
                "brick": ["brick", self.source, "-o", "b.trip"],
                "info": ["info", "a.trip"],
                "render": ["render", "a.trip", "-o", "a.png", "--size", "16x16"],
            }[command]
            for option in sorted(options_of(command)):
                if table[option] is None:
                    wrong.append(start + [f"{option}=yes"])
                    continue
                wrong += [start + [f"{option}={value}"] for value in table[option]]
                wrong.append(start + [option])
            wrong += [
                start + ["--nonsense"],
                start + ["-z"],
                start + ["--=3"],
                start + ["second", "third"],
                [command],
            ]
        self.all_fail(wrong[::3] if program.SANITIZED else wrong)  # few parsers serve all options

    def test_wrong_commands_are_refused(self):
        self.all_fail([[], ["nonsense"], ["--nonsense"], ["-x"], ["Brick"]])
        for command in [""], ["brick", ""], ["render", "", "-o", "a.png"], ["info", ""]:
            run = program.call(*command)
            self.assertIn(run.returncode, (1, 2))
            self.assertEqual(run.stderr.count("\n"), 1)

    def test_control_characters_in_names_are_not_printed(self):
        for name in ("--fr\x1b[31mob", "--size\x7f=3x3", "-\x1b", "--fr\udcffob"):
            run = self.fails(2, "render", name, says="unknown option")
            self.assertTrue(run.stderr.rstrip("\n").isprintable(), run.stderr)

    def test_wrong_combinations_are_refused(self):
        brick, render = ["brick", self.source, "-o", "b.trip"], ["render", "a.trip", "-o", "a.png"]
        self.all_fail(
            [
                brick + ["--keep-all", "--range=1:2"],
                brick + ["--levels=0", "--levels-for=pre"],
                brick + ["--halo=0", "--levels-for=post"],
                brick + ["--halo=0", "--levels-for=both"],
                brick + ["--grid=density", "--grid=heat"],
                render + ["--grid=density", "--grid=heat"],
                render + ["--grid=density"],
                render + ["--spacing=1,1,1"],
                render + ["--axes=PIR"],
                render + ["--ortho=5", "--fov=30"],
                render + ["--eye=1,2,3", "--view=front"],
                render + ["--light=head", "--no-shading"],
                render + ["--h=0.5", "--method=clip"],
                render + ["--show=lists", "--renderer=integral"],
                render + ["--clip-plane=1,0,0,0"] * 7,
                render + ["--clip-plane=1,0,0,0", "--submit=indexed"],
                render + ["--target=rgba8", "--renderer=reference"],
                render + ["--submit=indexed", "--renderer=reference"],
                render + ["--submit=resident", "--renderer=reference"],
                render + ["--clip-plane=1,0,0,0", "--submit=resident"],
                render + ["--lod=1", "--submit=resident"],
                render + ["--occluded=skip", "--renderer=gl"],
                render + ["--samples=2", "--depth=d.tif"],
                render + ["--tolerance=0.01"],
                render + ["--kernel=ewa", "--renderer=integral"],
                render + ["--kernel=ewa", "--classify=post"],
                render + ["--kernel=ewa", "--samples-per-sheet=2"],
                render + ["--low-pass=none", "--classify=post"],
                render + ["--low-pass-width=1", "--classify=post"],
                render + ["--low-pass-width=1", "--renderer=integral"],
                render + ["--low-pass-width=1", "--low-pass=none"],
                render + ["--low-pass-width=1", "--samples-per-sheet=2"],
                render + ["--low-pass=uniform", "--kernel=ewa"],
                render + ["--low-pass=uniform", "--renderer=reference"],
                render + ["--flatten=3"],
                render + ["--kernel=fixed", "--renderer=cpu"],
                render + ["--kernel=fixed", "--lod=1"],
                render + ["--method=image", "--renderer=cpu"],
                render + ["--method=image", "--traversal=ascending"],
                render + ["--method=image", "--classify=post"],
                render + ["--weights=vertex", "--renderer=gl"],
                render + ["--weights=vertex", "--method=clip"],
                render + ["--weights=vertex", "--compositing=sheet"],
                render + ["--weights=vertex", "--renderer=integral"],
                render + ["--flatten=3", "--kernel=ewa", "--count"],
                render + ["--interpolation=cubic", "--classify=pre"],
                render + ["--interpolation=cubic", "--kernel-radius=3"],
                render + ["--interpolation=cubic", "--kernel=ewa"],
                render + ["--interpolation=nearest", "--samples-per-sheet=4"],
                render + ["--interpolation=nearest", "--classify=pre"],
                render + ["--interpolation=gaussian", "--renderer=integral"],
                render + ["--quality=draft", "--error=1"],
                render + ["--quality=draft", "--renderer=integral"],
                render + ["--report=a.accuracy"],
                render + ["--lod=1", "--renderer=integral"],
                render + ["--anisotropy=0.5"],
                render + ["--cueing=0.5"],
                render + ["--edl-strength=1"],
                render + ["--edl-radius=2", "--effects=cueing"],
                render + ["--effects=edl", "--renderer=integral"],
                render + ["--light-cells=32", "--effects=cueing"],
                render + ["--effects=emission"],
                render + ["--emission=heat.trip"],
                render + ["--temperature=0:2000"],
                render + ["--max-bytes=1M", "--renderer=integral"],
                render + ["--classify=pre", "--renderer=integral"],
                render + ["--classify=post", "--renderer=integral"],
                render + ["--samples-per-sheet=4", "--renderer=integral"],
                render + ["--depth=d.tif", "--show=merge"],
                render + ["--error=1", "--samples-per-sheet=4"],
                render + ["--classify=pre", "--error=1"],
                render + ["--error=1", "--samples=2"],
                ["render", "a.trip", "b.trip", "-o", "a.png", "--lod=8"],
                ["render", "a.trip", "b.trip", "-o", "a.png", "--max-bytes=1M"],
                ["render", "a.trip", "b.trip", "-o", "a.png", "--max-ms=5"],
                *([command, "a.trip", option] for command in ("view", "serve") for option in (
                    "--axes=PIR", "--grid=foo", "--spacing=4,1,1", "--coordinates=a,b,c",
                    "--level-set=band", "--series=1", "--channel=1", "--time=1", "--allow-gaps", "--fill=5")),
                *([command, "a.trip", "--error=1", "--classify=pre"] for command in ("view", "serve")),
                render + ["--max-ms=5", "--renderer=integral"],
                render + ["--field=source", "--renderer=integral"],
                render + ["--field=splats", "--interpolation=cubic", "--renderer=integral"],
                render + ["--kernel-radius=3", "--renderer=integral"],
                render + ["--target=rgba8", "--renderer=integral"],
                render + ["--method=clip", "--renderer=integral"],
                render + ["--traversal=outward", "--renderer=integral"],
                render + ["--h=0.5", "--renderer=integral"],
                render + ["--depth=z.tif", "--renderer=integral"],
                render + ["--eye=1,2,3", "--look=1,2,3"],
                render + ["--eye=0,0,0", "--look=0,0,9", "--up=0,0,1"],
                ["render", "a.trip", "-o", "a"],
                ["render", "a.trip", "-o", "a.gif"],
                ["render", "a.trip", "-o", ".png"],
                ["render", "a.trip", "-o", "folder/"],
            ]
        )

    def test_errors_name_the_option(self):
        render = ["render", "a.trip", "-o", "a.png"]
        self.fails(2, *render, "--samples-per-sheet=4", "--renderer=integral", says="--samples-per-sheet: ")
        self.fails(2, *render, "--error=1", "--samples-per-sheet=4", says="excludes --samples-per-sheet")

    def test_every_value_works(self):
        render = ["--size=24x20"]
        values = {
            "--method": ["merge", "clip", "axis", "image"],
            "--weights": ["pixel", "vertex"],
            "--renderer=reference --interpolation": ["nearest", "linear", "cubic", "gaussian"],
            "--renderer=reference --kernel": ["fixed"],
            "--traversal": ["outward", "ascending"],
            "--renderer": ["cpu", "reference", "integral", "auto"],
            "--renderer=integral --samples=1 --field": ["stored", "splats"],
            "--renderer=integral --samples=1 --interpolation": ["nearest", "linear", "cubic"],
            "--renderer=integral --samples=1 --tolerance": ["1e-8", "0.1"],
            "--renderer=integral --samples": ["1", "3"],
            "--renderer=integral --samples=1 --field=splats --kernel-radius": ["1", "2.5"],
            "--clip-box": ["1,1,1,9,9,9", "voxels:-5,0,0,1e9,8,8.5"],
            "--clip-plane": ["1,0,0,-3", "-1,1,0.5,1e9"],
            "--show": ["picture", "lists", "merge", "levels"],
            "--classify=post --show": ["lists", "merge", "levels"],
            "--kernel": ["exact", "ewa"],
            "--interpolation": ["nearest", "linear", "cubic", "gaussian"],
            "--low-pass": ["ewa", "none"],
            "--kernel=ewa --renderer=reference --low-pass": ["ewa", "uniform", "none"],
            "--kernel=ewa --flatten": ["1", "2.5", "100"],
            "--h": ["0", "0.5", "0.9999"],
            "--max-bytes": ["1", "64K", "1.5G"],
            "--classify=post --max-bytes": ["1", "1M"],
            "--max-ms": ["0.001", "1000"],
            "--quality": ["draft", "normal", "high", "exact"],
            "--kernel-radius": ["0.5", "3"],
            "--samples": ["1", "3"],
            "--light": ["head", "1,2,3", "-1e9,0,0", "world:1,2,3", "point:1,2,3", "point:0,0,0"],
            "--effects": ["none", "auto", "occlusion", "cueing,occlusion", "shadows"],
            "--effects=auto --anisotropy": ["-0.95", "0", "0.95"],
            "--effects=cueing --cueing": ["1", "1e-3"],
            "--effects=occlusion --light-cells": ["8", "128"],
            "--background": ["none", "transparent", "white", "#fff", "1,0,0", "0,0.5,1,0.25"],
            "--occluded": ["skip", "draw"],
            "--opacity-scale": ["0.01", "1", "1e6"],
            "--window=50 --level": ["-10", "0", "100"],
            "--target": ["rgba32f", "rgba16f", "rgba8"],
            "--engine": ["auto", "pread"],
            "--threads": ["1", "3"],
            "--memory": ["64M", "1G"],
            "--fov": ["0.5", "90", "179"],
            "--ortho": ["1e-3", "20", "fit"],
            "--view": ["front", "back", "left", "right", "top", "bottom", "iso"],
            "--azimuth": ["0", "-3600", "12.5"],
            "--elevation": ["90", "-90", "180"],
            "--roll": ["-45", "360"],
            "--zoom": ["0.1", "1", "1e3"],
            "--size": ["1x1", "1x50", "50x1", "333x7", "17"],
            "--orbit": ["1", "2"],
            "--place": ["1,2,3", "1,2,3,0.5"],
            "--orbit=3 --in-flight": ["1", "3", "16"],
            "--tf": [
                "preset:" + name
                for name in ("grey", "bone", "viridis", "fog", "auto", "mr", "labels", "ct-soft")
            ],
        }
        runs = [f"{option}={value}".split() for option, all_of in values.items() for value in all_of]
        runs += [
            ["--no-shading"],
            ["--normalise"],
            ["--explain"],
            ["--explain", "--count"],
            ["--depth=z.tif"],
            ["--stats=-"],
            ["--stats=s.json"],
            ["--stats", "./s.json"],
        ]
        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            done = list(
                pool.map(
                    lambda n: program.call(
                        *("render", "a.trip", "-o", f"v{n}.exr", *render, *runs[n]),
                        program=program.QUICK_PROGRAM,
                    ),
                    range(len(runs)),
                )
            )
        faults = [
            f"{r.args}: {r.returncode}: {r.stderr!r}"
            for r in done
            if r.returncode
            or any("warning" not in l and "the light for the shadows" not in l for l in r.stderr.splitlines())
        ]
        self.assertEqual(faults, [], "\n".join(faults))
        for extension in "png", "PNG", "jpg", "jpeg", "tif", "tiff", "exr":
            self.works("render", "a.trip", "-o", f"e.{extension}", *render)
            self.assertGreater(os.path.getsize(f"e.{extension}"), 100)

    def test_io_uring_reads_if_the_system_allows_it(self):
        run = program.call("render", "a.trip", "-o", "u.png", "--size=24x20", "--engine=io_uring")
        if "the system refuses io_uring" in run.stderr:
            self.skipTest("the system refuses io_uring")
        self.assertEqual((run.returncode, run.stderr), (0, ""))

    def test_a_side_alone_is_a_square(self):
        self.works("render", "a.trip", "-o", "side.exr", "--size", "19")
        self.assertEqual(program.read_exr("side.exr").shape, (19, 19, 4))
        run = self.works("bench", "renderers", "a.trip", "--renderer=reference", "--views=1",
                         "--size=12,8x6", "--json")
        rows = json.loads(run.stdout)["tables"]["renderers"]["rows"]
        self.assertEqual({row["size"] for row in rows if row["name"] != "default"}, {"12 x 12", "8 x 6"})
        self.fails(2, "accuracy", "a.trip", "--size", "16", says="takes 32 to 4096 pixels a side")

    def test_unknown_names_suggest_similar_ones(self):
        render = ["render", "a.trip", "-o", "a.png"]
        for arguments, *says in (
            (["rendr"], "rendr: unknown command; did you mean render?"),
            (["Info", "a.trip"], "did you mean info?"),
            (["--verison"], "--verison: unknown command; did you mean --version?"),
            (["help", "rendr"], "did you mean render?"),
            ([*render, "--orbti=4"], "--orbti: unknown option; did you mean --orbit? ",
             "`triptych render --help`"),
            ([*render, "-size", "3x3"], "-size: unknown option; did you mean --size?"),
            ([*render, "--clip=3"], "--clip: short for several options: --clip-box, --clip-plane"),
            (["brick", "--orbit", "3", self.source], "unknown option of brick; `triptych render` has it"),
            (["info", "--no-panel", "a.trip"], "`triptych view` has it"),
            (["cache", "list", "--jsno"], "did you mean --json?"),
            ([*render, "--view=fornt"], "did you mean front? use one of front, back, "),
            ([*render, "--effects=shadow"], "did you mean shadows?"),
            ([*render, "--background=whiet"], "did you mean white?"),
            ([*render, "--tf=preset:viridsi"], "no preset `viridsi`; did you mean preset:viridis?"),
            (["bench", "rendrers"], "did you mean renderers?"),
            (["tf", "lsit"], "did you mean list?"),
            (["cache", "claer"], "did you mean clear?"),
        ):
            run = self.fails(2, *arguments, says=says[0])
            for more in says[1:]:
                self.assertIn(more, run.stderr)
            self.assertLess(len(run.stderr), 180, run.stderr)
        self.assertNotIn("did you mean", self.fails(2, *render, "--frobnicate").stderr)
        self.fails(1, *render, "--tf=ct-bnoe", says="did you mean preset:ct-bone?")
        self.fails(1, *render, "--tf=unlike-any", says="no such file or preset; `triptych tf list`")

    def test_h_prints_the_help(self):
        for command in (), *((name,) for name in COMMANDS):
            self.assertEqual(self.works(*command, "-h").stdout, self.works(*command, "--help").stdout)
        run = program.call("-h", program=program.GENERATE)
        self.assertEqual((run.returncode, run.stderr), (0, ""))
        self.assertIn(b"--size=", run.stdout)

    def test_quiet_leaves_only_results(self):
        """Notes and summaries disappear. Requested output, warnings and errors stay."""
        program.write("none.tf", b"1e6 1 1 1 0\n2e6 1 1 1 1\n")
        draw = ["render", self.source, "-o", "q.png", "--size=16", "--effects=shadows"]
        loud = self.works(*draw)
        self.assertIn(b"bricked into the cache", loud.stdout)
        self.assertIn("note: ", loud.stderr)
        for more in [], ["--orbit=2"]:
            run = self.works(*draw, "-q", *more)
            self.assertEqual((run.stdout, run.stderr), (b"", ""))
        self.assertIn(b'"frames"', self.works(*draw, "-q", "--stats=-").stdout)
        self.assertIn("warning: ", self.works(*draw, "-q", "--tf=none.tf").stderr)
        self.fails(2, *draw, "-q", "--size=x", says="--size")
        brick = ["brick", self.source, "-o", "q.trip", "--force", "-q"]
        self.assertEqual(self.works(*brick).stdout, b"")
        self.assertIn("bytes", json.loads(self.works(*brick, "--json").stdout))
        self.assertIn(b"about", self.works("brick", self.source, "-q", "--dry-run").stdout)
        for results in (["info", "a.trip"], ["info", self.source], ["tf", "list"],
                        ["tf", "show", self.source], ["cache", "list"]):
            self.assertEqual(self.works(*results, "-q").stdout, self.works(*results).stdout)
        self.assertEqual(self.works("cache", "clear", "--quiet").stdout, b"")

    def test_help_and_version_print(self):
        for command in (), ("brick",), ("info",), ("render",):
            text = self.works(*command, "--help").stdout
            self.assertIn(b"Usage: triptych", text)
        self.assertRegex(self.works("--version").stdout, rb"^triptych \d+\.\d+\.\d+\n$")

    def test_the_default_output_has_the_name_of_the_input(self):
        self.works("brick", self.source, "-q")
        self.assertEqual(self.info("densityAndHeat.trip")["voxels"], 6124)

    def test_only_force_replaces_a_data_set(self):
        before = os.stat("a.trip/index.trip").st_mtime_ns
        self.fails(1, "brick", self.source, "-o", "a.trip", "-q")
        self.assertEqual(os.stat("a.trip/index.trip").st_mtime_ns, before)
        self.works("brick", self.source, "-o", "a.trip", "-q", "--force")
        self.assertNotEqual(os.stat("a.trip/index.trip").st_mtime_ns, before)
        self.works("info", "--verify", "a.trip")

    def test_a_foreign_file_or_folder_is_never_replaced(self):
        program.write("file.trip", b"precious")
        os.mkdir("folder.trip")
        program.write("folder.trip/diary", b"precious")
        for output in "file.trip", "folder.trip":
            for force in (), ("--force",):
                self.fails(1, "brick", self.source, "-o", output, "-q", *force)
        with open("file.trip") as f:
            self.assertEqual(f.read(), "precious")
        self.assertEqual(os.listdir("folder.trip"), ["diary"])


if __name__ == "__main__":
    program.main()
