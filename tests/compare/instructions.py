"""instructions: counts the instructions of a frame of the CPU renderer, stage by stage, by
callgrind. Started by ./instructions."""
import argparse
import json
import os
import platform
import re
import subprocess
import sys
import tempfile

# The instruction sets that valgrind supports; it has no AVX-512.
ISAS = ["neon", "plain"] if platform.machine() == "aarch64" else ["avx2", "plain"]

# The cost of a stage is the cost of these functions with all their callees. They belong to the
# table of kernels (render/cpu/kernels/kernels.h), render/cpu/cull.h and render/cpu/splat_buffer.h,
# so no compiler can inline them.
STAGES = {
    "hiding": ["trip_cpu_cull"],
    "projection": ["stage", "project"],
    "binning": ["trip_cpu_sort_chunk", "trip_cpu_link_pane_lists"],
    "blend": ["pane_clear", "pane_begin", "pane_blend", "pane_end"],
    "merge": ["pane_merge", "pane_finish"],
}

# The stages of frames with post-classification (render/cpu/sheets/).
POST_STAGES = {
    "decoding": ["trip_cpu_store_decode"],
    "preparing": ["sheet_ranges", "sheet_cells"],
    "gradients": ["sheet_gradients"],
    "slices": ["sheet_between"],
    "drawing": ["pane_clear", "sheet_pane"],
    "merge": ["pane_merge", "pane_finish"],
}

CALL = re.compile(r"calls=")
COST = re.compile(r"[+*\-\d]\S* (\d+)$")
NAME = re.compile(r"(c?fn)=\((\d+)\)(?: (.*))?")


def fail(text):
    sys.exit("instructions: " + text)


def run(command, **how):
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                          check=False, **how)
    if done.returncode:
        fail("%s: %s" % (" ".join(command[:2]), done.stderr.strip()[-400:]))
    return done.stdout


def function_costs(lines):
    """Reads a callgrind file. Returns the instructions of each function with its callees, and the
    total."""
    names, costs, own, called, total = {}, {}, None, False, 0
    for line in lines:
        name = NAME.match(line)
        if name:
            # Functions and callees share one numbering.
            if name.group(3):
                names[name.group(2)] = name.group(3)
            if name.group(1) == "fn":
                own = names[name.group(2)]
            continue
        if CALL.match(line):
            called = True
            continue
        cost = COST.match(line)
        if cost and own:
            n = int(cost.group(1))
            costs[own] = costs.get(own, 0) + n
            total += 0 if called else n
            called = False
    return costs, total


def stage_costs(costs, total, of=None):
    """Returns the instructions of each stage. A view may skip some functions of a stage, but never
    all."""
    of = of or STAGES
    for names in of.values():
        if not any(name in costs for name in names):
            fail("the profile has no function %s; use a program that is not stripped" %
                 " or ".join(names))
    stages = {stage: sum(costs.get(name, 0) for name in names) for stage, names in of.items()}
    stages["rest"] = total - sum(stages.values())
    return stages


def view_options(view):
    def point(name):
        return "%.17g,%.17g,%.17g" % tuple(view[name])
    return ["--eye=" + point("eye"), "--look=" + point("look"), "--up=" + point("up"),
            "--fov=%.17g" % view["fov_degrees"]]


