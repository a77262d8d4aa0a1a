#!/usr/bin/env python3
"""Writes corner/: range images of the corner of a room with a shiny ball and a box.

The images are computed, so nobody else has rights to them. Five depth cameras stand on an arc. Their
distances have the noise of a Kinect (Nguyen et al. 2012), in steps of a millimetre. The layout is
the one of 7-Scenes. Tests import this file for the exact surfaces and colours.
Usage: corner.py [FOLDER]. Requires numpy and PIL.
"""
import os
import sys

import numpy
from PIL import Image

SIZE = 160, 120
FOCAL = 146.25
ANGLES = -40, -20, 0, 20, 40  # degrees about the ball
BALL, BALL_RADIUS = numpy.array([0.1, 0.35, 2.3]), 0.35
BOX = numpy.array([[-0.95, 0.1, 2.2], [-0.45, 0.7, 2.7]])
# Planes: a point, and the normal that points into the room. y points down.
PLANES = [([0, 0.7, 0], [0, -1, 0]), ([0, 0, 3], [0, 0, -1]), ([-1.4, 0, 0], [1, 0, 0])]
LIGHT = numpy.array([-0.3, -0.8, -0.5]) / numpy.linalg.norm([-0.3, -0.8, -0.5])


def pose_at(degrees, distance=2.0, target=(0, 0.3, 2.4), height=-0.4):
    """Returns the matrix from the camera (x right, y down, z forward) to the room."""
    angle = numpy.radians(degrees)
    eye = numpy.array(target) + [distance * numpy.sin(angle), height, -distance * numpy.cos(angle)]
    forward = numpy.array(target) - eye
    forward /= numpy.linalg.norm(forward)
    right = numpy.cross([0, 1, 0], forward)
    right /= numpy.linalg.norm(right)
    pose = numpy.eye(4)
    pose[:3, :4] = numpy.column_stack([right, numpy.cross(forward, right), forward, eye])
    return pose


def trace(eye, rays):
    """Returns the distance along each ray in ray lengths, the normal, and the number of the surface:
    0 to 2 for planes, 3 for the ball, 4 for the box. Rays that miss have an infinite distance."""
    far = numpy.full(rays.shape[:-1], numpy.inf)
    normals, surface = numpy.zeros(rays.shape), numpy.full(far.shape, -1)

    def keep(t, normal, number):
        nonlocal far
        nearer = (t > 1e-6) & (t < far)
        normals[nearer] = numpy.broadcast_to(normal, rays.shape)[nearer]
        surface[nearer] = number
        far = numpy.where(nearer, t, far)

    with numpy.errstate(divide="ignore", invalid="ignore"):
        for number, (point, normal) in enumerate(PLANES):
            t = numpy.dot(numpy.subtract(point, eye), normal) / (rays @ numpy.array(normal, float))
            keep(t, numpy.array(normal, float), number)
        a, b = (rays * rays).sum(-1), rays @ (eye - BALL)
        root = numpy.sqrt(b * b - a * (numpy.dot(eye - BALL, eye - BALL) - BALL_RADIUS ** 2))
        t = (-b - root) / a
        keep(numpy.nan_to_num(t, nan=-1), (eye + rays * t[..., None] - BALL) / BALL_RADIUS, 3)
        sides = (BOX[:, None, None] - eye) / rays
        near, last = sides.min(0), sides.max(0).min(-1)
        axis = near.argmax(-1)
        t = numpy.where(near.max(-1) < last, near.max(-1), -1)
        keep(t, -numpy.sign(rays) * numpy.eye(3)[axis], 4)
    return far, normals, surface


def colour_of(points, normals, surface, eye):
    """Returns the colours, with a highlight on the ball that depends on the eye."""
    base = numpy.zeros(points.shape)
    check = (numpy.floor(points[..., 0] * 5) + numpy.floor(points[..., 2] * 5)) % 2
    stripe = (numpy.floor((points[..., 0] + points[..., 1]) * 8)) % 2
    base[surface == 0] = [0.65, 0.55, 0.4]
    base[surface == 0] -= 0.25 * check[surface == 0][:, None]
    base[surface == 1] = [0.35, 0.5, 0.7]
    base[surface == 1] += 0.2 * stripe[surface == 1][:, None]
    base[surface == 2] = [0.75, 0.3, 0.25]
    base[surface == 3] = [0.2, 0.55, 0.3]
    base[surface == 4] = [0.8, 0.7, 0.25]
    shade = 0.45 + 0.55 * numpy.maximum(0, -(normals @ -LIGHT))
    view = eye - points
    view /= numpy.linalg.norm(view, axis=-1, keepdims=True)
    half = view + LIGHT
    half /= numpy.linalg.norm(half, axis=-1, keepdims=True)
    shine = numpy.maximum(0, (half * normals).sum(-1)) ** 20 * (surface == 3)
    return numpy.clip(base * shade[..., None] + 0.8 * shine[..., None], 0, 1)


def rays_of(pose, size=SIZE, focal=FOCAL):
    """Returns the rays of all pixels, of length 1 along the optical axis, and their cosine with it."""
    u, v = numpy.meshgrid(numpy.arange(size[0]), numpy.arange(size[1]))
    local = numpy.stack([(u - size[0] / 2) / focal, (v - size[1] / 2) / focal,
                         numpy.ones(u.shape)], axis=-1)
    return local @ pose[:3, :3].T


def photograph(pose, size=SIZE, focal=FOCAL):
    """Returns distances along the optical axis, colours, normals and numbers of surfaces."""
    rays = rays_of(pose, size, focal)
    z, normals, surface = trace(pose[:3, 3], rays)
    points = pose[:3, 3] + rays * numpy.where(numpy.isfinite(z), z, 0)[..., None]
    colours = colour_of(points, normals, surface, pose[:3, 3])
    colours[surface < 0] = 0
    return z, colours, normals, surface


def write(folder, angles=ANGLES, noisy=True):
    random = numpy.random.default_rng(3)
    os.makedirs(folder, exist_ok=True)
    numpy.savetxt(os.path.join(folder, "camera-intrinsics.txt"),
                  [[FOCAL, 0, SIZE[0] / 2], [0, FOCAL, SIZE[1] / 2], [0, 0, 1]], fmt="%.6g")
    for number, angle in enumerate(angles):
        pose = pose_at(angle)
        z, colours, _, _ = photograph(pose)
        z = numpy.where(z < 4, z, 0)
        if noisy:
            z += random.normal(size=z.shape) * (0.0012 + 0.0019 * (z - 0.4) ** 2) * (z > 0)
        name = os.path.join(folder, f"frame-{number:06d}")
        millimetres = numpy.round(z * 1000).astype(numpy.uint16)
        Image.fromarray(millimetres).save(name + ".depth.png", optimize=True)
        Image.fromarray(numpy.round(colours * 255).astype(numpy.uint8)).save(
            name + ".color.png", optimize=True)
        numpy.savetxt(name + ".pose.txt", pose, fmt="%.9f")


if __name__ == "__main__":
    write(sys.argv[1] if len(sys.argv) > 1 else os.path.join(os.path.dirname(__file__), "corner"))
