"""Draws one volume by one of VTK's mappers, as JSON lines say on standard input:
  {"mapper": "cpu" | "gpu", "volume": FILE.npy, "index_to_world": 3 x 4, "function": [[value, r, g, b,
   opacity], ...], "shading": bool, "threads": N,
   "step": voxels}
then any number of
  {"eye": .., "look": .., "up": .., "fov_degrees": .., "size": N, "picture": FILE.png | null}
and answers each by a line: {"version", "device"}, then {"ms", "display_ms"}."""
import json
import math
import os
import sys
import time

import numpy as np
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401, the windows and mappers behind the names below
import vtkmodules.vtkRenderingVolumeOpenGL2
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonCore import vtkVersion
from vtkmodules.vtkCommonDataModel import vtkImageData, vtkPiecewiseFunction
from vtkmodules.vtkCommonMath import vtkMatrix4x4
from vtkmodules.vtkIOImage import vtkPNGWriter
from vtkmodules.vtkRenderingCore import (vtkColorTransferFunction, vtkLight, vtkRenderer,
                                         vtkRenderWindow,
                                         vtkVolume, vtkVolumeProperty, vtkWindowToImageFilter)
from vtkmodules.vtkRenderingVolume import vtkFixedPointVolumeRayCastMapper

# Triptych's light, render/shade.h.
AMBIENT, DIFFUSE, SPECULAR, SHININESS = 0.3, 0.7, 0.2, 24


def make_image(job):
    """The volume with its spacing, and the rest of its placement as a matrix."""
    values = np.load(job["volume"], mmap_mode=None)
    affine = np.array(job["index_to_world"])
    spacing = np.linalg.norm(affine[:, :3], axis=0)
    image = vtkImageData()
    image.SetDimensions(values.shape[::-1])
    image.SetSpacing(spacing)
    image.GetPointData().SetScalars(numpy_to_vtk(values.reshape(-1), deep=False))
    matrix = vtkMatrix4x4()
    for row in range(3):
        for column in range(3):
            matrix.SetElement(row, column, affine[row, column] / spacing[column])
        matrix.SetElement(row, 3, affine[row, 3])
    voxel = float(np.prod(spacing) ** (1 / 3))
    return image, matrix, voxel, values  # VTK does not own the values


def make_property(job, voxel):
    colour, opacity = vtkColorTransferFunction(), vtkPiecewiseFunction()
    for value, red, green, blue, alpha in job["function"]:
        colour.AddRGBPoint(value, red, green, blue)
        opacity.AddPoint(value, alpha)
    look = vtkVolumeProperty()
    look.SetColor(colour)
    look.SetScalarOpacity(opacity)
    look.SetScalarOpacityUnitDistance(voxel)
    look.SetInterpolationTypeToLinear()
    look.SetShade(job["shading"])
    look.SetAmbient(AMBIENT)
    look.SetDiffuse(DIFFUSE)
    look.SetSpecular(SPECULAR)
    look.SetSpecularPower(SHININESS)
    return look


def make_mapper(job, voxel):
    """One sample every `step` voxels and one ray a pixel, whatever the time it takes."""
    distance = job["step"] * voxel
    if job["mapper"] == "cpu":
        mapper = vtkFixedPointVolumeRayCastMapper()
        mapper.SetNumberOfThreads(job["threads"])
        mapper.SetInteractiveSampleDistance(distance)
    else:
        mapper = vtkmodules.vtkRenderingVolumeOpenGL2.vtkOpenGLGPUVolumeRayCastMapper()
        mapper.SetUseJittering(False)
        mapper.SetMaxMemoryInBytes(4 << 30)
    mapper.SetAutoAdjustSampleDistances(False)
    mapper.SetImageSampleDistance(1)
    mapper.SetSampleDistance(distance)
    return mapper


def make_headlight():
    """VTK's own has no ambient part, without which its ray caster draws darker than its GPU mapper."""
    light = vtkLight()
    light.SetLightTypeToHeadlight()
    light.SetAmbientColor(1, 1, 1)
    return light


class Stage:
    def __init__(self, job):
        image, matrix, voxel, self.values = make_image(job)
        self.mapper = make_mapper(job, voxel)
        self.mapper.SetInputData(image)
        self.volume = vtkVolume()
        self.volume.SetMapper(self.mapper)
        self.volume.SetProperty(make_property(job, voxel))
        self.volume.SetUserMatrix(matrix)
        self.renderer = vtkRenderer()
        self.renderer.AddVolume(self.volume)
        self.renderer.AddLight(make_headlight())
        self.window = vtkRenderWindow()
        self.window.SetOffScreenRendering(True)
        self.window.SetMultiSamples(0)
        self.window.SetAlphaBitPlanes(True)
        self.window.AddRenderer(self.renderer)
        self.display = job["mapper"] == "cpu"

    def device(self):
        self.window.Render()  # before it, there is no context
        facts = dict(line.split(":", 1) for line in self.window.ReportCapabilities().splitlines()
                     if ":" in line and line.startswith("OpenGL"))
        return "%s, OpenGL %s" % (facts["OpenGL renderer string"].strip(),
                                  facts["OpenGL version string"].strip())

    def angle(self, view):
        """The ray caster's picture is larger by a pixel than that of the view: the first and the
        last of N rays along an edge are as far apart as N pixels are wide. The angle makes up for it."""
        if not self.display:
            return view["fov_degrees"]
        slope = math.tan(math.radians(view["fov_degrees"]) / 2)
        return math.degrees(2 * math.atan(slope * view["size"] / (view["size"] - 1)))

    def look_from(self, view):
        camera = self.renderer.GetActiveCamera()
        camera.SetPosition(view["eye"])
        camera.SetFocalPoint(view["look"])
        camera.SetViewUp(view["up"])
        camera.SetViewAngle(self.angle(view))
        if self.window.GetSize() != (view["size"], view["size"]):
            self.window.SetSize(view["size"], view["size"])
        self.renderer.ResetCameraClippingRange()

    def draw(self, view):
        start = time.perf_counter()
        self.look_from(view)
        self.window.Render()
        self.window.WaitForCompletion()
        drawn = time.perf_counter()
        result = {"ms": (drawn - start) * 1e3, "display_ms": 0}
        if self.display:
            # Once more, alone: what of the frame was showing the finished picture by OpenGL.
            self.mapper.DisplayRenderedImage(self.renderer, self.volume)
            self.window.WaitForCompletion()
            result["display_ms"] = (time.perf_counter() - drawn) * 1e3
        return result

    def save(self, path):
        self.window.Render()
        grab = vtkWindowToImageFilter()
        grab.SetInput(self.window)
        grab.SetInputBufferTypeToRGBA()
        grab.ReadFrontBufferOff()
        writer = vtkPNGWriter()
        writer.SetFileName(path)
        writer.SetInputConnection(grab.GetOutputPort())
        writer.Write()


def main():
    # VTK writes its warnings to standard output's file too; answers keep the original one.
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)

    def answer(what):
        print(json.dumps(what), file=answers, flush=True)

    stage = Stage(json.loads(sys.stdin.readline()))
    answer({"version": vtkVersion.GetVTKVersion(), "device": stage.device()})
    for line in sys.stdin:
        view = json.loads(line)
        answer(stage.draw(view))
        if view.get("picture"):
            stage.save(view["picture"])
            answer({})


if __name__ == "__main__":
    main()