class Frames:
    """The views of `bench renderers` around a data set, with their splats and pixels."""

    def __init__(self, options):
        self.options = options
        text = run([options.triptych, "bench", "renderers", options.dataset, "--renderer=cpu",
                    "--threads=1", "--occluded=draw", "--json", "--size=" + options.size,
                    "--views=%d" % options.views, *([] if options.post else ["--classify=pre"])]
                   + options.look
                   + (["--no-counts"] if options.post else []))
        result = json.loads(text)
        row = result["tables"]["renderers"]["rows"][0]
        self.views = row["each_view"]
        if options.post:
            width, height = options.size.split("x")
            self.splats = result["settings"]["kept_voxels"] * len(self.views)
            self.pixels = int(width) * int(height) * len(self.views)
            return
        self.splats = row["splats_drawn"] * len(self.views)
        self.pixels = self.splats * row.get("pixels_per_splat", 0)
        if not self.splats:
            fail("%s: the views draw no splats; check its transfer function" % options.dataset)

    def count(self, isa, folder):
        """Returns the instructions of each stage, summed over the views."""
        sums = {}
        for view in self.views:
            for stage, n in self._count_view(isa, view, folder).items():
                sums[stage] = sums.get(stage, 0) + n
        return sums

    def _count_view(self, isa, view, folder):
        profile = os.path.join(folder, "callgrind.out")
        run(["valgrind", "--tool=callgrind", "--callgrind-out-file=" + profile,
             self.options.triptych, "render", self.options.dataset, "--output",
             os.path.join(folder, "frame.tif"), "--classify=pre", "--renderer=cpu", "--threads=1",
             "--occluded=draw",
             "--engine=pread", "--size=" + self.options.size] + view_options(view)
            + self.options.look, env=dict(os.environ, TRIPTYCH_ISA=isa))
        with open(profile, encoding="utf-8", errors="replace") as file:
            return stage_costs(*function_costs(file), POST_STAGES if self.options.post else STAGES)


def print_table(frames, counts):
    post = frames.options.post
    print("%s, %s, %d view%s: %d %s, %.1f pixels each\n" % (
        os.path.basename(frames.options.dataset), frames.options.size, len(frames.views),
        "" if len(frames.views) == 1 else "s", frames.splats, "voxels" if post else "splats",
        frames.pixels / frames.splats))
    print("%-8s %-11s %16s %12s %12s" % ("set", "stage", "instructions",
                                         "per voxel" if post else "per splat", "per pixel"))
    for isa, stages in counts.items():
        for stage, n in stages.items():
            print("%-8s %-11s %16d %12.1f %12.2f" % (isa, stage, n, n / frames.splats,
                                                     n / frames.pixels))
    if post:
        print("\nVoxels are the kept voxels, pixels are the pixels of the picture. The rest is "
              "reading, checking,\nplanning, the integrals of the transfer function and writing "
              "the picture.")
        return
    print("\n`triptych bench renderers` counts splats and pixels, including occluded ones. The "
          "rest is reading,\nchecking, planning, culling and writing the picture. AVX-512 is not "
          "counted, because valgrind\nlacks it.")


def as_json(frames, counts):
    return {"data_set": frames.options.dataset, "size": frames.options.size,
            "views": len(frames.views), "voxels" if frames.options.post else "splats": frames.splats, "pixels": frames.pixels,
            "instructions": counts}


def parse():
    parser = argparse.ArgumentParser(
        prog="instructions", description="Counts by callgrind the instructions per splat and per "
        "covered pixel of a frame by one thread, for each stage.")
    parser.add_argument("dataset", help="data set made by `triptych brick`")
    parser.add_argument("--triptych", default="triptych", help="the program (default: built here)")
    parser.add_argument("--size", default="512x512",
                        help="picture size in pixels (default: 512x512)")
    parser.add_argument("--views", type=int, default=1,
                        help="number of views around the object (default: 1)")
    parser.add_argument("--isa", choices=ISAS, action="append",
                        help="instruction set; repeat it for several (default: both)")
    parser.add_argument("--classify", choices=["pre", "post"], default="pre",
                        help="as in `triptych render`; post counts per kept voxel and per pixel of "
                        "the picture (default: pre)")
    parser.add_argument("--no-shading", action="store_true", help="as in `triptych render`")
    parser.add_argument("--kernel-radius", help="as in `triptych render`")
    parser.add_argument("--json", action="store_true", help="print JSON")
    options = parser.parse_args()
    options.look = ["--no-shading"] if options.no_shading else []
    options.post = options.classify == "post"
    if options.post:
        options.look.append("--classify=post")
    if options.kernel_radius:
        options.look.append("--kernel-radius=" + options.kernel_radius)
    return options


def main():
    options = parse()
    frames = Frames(options)
    with tempfile.TemporaryDirectory() as folder:
        counts = {isa: frames.count(isa, folder) for isa in options.isa or ISAS}
    if options.json:
        print(json.dumps(as_json(frames, counts), indent=2))
    else:
        print_table(frames, counts)


if __name__ == "__main__":
    main()
