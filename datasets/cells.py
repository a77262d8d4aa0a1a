#!/usr/bin/env python3
"""Writes cells.ome.tif: a ball of cells with a cavity, as a confocal microscope would see it.

The stack is computed, so nobody else has rights to it. Channel 0 holds the nuclei, and some of them
divide. Channel 1 holds the membranes. The model has a blur that is longer along Z, a loss of light
with depth, and the noise of counted photons. Usage: cells.py [FILE]. Requires numpy and PIL.
"""
import sys

import numpy
from PIL import Image, TiffImagePlugin

SIZE = 64, 176, 176  # Z, Y, X
STEP = 0.6, 0.25, 0.25  # micrometres
CELLS = 60
OUTER, INNER = 18.0, 9.0  # radii of the ball and of its cavity, micrometres
SCANS = 4  # each voxel is the mean of so many scans
BLUR = 0.45, 0.16, 0.16  # standard deviations, micrometres
OME = """<?xml version="1.0" encoding="UTF-8"?>
<OME xmlns="http://www.openmicroscopy.org/Schemas/OME/2016-06">
<Image ID="Image:0" Name="cells"><Pixels ID="Pixels:0" DimensionOrder="XYZCT" Type="uint8"
SizeX="{2}" SizeY="{1}" SizeZ="{0}" SizeC="2" SizeT="1"
PhysicalSizeX="{5}" PhysicalSizeY="{4}" PhysicalSizeZ="{3}"
PhysicalSizeXUnit="&#181;m" PhysicalSizeYUnit="&#181;m" PhysicalSizeZUnit="&#181;m">
<Channel ID="Channel:0:0" Name="nuclei" SamplesPerPixel="1"/>
<Channel ID="Channel:0:1" Name="membranes" SamplesPerPixel="1"/>
<TiffData/></Pixels></Image></OME>"""


def blurred(volume, deviations):
    """Returns the volume blurred by a Gaussian; the deviations are in micrometres."""
    spectrum = numpy.fft.rfftn(volume)
    for axis, (n, step, deviation) in enumerate(zip(SIZE, STEP, deviations)):
        frequency = (numpy.fft.rfftfreq if axis == 2 else numpy.fft.fftfreq)(n, step)
        shape = [1, 1, 1]
        shape[axis] = -1
        spectrum *= numpy.exp(-2 * (numpy.pi * frequency * deviation) ** 2).reshape(shape)
    return numpy.fft.irfftn(spectrum, SIZE)


def cell_centres(random):
    """Returns points spread evenly over the middle of the shell."""
    points = random.normal(size=(CELLS, 3))
    for _ in range(1000):
        points /= numpy.linalg.norm(points, axis=1, keepdims=True)
        away = points[:, None] - points[None]
        distance = numpy.linalg.norm(away, axis=2) + numpy.eye(CELLS)
        points += 0.01 * (away / distance[..., None] ** 3).sum(axis=1)
    points /= numpy.linalg.norm(points, axis=1, keepdims=True)
    return points * random.uniform(13.0, 14.2, (CELLS, 1))


def specimen(random):
    """Returns the densities of the two dyes."""
    axes = [(numpy.arange(n) - (n - 1) / 2) * step for n, step in zip(SIZE, STEP)]
    place = numpy.stack(numpy.meshgrid(*axes, indexing="ij"), axis=-1).astype(numpy.float32)
    radius = numpy.linalg.norm(place, axis=-1)
    # Smooth noise bends the walls, and gives the nuclei their texture.
    bend = numpy.stack([blurred(random.normal(size=SIZE), (2, 2, 2)) for _ in range(3)], axis=-1)
    bent = place + 0.5 * (bend / bend.std()).astype(numpy.float32)
    texture = blurred(random.normal(size=SIZE), (0.45, 0.45, 0.45))
    texture = 1 + 0.35 * texture / texture.std()

    nuclei = numpy.zeros(SIZE)
    nearest = numpy.full(SIZE, 1e9, numpy.float32)
    second = nearest.copy()
    for number, centre in enumerate(cell_centres(random)):
        distance = numpy.linalg.norm(bent - centre.astype(numpy.float32), axis=-1)
        second = numpy.minimum(second, numpy.maximum(nearest, distance))
        nearest = numpy.minimum(nearest, distance)
        outwards = centre / numpy.linalg.norm(centre)
        spindle = numpy.cross(outwards, random.normal(size=3))
        spindle /= numpy.linalg.norm(spindle)
        near = place - centre
        along, depth = near @ spindle, near @ outwards
        across = numpy.sqrt(numpy.maximum((near ** 2).sum(axis=-1) - along ** 2, 0))
        if number % 12 == 5:  # metaphase: one plate
            nuclei[(abs(along) < 0.7) & (across < 2.6 + 0.4 * (texture - 1))] = 2.2
        elif number % 12 == 11:  # anaphase: two plates apart
            nuclei[(abs(abs(along) - 2.0) < 0.6) & (across < 2.1 + 0.4 * (texture - 1))] = 2.0
        else:
            size = random.uniform(2.2, 2.6)
            inside = (along / size) ** 2 + (across ** 2 - depth ** 2) / size ** 2 + (depth / (size + 0.5)) ** 2 < 1
            body = near - random.normal(size=3) * 0.6
            inside &= numpy.linalg.norm(body, axis=-1) > 0.7  # the nucleolus has no dye
            nuclei[inside] = texture[inside]

    wall = radius + 0.35 * bend[..., 0] / bend.std()
    ball = (wall < OUTER) & (wall > INNER)
    membranes = 0.8 * (ball & (second - nearest < 0.55))
    membranes += 1.0 * (abs(wall - OUTER) < 0.3) + 1.2 * (abs(wall - INNER) < 0.35)
    return numpy.maximum(nuclei, 0.02 * ball), membranes + 0.03 * ball


def seen(density, photons, random):
    """Returns a channel as bytes: blurred, darker with depth, and noisy."""
    depth = (numpy.arange(SIZE[0]) * STEP[0])[:, None, None]
    light = numpy.maximum(blurred(density, BLUR), 0) * photons * numpy.exp(-depth / 90) + 0.3
    return numpy.clip(random.poisson(SCANS * light) * 2 / SCANS, 0, 255).astype(numpy.uint8)


def main():
    random = numpy.random.default_rng(20)
    nuclei, membranes = specimen(random)
    channels = seen(nuclei, 60, random), seen(membranes, 90, random)
    pages = [Image.fromarray(page) for channel in channels for page in channel]
    description = TiffImagePlugin.ImageFileDirectory_v2()
    description[TiffImagePlugin.IMAGEDESCRIPTION] = OME.format(*SIZE, *STEP)
    pages[0].encoderinfo = {"tiffinfo": description}
    pages[0].save(sys.argv[1] if len(sys.argv) > 1 else "cells.ome.tif", save_all=True,
                  append_images=pages[1:], compression="tiff_adobe_deflate", tiffinfo=description)


if __name__ == "__main__":
    main()
