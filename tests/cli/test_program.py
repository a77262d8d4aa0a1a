"""Tests of program.py, on which the other tests rely."""
import os
import tempfile

import program


class OwnCache(program.ProgramTest):
    def test_volumes_are_bricked_into_a_new_cache(self):
        cache = os.environ.get("XDG_CACHE_HOME", os.path.expanduser("~/.cache"))
        self.assertEqual(os.path.dirname(cache), tempfile.gettempdir())
        folder = os.path.join(cache, "triptych")
        self.assertFalse(os.path.exists(folder))
        program.write_nrrd("v.nrrd", program.ball((12, 12, 12)))
        self.works("render", "v.nrrd", "-o", "v.png", "--size=8x8", "--renderer=cpu")
        self.assertEqual(len([n for n in os.listdir(folder) if n.endswith(".trip")]), 1)


if __name__ == "__main__":
    program.main()
