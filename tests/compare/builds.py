"""builds: compares several builds of triptych on one volume, in turns. It measures the cost of data
sets and frames, or checks that the pictures have the same bits. Started by ./builds."""
import argparse
import hashlib
import json
import os
import subprocess
import sys
import tempfile

# Views from the sides, from inside and with a wide angle, with options that every build has.
VIEWS = (["--view=front"], ["--view=left"], ["--view=top"], ["--view=iso"],
         ["--view=iso", "--zoom=6"], ["--view=iso", "--fov=90"])

STAGES = ("frame", "read", "draw")


def fail(text):
    sys.exit("builds: " + text)


def run(*command):
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        fail("%s: %s" % (" ".join(command[:2]), done.stderr.strip()[-400:]))
    return done.stdout


def middle(values):
    return sorted(values)[(len(values) - 1) // 2]


def load():
    with open("/proc/loadavg", encoding="ascii") as file:
        return float(file.read().split()[0])


class Build:
    """A build of the program, which may lack options of later builds."""

    def __init__(self, path):
        self.path = path
        self.help = {c: run(path, c, "--help=all") for c in ("brick", "render", "bench")}

    def given(self, command, *options):
        """Returns the options that the command has in this build."""
        return [o for o in options if o.split("=")[0] in self.help[command]]

    def brick(self, o, data, *options):
        summary = run(self.path, "brick", o.volume, "-o", data, "--force", "--json",
                      "--memory=" + o.memory, *self.given("brick", "--levels=0", *options), *o.brick)
        return json.loads(summary)

    def stream(self, o, data):
        """Returns milliseconds of a frame from disk, of reading alone and of drawing from
        memory."""
        report = json.loads(run(self.path, "bench", "stream", data, "--renderer=cpu", "--json",
                                "--memory=" + o.memory, "--size=" + o.size, "--repeat=1"))
        rows = report["tables"]["stages"]["rows"]
        return {row["key"]: row["ms"] for row in rows if "ms" in row}

    def pictures(self, o, data, folder):
        """Returns the SHA-256 of the OpenEXR file of each view."""
        name = os.path.join(folder, "view.exr")
        hashes = []
        for view in VIEWS:
            run(self.path, "render", data, "-o", name, "--renderer=cpu", "--size=" + o.size, *view,
                *self.given("render", "--classify=pre"), *o.render)
            with open(name, "rb") as file:
                hashes.append(hashlib.sha256(file.read()).hexdigest())
        return hashes


def costs(builds, o, folder):
    rows = [{"program": b.path, "brick": [], "frame": [], "read": [], "draw": []} for b in builds]
    for _ in range(o.repeat):
        for number, (build, row) in enumerate(zip(builds, rows)):
            data = os.path.join(folder, "%d.trip" % number)  # formats differ between builds
            made = build.brick(o, data)
            splats = made["bytes"] - made.get("halo_bytes", 0)
            row["bytes_a_splat"] = splats / made["kept"]
            row["kept"], row["input_bytes"] = made["kept"], made["input_bytes"]
            row["brick"].append(made["seconds"])
            for stage, ms in build.stream(o, data).items():
                if stage in STAGES:
                    row[stage].append(ms)
    for row in rows:
        for stage in ("brick", *STAGES):
            row[stage] = middle(row[stage]) if row[stage] else None
    return rows


def pictures(builds, o, folder):
    """Returns the hashes of each build with a halo and, if the build has --halo, without one."""
    rows = []
    for number, build in enumerate(builds):
        halos = ["--halo=0", "--halo=1"] if "--halo" in build.help["brick"] else [None]
        for halo in halos:
            data = os.path.join(folder, "%d.trip" % number)
            build.brick(o, data, "--normals=full", *([halo] if halo else []))
            rows.append({"program": build.path, "halo": halo and halo[-1],
                         "views": build.pictures(o, data, folder)})
    return rows


def text(number, form):
    return "-" if number is None else form % number


def ratio(a, b):
    return "-" if a is None or b is None else "%.2f" % (a / b)


def print_costs(rows, o):
    print("%s, %.1f MB of input, load %.1f\n" % (os.path.basename(o.volume),
                                                 rows[0]["input_bytes"] / 1e6, load()))
    line = "%-32s %10s %8s %9s %9s %9s %9s"
    print(line % ("program", "kept", "B/splat", "brick s", "frame ms", "read ms", "draw ms"))
    for row in rows:
        print(line % (row["program"][-32:], row["kept"], "%.2f" % row["bytes_a_splat"],
                      "%.2f" % row["brick"], *(text(row[s], "%.0f") for s in STAGES)))
    for row in rows[1:]:
        print(line % ("times the first", "", *(ratio(row[s], rows[0][s]) for s in (
            "bytes_a_splat", "brick", *STAGES))))


def print_pictures(rows):
    for row in rows:
        print("%-32s halo %-2s %s" % (row["program"][-32:], row["halo"] or "-",
                                      " ".join(h[:8] for h in row["views"])))
    same = all(row["views"] == rows[0]["views"] for row in rows)
    print("all pictures have the same bits" if same else "the pictures differ")


def parse():
    parser = argparse.ArgumentParser(
        prog="builds", description="Compares several builds of triptych on one volume, in turns. "
        "Prints the cost of data sets without coarse levels and of their frames. With --pictures, "
        "checks that six pictures by splats have the same bits, with the halo and without, with "
        "full normals.")
    parser.add_argument("--triptych", action="append", required=True,
                        help="a build of the program; repeat it to compare with the first one")
    parser.add_argument("volume")
    parser.add_argument("--brick", default="", help="options of `triptych brick`, in one argument")
    parser.add_argument("--render", default="",
                        help="options of `triptych render`, in one argument; needs --pictures")
    parser.add_argument("--memory", default="128M",
                        help="memory for data, as in triptych (default: 128M)")
    parser.add_argument("--size", default="1024x1024",
                        help="picture size in pixels (default: 1024x1024)")
    parser.add_argument("--repeat", type=int, default=3, help="number of turns (default: 3)")
    parser.add_argument("--pictures", action="store_true", help="compare pictures instead of costs")
    parser.add_argument("--work", help="folder for the data sets (default: a temporary folder)")
    parser.add_argument("--json", action="store_true", help="print JSON")
    options = parser.parse_args()
    options.brick, options.render = options.brick.split(), options.render.split()
    return options


def main():
    options = parse()
    builds = [Build(path) for path in options.triptych]
    with tempfile.TemporaryDirectory(dir=options.work) as folder:
        rows = (pictures if options.pictures else costs)(builds, options, folder)
    if options.json:
        print(json.dumps(rows, indent=2))
    elif options.pictures:
        print_pictures(rows)
    else:
        print_costs(rows, options)
    same = not options.pictures or all(row["views"] == rows[0]["views"] for row in rows)
    return 0 if same else 1


if __name__ == "__main__":
    sys.exit(main())
