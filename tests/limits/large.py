#!/usr/bin/env python3
"""Does the work of test_memory.py at full size. It generates a volume, bricks it, draws it and flies
through it with --memory in a memory cgroup. For each stage it prints the time, the throughput, the
limit, and the maximum resident memory that the kernel reports. It fails if a stage fails or exceeds
its limit.

    cmake --preset release && cmake --build --preset release
    sudo tests/limits/large.py --work /a/folder/on/a/disk

The script needs root or its own cgroup, and disk space of 2.5 times the size of the volume. The
throughput of brick counts input and output. The throughput of render counts the bytes read.

--memory does not limit a graphics driver. The driver's memory counts as resident, all of it for a
software driver (llvmpipe). With --renderers gl the script prints this memory and does not check it."""
import argparse
import os
import shutil
import sys

import limits
from bounded import Bounded

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")


def size_bytes(text):
    units = {"K": 2**10, "M": 2**20, "G": 2**30, "T": 2**40}
    return int(float(text[:-1]) * units[text[-1]]) if text[-1] in units else int(text)


def parse():
    p = argparse.ArgumentParser(description=__doc__.split("\n\n")[0],
                                formatter_class=argparse.ArgumentDefaultsHelpFormatter)
    p.add_argument("--work", default=".", help="folder for the files, on a disk")
    p.add_argument("--build", default=os.path.join(ROOT, "build", "release"), help="build folder")
    p.add_argument("--volume", type=size_bytes, default="8G", help="bytes of voxels")
    p.add_argument("--limit", type=size_bytes, default="512M", help="limit of the memory cgroup")
    p.add_argument("--memory", type=size_bytes, default="256M", help="--memory of brick and render")
    p.add_argument("--size", default="1024x1024", help="size of the picture")
    p.add_argument("--renderers", default="cpu", help="cpu, gl, reference, with commas")
    p.add_argument("--orbit", type=int, default=3, help="number of frames in a sequence")
    p.add_argument("--flight", type=float, default=12, metavar="SECONDS",
                   help="duration of the flight with cpu at 800x600; 0 disables it")
    p.add_argument("--keep", action="store_true", help="keep the files, and use an existing volume")
    return p.parse_args()


def remove_made(o, bounded, volume):
    pictures = [os.path.join(o.work, name) for name in os.listdir(o.work)
                if name.startswith("bounded") and name.endswith(".png")]
    for path in [volume, *pictures]:
        os.remove(path)
    shutil.rmtree(bounded.data, ignore_errors=True)


def work(o, note):
    bounded = Bounded(o.work, o.limit, o.memory, note)
    shutil.rmtree(bounded.data, ignore_errors=True)  # left by an earlier run
    volume = bounded.generate(o.volume)
    try:
        bounded.brick(volume)
        for renderer in o.renderers.split(","):
            bounded.render(renderer, o.size)
            if o.orbit > 1 and renderer != "reference":
                bounded.render(renderer, o.size, "--orbit", o.orbit)
        if o.flight > 0:
            bounded.flight("--seconds", o.flight)
    finally:
        if not o.keep:
            remove_made(o, bounded, volume)


def main():
    o = parse()
    limits.use_programs(os.path.join(o.build, "triptych"),
                        os.path.join(o.build, "triptych-generate"))
    limits.options["patience"] = 24 * 3600
    try:
        work(o, lambda line: print(line, flush=True))
    except (AssertionError, OSError) as e:
        sys.exit(f"large.py: {e}")


if __name__ == "__main__":
    main()
