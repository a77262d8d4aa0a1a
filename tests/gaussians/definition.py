"""The picture of a Gaussian scene, computed from its definition (Kerbl et al. 2023) with NumPy.

Nothing here comes from Triptych's code: the test compares the two. Run it to draw a scene:

    definition.py SCENE.ply OUT.npy --eye X,Y,Z --look X,Y,Z [--up X,Y,Z] [--size WxH] [--fov DEGREES]
"""
import argparse
import math

import numpy

NEAR, LOW_PASS, LIMIT = 0.2, 0.3, 1.3


def read_ply(path):
    """Reads a binary little-endian PLY of floats as trainers write it, into arrays."""
    with open(path, "rb") as file:
        names, count = [], 0
        while True:
            words = file.readline().decode("ascii").split()
            if words[:2] == ["element", "vertex"]:
                count = int(words[2])
            elif words[0] == "property":
                assert words[1] == "float"
                names.append(words[2])
            elif words[0] == "end_header":
                break
        table = numpy.fromfile(file, "<f4", count * len(names)).reshape(count, len(names))
    columns = {name: table[:, i].astype(float) for i, name in enumerate(names)}

    def pick(*keys):
        return numpy.stack([columns[key] for key in keys], 1)

    rest = sum(name.startswith("f_rest_") for name in names) // 3
    coefficients = numpy.zeros((count, 1 + rest, 3))
    coefficients[:, 0] = pick("f_dc_0", "f_dc_1", "f_dc_2")
    for channel in range(3):
        for i in range(rest):
            coefficients[:, 1 + i, channel] = columns["f_rest_%d" % (channel * rest + i)]
    turns = pick("rot_0", "rot_1", "rot_2", "rot_3")
    return {
        "centre": pick("x", "y", "z"),
        "deviations": numpy.exp(pick("scale_0", "scale_1", "scale_2")),
        "rotation": turns / numpy.linalg.norm(turns, axis=1, keepdims=True),
        "opacity": 1 / (1 + numpy.exp(-columns["opacity"])),
        "sh": coefficients,
    }


def rotation_matrices(q):
    """Returns the matrices of unit quaternions (w, x, y, z) by turning the three unit vectors."""
    w, v = q[:, :1], q[:, 1:]
    axes = []
    for unit in numpy.eye(3):
        e = numpy.broadcast_to(unit, v.shape)
        axes.append(e + 2 * w * numpy.cross(v, e) + 2 * numpy.cross(v, numpy.cross(v, e)))
    return numpy.stack(axes, 2)


def legendre(l, m, z):
    """The associated Legendre function without its factor (1 - z^2)^(m / 2), by differentiation."""
    p = numpy.polynomial.legendre.Legendre.basis(l).convert(kind=numpy.polynomial.Polynomial)
    return (p.deriv(m) if m else p)(z)


def harmonics(count, d):
    """Real spherical harmonics with the Condon-Shortley phase, for rows of unit vectors."""
    x, y, z = d.T
    values = []
    for l in range(math.isqrt(count)):
        for m in range(-l, l + 1):
            a = abs(m)
            scale = math.sqrt((2 * l + 1) / (4 * math.pi)
                              * math.factorial(l - a) / math.factorial(l + a))
            turn = (x + 1j * y) ** a
            part = numpy.ones_like(z) if m == 0 else math.sqrt(2) * (turn.real if m > 0 else turn.imag)
            values.append((-1) ** a * scale * part * legendre(l, a, z))
    return numpy.stack(values, 1)


def basis_of(view):
    forward = view["look"] - view["eye"]
    forward = forward / numpy.linalg.norm(forward)
    right = numpy.cross(forward, view["up"])
    right = right / numpy.linalg.norm(right)
    return numpy.stack([right, numpy.cross(forward, right), forward])  # x right, y down, z forward


def order(scene, view):
    """Returns the indices of the drawn Gaussians, nearest centre first."""
    depth = (scene["centre"] - view["eye"]) @ basis_of(view)[2]
    near = 0 if view.get("ortho_height") else NEAR
    first = numpy.argsort(depth, kind="stable")
    return first[depth[first] > near]


