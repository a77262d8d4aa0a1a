"""uncalled: counts by callgrind the instructions of frames without effects, for the program and for
a build without effects. Started by ./uncalled."""
import argparse
import os
import subprocess
import sys
import tempfile

import instructions

# The drawing functions. Their cost is compared, with all their callees.
DRAWING = {
    "post": ["sheet_pane"],
    "pre": ["stage", "project", "pane_blend"],
}

SCENES = {
    "cloud": ["cloud", []],
    "cloud, not shaded": ["cloud", ["--no-shading"]],
    "Marschner-Lobb": ["marschner-lobb", []],
    "Marschner-Lobb, not shaded": ["marschner-lobb", ["--no-shading"]],
}


def count(program, data, isa, classify, look, size, folder):
    """Returns the instructions of drawing, and of the whole run."""
    profile = os.path.join(folder, "profile")
    instructions.run(["valgrind", "--tool=callgrind", "--callgrind-out-file=" + profile, program,
                      "render", data, "--output", os.path.join(folder, "frame.tif"),
                      "--classify=" + classify, "--renderer=cpu", "--threads=1", "--engine=pread",
                      "--size=" + size, *look], env=dict(os.environ, TRIPTYCH_ISA=isa))
    with open(profile, encoding="utf-8", errors="replace") as file:
        costs, total = instructions.function_costs(file)
    return sum(costs.get(name, 0) for name in DRAWING[classify]), total


def refuses(program, data, folder):
    """Returns whether the program refuses effects, as a build without effects must."""
    done = subprocess.run([program, "render", data, "--output", os.path.join(folder, "a.tif"),
                           "--effects=occlusion"], capture_output=True, text=True, check=False)
    return done.returncode == 2 and done.stderr == "triptych: render: effects: this build has no effects\n"


def main():
    parser = argparse.ArgumentParser(
        prog="uncalled", description="Counts the instructions of frames without effects, for the "
        "program and for a build without effects. Fails if drawing takes more, by more than "
        "--most per cent.")
    parser.add_argument("--builds",
                        help="folder of both builds (default: build/, where they are built)")
    parser.add_argument("--size", default="128x128",
                        help="picture size in pixels (default: 128x128)")
    parser.add_argument("--voxels", default="64",
                        help="edge of the volumes in voxels (default: 64)")
    parser.add_argument("--isa", choices=instructions.ISAS, action="append",
                        help="instruction set; repeat it for several (default: all)")
    parser.add_argument("--most", type=float, default=0,
                        help="allowed increase of drawing, in per cent (default: 0)")
    o = parser.parse_args()
    builds = [os.path.join(o.builds, name + "-effects") for name in ("with", "without")]
    programs = [os.path.join(build, "triptych") for build in builds]
    worst = 0
    with tempfile.TemporaryDirectory() as folder:
        for field in "cloud", "marschner-lobb":
            source = os.path.join(folder, field + ".nrrd")
            instructions.run([os.path.join(builds[0], "triptych-generate"), "--size=" + o.voxels,
                              "--output=" + source, field])
            instructions.run([programs[0], "brick", source, "--quiet", "--output",
                              os.path.join(folder, field + ".trip")])
        if not refuses(programs[1], os.path.join(folder, "cloud.trip"), folder):
            instructions.fail(programs[1] + " has effects; build it with -DTRIP_WITHOUT_EFFECTS")
        print("%-6s %-9s %-27s %13s %13s %8s %8s" % ("set", "classify", "scene", "drawing",
                                                     "without", "more", "of all"))
        for isa in o.isa or instructions.ISAS:
            for classify in DRAWING:
                for scene, (field, look) in SCENES.items():
                    data = os.path.join(folder, field + ".trip")
                    (has, all_), (lacks, rest) = (
                        count(p, data, isa, classify, look, o.size, folder) for p in programs)
                    more = 100 * (has / lacks - 1)
                    worst = max(worst, more)
                    print("%-6s %-9s %-27s %13d %13d %+7.2f%% %+7.2f%%" % (
                        isa, classify, scene, has, lacks, more, 100 * (all_ / rest - 1)), flush=True)
    if worst > o.most:
        sys.exit("uncalled: unused effects add %.2f %% to the instructions of drawing" % worst)


if __name__ == "__main__":
    main()
