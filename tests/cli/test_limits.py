"""Tests that the figures of `brick --limits` agree with each other and with the files. They do not
test speed."""
import json
import os

import program


class Limits(program.ProgramTest):
    def limits(self, source, *options):
        run = self.works("brick", source, "-o", "a.trip", "--force", "--limits", "--json", *options)
        summary = json.loads(run.stdout)
        stages = {s["stage"]: s for s in summary["limits"]["stages"]}
        own = [stages[name] for name in ("scan", "read", "merge", "levels", "finish")]
        planes = sum(os.path.getsize(os.path.join("a.trip", name)) for name in os.listdir("a.trip")
                     if name != "index.trip")
        self.assertAlmostEqual(sum(s["seconds"] for s in own), summary["seconds"], 6)
        self.assertEqual(sum(s["bytes_written"] for s in own), planes + summary["temporary_bytes"])
        index = os.path.getsize("a.trip/index.trip")
        self.assertEqual(stages["plain write"]["bytes_written"], planes + index)
        self.assertGreater(stages["plain write"]["seconds"], 0)
        return summary, stages

    def test_the_ratio_equals_the_quotient_of_the_times(self):
        source = os.path.join(program.DATASETS, "stent.nrrd")
        with open("block.raw", "wb") as f:
            f.write(bytes(range(256)) * 4096)
        options = "--size=128,128,64", "--type=uint8"
        summary, stages = self.limits("block.raw", *options, "--range=10:200")
        plain = stages["plain read"]["seconds"] + stages["plain write"]["seconds"]
        self.assertAlmostEqual(summary["limits"]["ratio"], summary["seconds"] / plain, 6)
        self.assertEqual(stages["plain read"]["bytes_read"], 1 << 20)
        self.assertEqual(stages["read"]["bytes_read"], 1 << 20)
        self.assertIn("ratio", self.limits(source)[0]["limits"])

    def passes(self, type_name, *options):
        size = "--size=32,32,64" if type_name == "uint8" else "--size=32,32,32"
        stages = self.limits("ramp.raw", size, f"--type={type_name}", "--endian=little", *options)[1]
        self.assertEqual(stages["read"]["bytes_read"], 1 << 16)
        return 1 + stages["scan"]["bytes_read"] / (1 << 16)

    def test_a_second_pass_runs_only_if_needed(self):
        with open("ramp.raw", "wb") as f:
            f.write(b"".join(i.to_bytes(2, "little") for i in range(1 << 15)))
        for type_name in "uint8", "uint16":
            for envelope, passes in ("--range=9:90", 1), ("--keep-all", 1), ("--tf=preset:grey", 2):
                self.assertEqual(self.passes(type_name, envelope, "--normals=none"), passes, envelope)
            self.assertEqual(self.passes(type_name), 2)
        # Stored normals need the gradient of full shading, which depends on the range of the values.
        # The type gives this range for 8 bits, but not for 16 bits.
        for normals, passes in ("stored", 2), ("auto", 1):
            normals = f"--normals={normals}"
            self.assertEqual(self.passes("uint8", "--range=9:90", normals), 1)
            self.assertEqual(self.passes("uint16", "--range=9:90", normals), passes)

    def test_a_header_beside_its_data_has_no_plain_read(self):
        summary, stages = self.limits(os.path.join(program.DATASETS, "tooth.nhdr"))
        self.assertNotIn("plain read", stages)
        self.assertNotIn("ratio", summary["limits"])

    def test_limits_print_a_table(self):
        run = self.works("brick", os.path.join(program.DATASETS, "stent.nrrd"), "-o", "a.trip",
                         "--force", "--limits")
        for word in b"scan", b"read", b"merge", b"finish", b"plain read", b"plain write", b"times":
            self.assertIn(word, run.stdout)


if __name__ == "__main__":
    program.main()