def project(scene, view, antialiased=False):
    """Returns the screen's centres, covariances, opacities and colours of all Gaussians."""
    width, height = view["size"]
    frame = basis_of(view)
    offset = scene["centre"] - view["eye"]
    x, y, z = (offset @ frame.T).T
    jacobian = numpy.zeros((len(z), 2, 3))
    if view.get("ortho_height"):
        scale = height / view["ortho_height"]
        jacobian[:, 0, 0] = jacobian[:, 1, 1] = scale
        centre = numpy.stack([x * scale + width / 2, y * scale + height / 2], 1)
        towards = numpy.broadcast_to(frame[2], offset.shape)
    else:
        tangent_y = math.tan(math.radians(view["fov"]) / 2)
        tangent_x = tangent_y * width / height
        focal = height / 2 / tangent_y
        centre = numpy.stack([focal * x / z + width / 2, focal * y / z + height / 2], 1)
        tx = numpy.clip(x / z, -LIMIT * tangent_x, LIMIT * tangent_x)
        ty = numpy.clip(y / z, -LIMIT * tangent_y, LIMIT * tangent_y)
        jacobian[:, 0, 0] = jacobian[:, 1, 1] = focal / z
        jacobian[:, 0, 2] = -focal * tx / z
        jacobian[:, 1, 2] = -focal * ty / z
        towards = offset / numpy.linalg.norm(offset, axis=1, keepdims=True)
    half = rotation_matrices(scene["rotation"]) * scene["deviations"][:, None, :]
    on_screen = jacobian @ frame @ half
    bare = on_screen @ on_screen.transpose(0, 2, 1)
    covariance = bare + LOW_PASS * numpy.eye(2)
    opacity = scene["opacity"]
    if antialiased:
        ratio = numpy.linalg.det(bare) / numpy.linalg.det(covariance)
        opacity = opacity * numpy.sqrt(numpy.maximum(0.000025, ratio))
    basis = harmonics(scene["sh"].shape[1], towards)
    colour = numpy.maximum(0, 0.5 + numpy.einsum("ni,nic->nc", basis, scene["sh"]))
    return centre, covariance, opacity, colour


def draw(scene, view, antialiased=False):
    """Returns a picture: premultiplied red, green, blue, and opacity, without a background."""
    width, height = view["size"]
    sequence = order(scene, view)
    seen = {key: values[sequence] for key, values in scene.items()}
    centres, covariances, opacities, colours = project(seen, view, antialiased)
    inverses = numpy.linalg.inv(covariances)
    picture = numpy.zeros((height, width, 3))
    passes = numpy.ones((height, width))
    done = numpy.zeros((height, width), bool)
    for centre, covariance, inverse, opacity, colour in zip(centres, covariances, inverses,
                                                            opacities, colours):
        if opacity < 1 / 255:
            continue
        reach = numpy.sqrt(2 * math.log(255 * opacity) * numpy.diag(covariance)) + 1
        lo = numpy.clip(numpy.floor(centre - reach), 0, [width, height]).astype(int)
        hi = numpy.clip(numpy.ceil(centre + reach), 0, [width, height]).astype(int)
        if (lo >= hi).any():
            continue
        box = slice(lo[1], hi[1]), slice(lo[0], hi[0])
        dx = numpy.arange(lo[0], hi[0])[None, :] + 0.5 - centre[0]
        dy = numpy.arange(lo[1], hi[1])[:, None] + 0.5 - centre[1]
        power = -0.5 * (inverse[0, 0] * dx * dx + 2 * inverse[0, 1] * dx * dy + inverse[1, 1] * dy * dy)
        alpha = numpy.minimum(0.99, opacity * numpy.exp(power))
        counts = (alpha >= 1 / 255) & ~done[box]
        after = passes[box] * (1 - alpha)
        ends = counts & (after < 1e-4)
        adds = counts & ~ends
        picture[box] += numpy.where(adds, passes[box] * alpha, 0)[:, :, None] * colour
        passes[box] = numpy.where(adds, after, passes[box])
        done[box] |= ends
    return numpy.dstack([picture, 1 - passes])


