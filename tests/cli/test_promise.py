"""Tests that pictures keep the promise of their quality: the mean error against the exact picture of
the integral renderer, over the pixels that the object covers."""
import os

import numpy

import program

PROMISES = {"draft": 4, "normal": 1, "high": 0.3}
EXACT = "--renderer", "integral", "--tolerance", 0.003  # leaves a mean of about 0.1 of 255
FUNCTIONS = {
    "gentle": "values data\n0 0 0 0 0\n255 1 0.8 0.6 0.1\n",
    "step": "values data\n0 0.2 0.4 1 0\n119 0.2 0.4 1 0\n121 1 0.7 0.3 0.9\n255 1 0.7 0.3 0.9\n",
    "stripes": "values data\n" + "".join(
        f"{10 * i + 60} 1 {i % 3 / 2} 0.5 {0.3 * (i % 2)}\n" for i in range(20)),
}


def ripples(n):
    """Returns waves that are about 5 voxels long, in a ball."""
    z, y, x = numpy.meshgrid(*[numpy.linspace(-1, 1, n)] * 3, indexing="ij")
    r = numpy.sqrt(x * x + y * y + z * z)
    waves = numpy.sin(n * x / 1.7) + numpy.sin(n * y / 1.9) + numpy.sin(n * z / 1.6)
    return (numpy.clip(1.2 - r, 0, 1) * (127 + 40 * waves)).round().clip(0, 255).astype("u1")


class Promise(program.ProgramTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        program.write_nrrd("v.nrrd", ripples(32))
        run = program.call("brick", "v.nrrd", "-o", "v.trip", "-q", "--keep-all", "--tile", 16)
        assert run.returncode == 0, run.stderr
        for name, text in FUNCTIONS.items():
            with open(f"{name}.tf", "w", encoding="utf-8") as f:
                f.write(text)

    def quality(self, *options):
        """Returns the part of --stats that is about the quality."""
        return self.stats("v.trip", "--renderer", "cpu", *options)["quality"]

    def test_means_of_errors_are_within_the_promise(self):
        for name in FUNCTIONS:
            for size in 16, 48:
                view = ("--tf", f"{name}.tf", "--size", size)
                exact = self.picture("v.trip", *view, *EXACT)
                object_ = exact[..., 3] > 0.5 / 255
                for quality, promise in PROMISES.items():
                    drawn = self.picture("v.trip", *view, "--renderer", "cpu",
                                         "--quality", quality)
                    mean = 255 * abs(drawn - exact)[object_].mean()
                    self.assertLess(mean, promise, (name, size, quality))

    def test_the_default_alone_would_break_it(self):
        """Without choices, the same pictures are farther away. So the test above can fail."""
        view = ("--tf", "step.tf", "--size", 16)
        exact = self.picture("v.trip", *view, *EXACT)
        drawn = self.picture("v.trip", *view, "--renderer", "cpu", "--samples", 1, "--lod", 0,
                             "--samples-per-sheet", 2)
        self.assertGreater(255 * abs(drawn - exact)[exact[..., 3] > 0.5 / 255].mean(), 1)

    def test_given_numbers_draw_the_same_bits_as_chosen_ones(self):
        view = ("--renderer", "cpu", "--tf", "step.tf", "--size", 16)
        chosen = self.stats("v.trip", *view)
        lod = chosen.get("lod_px", 0)
        given = self.picture("v.trip", *view, "--samples", chosen["samples"], "--lod", repr(lod),
                             "--samples-per-sheet", chosen["samples_per_sheet"])
        self.assertTrue((given == self.picture("v.trip", *view)).all())

    def test_threads_memory_and_trials_change_no_bit(self):
        view = ("--renderer", "cpu", "--tf", "stripes.tf", "--size", 40)
        pictures = []
        for i, options in enumerate(((), ("--threads", 1), ("--threads", 3), ("--memory", "48M"))):
            os.environ["XDG_CACHE_HOME"] = os.path.abspath(f"cache{i}")  # each makes its own trial
            pictures.append(self.picture("v.trip", *view, *options))
        for picture in pictures[1:]:
            self.assertTrue((picture == pictures[0]).all())

    def test_the_cache_keeps_trials(self):
        os.environ["XDG_CACHE_HOME"] = os.path.abspath("kept")
        view = ("--tf", "gentle.tf", "--size", 40)
        first, second = (self.quality(*view) for _ in range(2))
        self.assertEqual((first["trials"], second["trials"]), (1, 0))
        self.assertEqual(first["expected_error"], second["expected_error"])
        self.assertEqual(self.quality(*view, "--size", 41)["trials"], 0)
        self.assertEqual(self.quality(*view, "--no-shading")["trials"], 1)

    def test_damaged_files_of_the_cache_cost_a_trial(self):
        os.environ["XDG_CACHE_HOME"] = os.path.abspath("damaged")
        view = ("--tf", "step.tf", "--size", 32)
        drawn = self.picture("v.trip", "--renderer", "cpu", *view)
        files = [os.path.join(folder, name) for folder, _, names in os.walk("damaged")
                 for name in names]
        self.assertTrue(files)
        for text in b"", b"triptych-quality 1\n0 1", b"\xff" * 4096, b"triptych-quality 9\n":
            for path in files:
                program.write(path, text)
            again = self.picture("v.trip", "--renderer", "cpu", *view)
            self.assertTrue((again == drawn).all(), text)


if __name__ == "__main__":
    program.main()
