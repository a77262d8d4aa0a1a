"""Tests of builds without optional parts. A missing part is refused with one line that names it,
and everything else works."""
import os
import subprocess

import program


class SwitchedOff(program.ProgramTest):
    def refused(self, *command, says):
        run = subprocess.run(command, capture_output=True, text=True, check=False)
        self.assertEqual(run.returncode, 1, run.stderr)
        self.assertTrue(program.LINE.fullmatch(run.stderr), run.stderr)
        self.assertIn(says, run.stderr)

    def test_missing_opengl_is_refused(self):
        if "GL" not in program.SWITCHED_OFF:
            self.skipTest("built with OpenGL")
        program.write_nrrd("ball.nrrd", program.ball((20, 20, 20)))
        self.brick("ball.nrrd", "ball.trip")
        draw = [program.PROGRAM, "render", "ball.trip", "-o", "x.png", "--size=20x20"]
        self.refused(*draw, "--renderer=gl", says="built without OpenGL")
        self.works(*draw[1:])
        scene = [program.PROGRAM, "render", os.path.join(program.DATASETS, "donut_slice.ply"), "-o", "s.png",
                 "--size=20x20"]
        self.refused(*scene, "--renderer=gl", says="built without OpenGL")
        self.works(*scene[1:])

    def test_missing_viewer_is_refused(self):
        if "VIEW" not in program.SWITCHED_OFF:
            self.skipTest("built with the viewer")
        self.refused(program.PROGRAM, "view", says="built without the viewer")

    def test_missing_server_is_refused(self):
        if "SERVE" not in program.SWITCHED_OFF:
            self.skipTest("built with the server")
        program.write_nrrd("bowl.nrrd", program.ball((20, 20, 20)))
        self.brick("bowl.nrrd", "bowl.trip")
        self.refused(program.PROGRAM, "serve", "bowl.trip", says="built without the server")

    def test_missing_openvdb_is_refused(self):
        if "OPENVDB" not in program.SWITCHED_OFF:
            self.skipTest("built with OpenVDB")
        before = sorted(os.listdir("."))
        volume = os.path.join(program.DATASETS, "densityAndHeat.vdb")
        for output in ["brick", volume, "-o", "x.trip"], ["render", volume, "-o", "x.png"]:
            self.refused(program.PROGRAM, *output, says="built without OpenVDB")
        self.refused(program.GENERATE, "marschner-lobb", "--size=8", "-o", "v.vdb", says="built without OpenVDB")
        self.assertEqual(sorted(os.listdir(".")), before)

    def test_missing_netcdf_is_refused(self):
        if "NETCDF" not in program.SWITCHED_OFF:
            self.skipTest("built with libnetcdf")
        program.write("x.nc", b"\x89HDF\r\n\x1a\n" + bytes(100))
        self.refused(program.PROGRAM, "brick", "x.nc", "-o", "x.trip", says="nccopy")


if __name__ == "__main__":
    program.main()
