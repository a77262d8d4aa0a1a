#!/usr/bin/env python3
"""Draws one volume by one of VTK's mappers, for tests/compare and `triptych accuracy --compare`.

The program reads JSON lines from standard input and answers each by a JSON line on standard output.
The first line describes the volume:
  {"volume": FILE, "dims": [i, j, k], "index_to_world": 3 x 4, "tf": TEXT, "shading": bool,
   "threads": N, "mapper": "cpu" | "gpu", "step": voxels}
FILE is a .npy, a NRRD or a NIfTI file. TEXT is a transfer function as printed by `triptych tf show`.
"function" may replace "tf" with a list of points [value, r, g, b, opacity per voxel].
The options --step VOXELS and --mapper cpu|gpu override this line. The answer is
  {"name", "version", "device"}.
Each further line describes a view:
  {"eye": .., "look": .., "up": .., "fov_degrees" or "ortho_height": .., "size": N or [W, H],
   "picture": FILE or null}
The answer is {"ms", "display_ms"}, followed by {} when the picture is written. The picture is a .png
file, or a .raw file with rows of RGBA bytes from top to bottom."""
import argparse
import json
import math
import os
import sys
import time

import numpy as np
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401, registers the windows and mappers
import vtkmodules.vtkRenderingVolumeOpenGL2
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkVersion
from vtkmodules.vtkCommonDataModel import vtkImageData, vtkPiecewiseFunction
from vtkmodules.vtkCommonMath import vtkMatrix4x4
from vtkmodules.vtkIOImage import vtkNIFTIImageReader, vtkNrrdReader, vtkPNGWriter
from vtkmodules.vtkRenderingCore import (vtkColorTransferFunction, vtkLight, vtkRenderer,
                                         vtkRenderWindow,
                                         vtkVolume, vtkVolumeProperty, vtkWindowToImageFilter)
from vtkmodules.vtkRenderingVolume import vtkFixedPointVolumeRayCastMapper

# Triptych's light, render/light/shade.h.
AMBIENT, DIFFUSE, SPECULAR, SHININESS = 0.3, 0.7, 0.2, 24


def read_by_vtk(path, dims):
    """Returns the values. The job has the positions of the voxels."""
    lower = path.lower()
    if lower.endswith((".nrrd", ".nhdr")):
        reader = vtkNrrdReader()
    elif lower.endswith((".nii", ".nii.gz")):
        reader = vtkNIFTIImageReader()
    else:
        raise SystemExit("VTK reads only NRRD and NIfTI files here, not " + path)
    reader.SetFileName(path)
    reader.Update()
    scalars = reader.GetOutput().GetPointData().GetScalars()
    if scalars is None or list(reader.GetOutput().GetDimensions()) != list(dims):
        raise SystemExit("VTK cannot read " + path)
    return vtk_to_numpy(scalars).reshape(dims[::-1])


def make_image(job):
    """Returns the volume with its spacing, its position and rotation as a matrix, and its voxel size."""
    if job["volume"].endswith(".npy"):
        values = np.load(job["volume"], mmap_mode=None)
    else:
        values = np.ascontiguousarray(read_by_vtk(job["volume"], job["dims"]))
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
    return image, matrix, voxel, values  # the caller keeps the values, because VTK does not own them


def read_function(text, voxel):
    """Returns the points of a `.tf` text in data units, with opacity per voxel."""
    points, unit = [], voxel
    for line in text.splitlines():
        words = line.split("#")[0].split()
        if words[:1] == ["unit"]:
            unit = voxel if words[1] == "voxel" else float(words[1])
        elif len(words) == 5:
            points.append([float(word) for word in words])
    for point in points:
        point[4] = 1 - (1 - min(point[4], 0.9999)) ** (voxel / unit)
    return points


def make_property(job, voxel):
    colour, opacity = vtkColorTransferFunction(), vtkPiecewiseFunction()
    points = job["function"] if "function" in job else read_function(job["tf"], voxel)
    for value, red, green, blue, alpha in points:
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
    """Makes a mapper with a sample every `step` voxels and one ray per pixel, however long it takes."""
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
    """Makes a headlight with an ambient part. VTK's default headlight has none, and its ray caster
    then draws darker than its GPU mapper."""
    light = vtkLight()
    light.SetLightTypeToHeadlight()
    light.SetAmbientColor(1, 1, 1)
    return light


def size_of(view):
    size = view["size"]
    return tuple(size) if isinstance(size, list) else (size, size)


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
        self.window.Render()  # creates the context
        facts = dict(line.split(":", 1) for line in self.window.ReportCapabilities().splitlines()
                     if ":" in line and line.startswith("OpenGL"))
        return "%s, OpenGL %s" % (facts["OpenGL renderer string"].strip(),
                                  facts["OpenGL version string"].strip())

    def angle(self, view):
        """Returns the angle of view that compensates for the ray caster. It spreads N rays along an
        edge over the width of N pixels, so that its picture would be larger by a pixel."""
        slope = math.tan(math.radians(view["fov_degrees"]) / 2) * self.growth(view)
        return math.degrees(2 * math.atan(slope))

    def growth(self, view):
        height = size_of(view)[1]
        return height / (height - 1) if self.display else 1

    def look_from(self, view):
        camera = self.renderer.GetActiveCamera()
        camera.SetPosition(view["eye"])
        camera.SetFocalPoint(view["look"])
        camera.SetViewUp(view["up"])
        if view.get("ortho_height"):
            camera.ParallelProjectionOn()
            camera.SetParallelScale(view["ortho_height"] / 2 * self.growth(view))
        else:
            camera.ParallelProjectionOff()
            camera.SetViewAngle(self.angle(view))
        if self.window.GetSize() != size_of(view):
            self.window.SetSize(*size_of(view))
        self.renderer.ResetCameraClippingRange()

    def draw(self, view):
        start = time.perf_counter()
        self.look_from(view)
        self.window.Render()
        self.window.WaitForCompletion()
        drawn = time.perf_counter()
        result = {"ms": (drawn - start) * 1e3, "display_ms": 0}
        if self.display:
            # Displays the finished picture by OpenGL again, to time this part of the frame alone.
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
        if path.endswith(".raw"):
            grab.Update()
            image = grab.GetOutput()
            width, height, _ = image.GetDimensions()
            pixels = vtk_to_numpy(image.GetPointData().GetScalars()).reshape(height, width, 4)
            np.ascontiguousarray(pixels[::-1]).tofile(path)
            return
        writer = vtkPNGWriter()
        writer.SetFileName(path)
        writer.SetInputConnection(grab.GetOutputPort())
        writer.Write()


def main():
    # VTK prints warnings to standard output. They go to stderr, and only answers to stdout.
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)

    def answer(what):
        print(json.dumps(what), file=answers, flush=True)

    options = argparse.ArgumentParser()
    options.add_argument("--step", type=float)
    options.add_argument("--mapper", choices=["cpu", "gpu"])
    given = options.parse_args()
    job = {"mapper": "cpu", "step": 1, **json.loads(sys.stdin.readline())}
    job.update({key: value for key, value in vars(given).items() if value is not None})
    stage = Stage(job)
    answer({"name": "vtk-%s-step-%g" % (job["mapper"], job["step"]), "version": vtkVersion.GetVTKVersion(), "device": stage.device()})
    for line in sys.stdin:
        view = json.loads(line)
        answer(stage.draw(view))
        if view.get("picture"):
            stage.save(view["picture"])
            answer({})


if __name__ == "__main__":
    main()
