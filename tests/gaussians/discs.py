"""The picture of a cloud of points as opaque discs: each ray shows the nearest disc that it hits.
A ray caster in double precision with NumPy, and the differences of a picture from it.

Nothing here comes from Triptych's code. The discs follow from the points as docs/points.md says.
tests/compare/clouds.py and test_discs.py compare the program with it.
"""
import math

import numpy

NEIGHBOURS, SPREAD, MOST_RADII = 12, 1.7, 16
TYPES = {"float": "f4", "float32": "f4", "double": "f8", "float64": "f8", "uchar": "u1", "uint8": "u1"}


def read_ply(path):
    """Reads the vertices of a binary little-endian PLY: positions, and normals and colours (0 to 1)
    where it has them."""
    with open(path, "rb") as file:
        kinds, count, wanted = [], 0, False
        while True:
            words = file.readline().decode("ascii").split()
            if words[0] == "format":
                assert words[1] == "binary_little_endian", path
            elif words[0] == "element":
                wanted = words[1] == "vertex"
                count = int(words[2]) if wanted else count
            elif words[0] == "property" and wanted:
                kinds.append((words[2], "<" + TYPES[words[1]]))
            elif words[0] == "end_header":
                break
        rows = numpy.fromfile(file, kinds, count)

    def pick(*names):
        return numpy.stack([rows[name].astype(float) for name in names], 1)

    cloud = {"centre": pick("x", "y", "z")}
    if "nx" in rows.dtype.names:
        cloud["normal"] = pick("nx", "ny", "nz")
    if "red" in rows.dtype.names:
        cloud["colour"] = pick("red", "green", "blue") / 255
    if "radius" in rows.dtype.names:
        cloud["radius"] = rows["radius"].astype(float)
    return cloud


def neighbours(points, count):
    """Returns the numbers of each point's nearest others, by a grid of cubes. A search is exact: it
    grows until the last neighbour is nearer than any cube that was not searched."""
    lo, size = points.min(0), len(points)
    # about four points a cube of a surface
    width = max(1e-12, math.sqrt(8 * numpy.prod(numpy.sort(numpy.ptp(points, 0))[1:]) / size))
    cells = numpy.floor((points - lo) / width).astype(numpy.int64)
    span = cells.max(0) + 1
    keys = (cells[:, 0] * span[1] + cells[:, 1]) * span[2] + cells[:, 2]
    in_order = numpy.argsort(keys, kind="stable")
    sorted_keys = keys[in_order]
    found = numpy.full((size, count), -1)
    starts = numpy.flatnonzero(numpy.r_[True, sorted_keys[1:] != sorted_keys[:-1]])
    for start, end in zip(starts, numpy.r_[starts[1:], size]):
        here, cell = in_order[start:end], cells[in_order[start]]
        left, reach = here, 1
        while len(left):
            near = [in_order[numpy.searchsorted(sorted_keys, row):numpy.searchsorted(sorted_keys, row + last)]
                    for row, last in rows_about(cell, reach, span)]
            near = numpy.concatenate(near)
            squares = ((points[left, None] - points[None, near]) ** 2).sum(2)
            squares[left[:, None] == near] = numpy.inf
            if len(near) > count:
                first = numpy.argpartition(squares, count - 1, axis=1)[:, :count]
                most = numpy.take_along_axis(squares, first, 1).max(1)
                inside = numpy.minimum(points[left] - lo - (cell - reach) * width,
                                       (cell + reach + 1) * width - points[left] + lo).min(1)
                done = (most <= inside ** 2) | (len(near) == size)
                found[left[done]] = near[first[done]]
                left = left[~done]
            reach *= 2
    return found


def rows_about(cell, reach, span):
    """Yields the first key and the length of each row of cubes within `reach` of a cube."""
    lo, hi = numpy.maximum(cell - reach, 0), numpy.minimum(cell + reach, span - 1)
    for x in range(lo[0], hi[0] + 1):
        for y in range(lo[1], hi[1] + 1):
            yield (x * span[1] + y) * span[2] + lo[2], hi[2] - lo[2] + 1


def shape(cloud):
    """Adds the radii, and the normals that are missing, from the nearest neighbours."""
    points = cloud["centre"]
    if "radius" not in cloud:
        near = neighbours(points, NEIGHBOURS)
        offsets = points[near] - points[:, None]
        reach = numpy.sqrt((offsets ** 2).sum(2).max(1))
        spread = numpy.sqrt(((offsets - offsets.mean(1, keepdims=True)) ** 2).sum(2).mean(1))
        radius = numpy.minimum(reach, SPREAD * spread) * math.sqrt(math.pi / 2 / NEIGHBOURS)
        diagonal = numpy.linalg.norm(numpy.ptp(points, 0))
        cloud["radius"] = numpy.minimum(radius, diagonal * max(MOST_RADII / math.sqrt(len(points)), 1 / 64))
    if "normal" not in cloud:
        with_point = numpy.concatenate([offsets, 0 * offsets[:, :1]], 1)
        with_point -= with_point.mean(1, keepdims=True)
        cloud["normal"] = numpy.linalg.eigh(with_point.transpose(0, 2, 1) @ with_point)[1][:, :, 0]
    length = numpy.linalg.norm(cloud["normal"], axis=1, keepdims=True)
    cloud["normal"] = cloud["normal"] / numpy.where(length > 0, length, 1)
    return cloud


def basis_of(view):
    forward = view["look"] - view["eye"]
    forward = forward / numpy.linalg.norm(forward)
    right = numpy.cross(forward, view["up"])
    right = right / numpy.linalg.norm(right)
    return numpy.stack([right, numpy.cross(forward, right), forward])  # x right, y down, z forward