def densities(scene, view, at):
    """Returns the mean depth and the deviation of each Gaussian along the ray of a pixel position.
    The low-pass filter widens the Gaussians parallel to the picture."""
    width, height = view["size"]
    frame = basis_of(view)
    offset = scene["centre"] - view["eye"]
    depth = offset @ frame[2]
    x, y = at[0] - width / 2, at[1] - height / 2
    if view.get("ortho_height"):
        pixel = view["ortho_height"] / height
        offset = offset - pixel * (x * frame[0] + y * frame[1])
        ray, wide = frame[2], numpy.full(len(depth), pixel)
    else:
        pixel = 2 * math.tan(math.radians(view["fov"]) / 2) / height
        ray, wide = pixel * (x * frame[0] + y * frame[1]) + frame[2], pixel * depth
    half = rotation_matrices(scene["rotation"]) * scene["deviations"][:, None, :]
    across = numpy.outer(frame[0], frame[0]) + numpy.outer(frame[1], frame[1])
    widened = half @ half.transpose(0, 2, 1) + LOW_PASS * (wide ** 2)[:, None, None] * across
    inverse = numpy.linalg.inv(widened)
    curvature = numpy.einsum("i,nij,j->n", ray, inverse, ray)
    return numpy.einsum("i,nij,nj->n", ray, inverse, offset) / curvature, curvature ** -0.5


def normal_integral(x):
    return 0.5 * numpy.vectorize(math.erfc, otypes=[float])(-x / math.sqrt(2))


def overlap_at(optical_depths, means, deviations, colours, behind_the_eye, steps=1500):
    """Integrates normal densities along a ray by many small steps of constant mixture."""
    reach = numpy.linspace(-6, 6, 60)
    lo, hi = (means - 6 * deviations).min(), (means + 6 * deviations).max()
    cuts = numpy.unique(numpy.concatenate(
        [numpy.linspace(lo, hi, steps), (means[:, None] + deviations[:, None] * reach).ravel()]))
    if behind_the_eye:
        cuts = numpy.concatenate([[-math.inf], cuts[cuts > 0]])
    upto = optical_depths[:, None] * normal_integral((cuts - means[:, None]) / deviations[:, None])
    parts = numpy.diff(upto, axis=1)
    sums = parts.sum(0)
    passes = numpy.exp(-numpy.concatenate([[0], numpy.cumsum(sums)[:-1]]))
    weights = passes * -numpy.expm1(-sums) / numpy.where(sums > 0, sums, 1)
    return (weights * parts).sum(1) @ colours


def overlap(scene, view):
    """Returns the integral of overlapping Gaussians, like draw(). Each Gaussian has the optical
    depth of its alpha. Where several overlap, their colours mix by density."""
    width, height = view["size"]
    seen = {key: values[order(scene, view)] for key, values in scene.items()}
    centres, covariances, opacities, colours = project(seen, view)
    inverses = numpy.linalg.inv(covariances)
    picture = numpy.zeros((height, width, 4))
    for y in range(height):
        for x in range(width):
            at = numpy.array([x + 0.5, y + 0.5])
            d = at - centres
            power = -0.5 * numpy.einsum("ni,nij,nj->n", d, inverses, d)
            alpha = numpy.minimum(0.99, opacities * numpy.exp(power))
            here = alpha >= 1 / 255
            if not here.any():
                continue
            means, deviations = densities({k: v[here] for k, v in seen.items()}, view, at)
            depths = -numpy.log1p(-alpha[here])
            picture[y, x, :3] = overlap_at(depths, means, deviations, colours[here],
                                           not view.get("ortho_height"))
            picture[y, x, 3] = -math.expm1(-depths.sum())
    return picture


def main():
    def vector(text):
        return numpy.array([float(part) for part in text.split(",")])

    parser = argparse.ArgumentParser()
    parser.add_argument("scene")
    parser.add_argument("out")
    parser.add_argument("--eye", type=vector, required=True)
    parser.add_argument("--look", type=vector, required=True)
    parser.add_argument("--up", type=vector, default=numpy.array([0.0, -1, 0]))
    parser.add_argument("--size", default="256x256")
    parser.add_argument("--fov", type=float, default=50)
    given = parser.parse_args()
    view = {"eye": given.eye, "look": given.look, "up": given.up, "fov": given.fov,
            "size": tuple(int(part) for part in given.size.split("x"))}
    numpy.save(given.out, draw(read_ply(given.scene), view))


if __name__ == "__main__":
    main()
