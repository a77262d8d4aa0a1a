"""Bricks a volume many times the size of a memory cgroup, draws it and flies through it. Each stage
has a cgroup of its own. test_memory.py does this at a small scale, large.py at any scale."""
import json
import os

import limits
from memory_group import Group

SLACK_BYTES = 64 * 2**20  # the program itself, with code, stacks and libraries
RANGE = "0.18:"  # this range holds a little more than a tenth of the voxels of `shells`, at every size


class Stage:
    """One run of a program, and the memory that the kernel reports for it."""

    def __init__(self, what, outcome, group, promise_bytes, driver):
        self.what, self.outcome, self.driver = what, outcome, driver
        self.seconds, self.peak_bytes = outcome.seconds, outcome.peak_bytes
        self.group_peak_bytes, self.limit_bytes = group.peak_bytes(), group.limit_bytes
        self.promise_bytes = promise_bytes

    def problem(self):
        """Returns why the stage failed or exceeded its limit, or None."""
        if self.outcome.status or self.outcome.err:
            return f"{self.what}: exit status {self.outcome.status}: {self.outcome.err.strip()}"
        if not self.driver and self.peak_bytes > self.promise_bytes + SLACK_BYTES:
            return f"{self.what}: more memory was resident than --memory allows"
        return None

    def line(self, moved_bytes):
        rate = f"{moved_bytes / 1e9 / self.seconds:6.2f} GB/s" if moved_bytes else " " * 11
        return (f"{self.what:<24}{self.seconds:8.1f} s {rate}"
                f"   resident {limits.text_bytes(self.peak_bytes):>10} of "
                f"{limits.text_bytes(self.promise_bytes)} + {limits.text_bytes(SLACK_BYTES)}"
                f"{' and the driver' if self.driver else ''}   group with page cache "
                f"{limits.text_bytes(self.group_peak_bytes):>10} of "
                f"{limits.text_bytes(self.limit_bytes)}")


class Bounded:
    """Passes each line of the report to `note`. The first stage that fails raises
    AssertionError."""

    def __init__(self, folder, limit_bytes, memory_bytes, note):
        self.folder, self.note = folder, note
        self.limit_bytes, self.memory_bytes = limit_bytes, memory_bytes
        self.data = os.path.join(folder, "bounded.trip")

    def stage(self, what, *arguments, driver=False):
        with Group(self.limit_bytes) as group:
            outcome = limits.run("triptych", *arguments, "--memory", self.memory_bytes,
                                 preexec_fn=group.enter)
            return Stage(what, outcome, group, self.memory_bytes, driver)

    def judge(self, stage):
        problem = stage.problem()
        assert problem is None, problem

    def generate(self, volume_bytes):
        """Generates a volume of floats of at least this size, outside the group. Keeps an existing
        file."""
        n = 2
        while n**3 * 4 < volume_bytes:
            n += 1
        path = os.path.join(self.folder, f"shells-{n}.nrrd")
        if not os.path.exists(path):
            r = limits.run("triptych-generate", "shells", "--size", n, "--type", "float", "-o", path)
            assert r.status == 0, r.err
            self.note(f"{'generate':<24}{r.seconds:8.1f} s "
                      f"{os.path.getsize(path) / 1e9 / r.seconds:6.2f} GB/s   resident "
                      f"{limits.text_bytes(r.peak_bytes):>10}")
        return path

    def brick(self, volume):
        stage = self.stage("brick", "brick", volume, "-o", self.data, "--json", "--range", RANGE)
        self.judge(stage)
        made = json.loads(stage.outcome.out)
        self.note(stage.line(made["input_bytes"] + made["bytes"]))
        share = 100 * made["kept"] / made["voxels"]
        self.note(f"    {limits.text_bytes(made['input_bytes'])} read, {share:.1f} % of the voxels "
                  f"kept, {limits.text_bytes(made['temporary_bytes'])} spilled, "
                  f"{limits.text_bytes(made['bytes'])} written")
        assert made["kept"] >= 0.1 * made["voxels"], "less than a tenth of the voxels was kept"
        return made

    def render(self, renderer, size, *arguments):
        """Draws from the disk, not from the page cache. The memory of a graphics driver has no
        limit."""
        limits.forget_pages(self.data)
        what = " ".join(["render", renderer, *map(str, arguments)])
        stage = self.stage(what, "render", self.data, "-o",
                           os.path.join(self.folder, "bounded.png"), "--renderer", renderer,
                           "--size", size, "--stats", "-", *arguments, driver=renderer == "gl")
        self.judge(stage)
        frames = json.loads(stage.outcome.out)["frames"]
        lists = [one for frame in frames for one in frame["lists"].values()]
        self.note(stage.line(sum(one["bytes_read"] for one in lists)))
        return frames

    def flight(self, *arguments):
        """Runs `bench flight` from the disk, which draws like the viewer while the eye moves.
        Returns its JSON. The picture at rest must equal the picture of render."""
        limits.forget_pages(self.data)
        stage = self.stage("flight", "bench", "flight", self.data, "--renderer", "cpu", "--json",
                           *arguments)
        self.judge(stage)
        flown = json.loads(stage.outcome.out)
        self.note(stage.line(0))
        for part in flown["tables"]["parts"]["rows"]:
            self.note("    {part:<10}{fps:6.1f} pictures a second; ms between: median {ms:.1f}, "
                      "99 % {ms_99:.1f}, maximum {ms_max:.1f}; from input: median {age_ms:.1f}, "
                      "99 % {age_ms_99:.1f}".format(**part))
        rest = flown["tables"]["rest"]["rows"][0]
        self.note("    first picture {first_ms:.0f} ms, whole picture {first_whole_ms:.0f}, whole "
                  "after the flight {rest_ms:.0f}".format(**rest))
        assert rest["differ"] == 0, "the picture at rest differs from the picture of render"
        assert rest["peak_bytes"] <= rest["limit_bytes"], "more memory was taken than --memory allows"
        return flown