def cast(discs, view, rays):
    """Returns the distance along the view and the number of the nearest disc for each ray, infinite
    and -1 where it hits none. A pixel has rays x rays of them, at the middles of equal squares."""
    width, height = view["size"][0] * rays, view["size"][1] * rays
    frame = basis_of(view)
    at = (discs["centre"] - view["eye"]) @ frame.T
    normal, radius = discs["normal"] @ frame.T, discs["radius"]
    focal = height / 2 / math.tan(math.radians(view["fov"]) / 2)
    order = numpy.flatnonzero(at[:, 2] > 1.001 * radius)
    at, normal, radius = at[order], normal[order], radius[order]
    # the bounds of a sphere's box on the screen
    lo, hi = numpy.empty((2, len(order), 2), int)
    for axis, side in enumerate((width, height)):
        edges = [focal * (at[:, axis] + s * radius) / (at[:, 2] + t * radius) + side / 2
                 for s in (-1, 1) for t in (-1, 1)]
        lo[:, axis] = numpy.clip(numpy.floor(numpy.min(edges, 0)), 0, side)
        hi[:, axis] = numpy.clip(numpy.ceil(numpy.max(edges, 0)) + 1, 0, side)
    extent = numpy.maximum(hi - lo, 0)
    samples = extent[:, 0] * extent[:, 1]
    plane = (normal * at).sum(1)
    depth = numpy.full(width * height, numpy.inf)
    nearest = numpy.full(width * height, -1)
    start = 0
    upto = numpy.cumsum(samples)
    while start < len(order):
        end = max(start + 1, numpy.searchsorted(upto, (upto[start - 1] if start else 0) + 4000000))
        which = numpy.repeat(numpy.arange(start, end), samples[start:end])
        inside = numpy.arange(len(which)) - (upto[which] - samples[which] - (upto[start] - samples[start]))
        px = lo[which, 0] + inside % numpy.maximum(extent[which, 0], 1)
        py = lo[which, 1] + inside // numpy.maximum(extent[which, 0], 1)
        ray = numpy.stack([(px + 0.5 - width / 2) / focal, (py + 0.5 - height / 2) / focal,
                           numpy.ones(len(which))], 1)
        with numpy.errstate(divide="ignore", invalid="ignore"):
            t = plane[which] / (normal[which] * ray).sum(1)
            hit = (t > 0) & (((ray * t[:, None] - at[which]) ** 2).sum(1) <= radius[which] ** 2)
        pixel, t, which = (py * width + px)[hit], t[hit], which[hit]
        last = numpy.argsort(-t, kind="stable")  # so the nearest is written last
        pixel, t, which = pixel[last], t[last], which[last]
        nearer = t < depth[pixel]
        depth[pixel[nearer]] = t[nearer]
        nearest[pixel[nearer]] = order[which[nearer]]
        start = end
    return depth.reshape(height, width), nearest.reshape(height, width)


def draw(discs, view, rays=4):
    """Returns the mean over the rays of each pixel: premultiplied red, green, blue, and coverage."""
    _, nearest = cast(discs, view, rays)
    hit = (nearest >= 0)[:, :, None]
    seen = numpy.where(hit, discs["colour"][nearest], 0)
    all_rays = numpy.concatenate([seen, hit], 2)
    width, height = view["size"]
    return all_rays.reshape(height, rays, width, rays, 4).mean((1, 3))


def distance_to(mask, pixels):
    """Returns the distance of each pixel (y, x) from the nearest pixel of the mask."""
    padded = numpy.pad(mask, 1)
    beside = padded[:-2, 1:-1] & padded[2:, 1:-1] & padded[1:-1, :-2] & padded[1:-1, 2:]
    rim = numpy.argwhere(mask & ~beside)
    if not len(rim):
        return numpy.full(len(pixels), numpy.inf)
    return numpy.array([math.sqrt(((rim - p) ** 2).sum(1).min()) for p in pixels])


def silhouettes_apart(picture, truth):
    """Returns the distances in pixels, over all pixels that only one picture covers by half or more,
    from the nearest pixel that both treat alike in that way."""
    a, b = picture[:, :, 3] >= 0.5, truth[:, :, 3] >= 0.5
    more, less = numpy.argwhere(a & ~b), numpy.argwhere(b & ~a)
    return numpy.concatenate([distance_to(b, more), distance_to(a, less)])


def compare(picture, truth):
    """Returns the differences of a picture, as a dictionary. Colours are of 255 over black, where
    both cover the pixel by half or more; edges are the other pixels that one of them covers."""
    apart = 255 * numpy.abs(picture - truth)
    a, b = picture[:, :, 3], truth[:, :, 3]
    both, any_of = (a >= 0.5) & (b >= 0.5), (a > 0.01) | (b > 0.01)
    straight = [numpy.where(both[:, :, None], p[:, :, :3] / numpy.where(both, p[:, :, 3], 1)[:, :, None], 0)
                for p in (picture, truth)]
    colour = 255 * numpy.abs(straight[0] - straight[1])[both]
    distances = silhouettes_apart(picture, truth)
    return {
        "mean": apart[any_of, :3].mean(),
        "colour": colour.mean(),
        "colour95": numpy.percentile(colour.mean(1), 95),
        "coverage": apart[any_of, 3].mean(),
        "differing": len(distances) / max(1, both.sum()),
        "silhouette": distances.max(initial=0),
        "silhouette99": numpy.percentile(distances, 99) if len(distances) else 0.0,
        "beyond": int((distances > 1).sum()),
    }
