"""Tests the readers of Gaussian scenes. The test writes files of every format by the formats'
descriptions, and compares each value that is read with the one that it stored."""
import copy
import gzip
import io
import json
import os
import struct
import subprocess
import sys
import tempfile
import unittest
import zipfile

try:
    import numpy as np
    from PIL import Image
except ImportError:
    print("skipped: python3-numpy or python3-pil is not installed")
    sys.exit(77)

PRINT = os.environ["TRIP_PRINT_GAUSSIANS"]
HERE = os.path.dirname(os.path.abspath(__file__))
C0 = 0.28209479177387814
COUNT = 700  # more than two chunks of compressed PLY


class Scene:
    """Gaussians as they are to be read: linear deviations, opacity from 0 to 1, unit quaternions
    from w on, coefficients [Gaussian, coefficient, channel]."""

    def __init__(self, degree, count=COUNT, seed=1):
        random = np.random.default_rng(seed)
        self.degree = degree
        self.centre = random.normal(size=(count, 3)) * 3
        self.deviations = np.exp(random.uniform(-7, 1, size=(count, 3)))
        q = random.normal(size=(count, 4))
        self.rotation = q / np.linalg.norm(q, axis=1)[:, None]
        self.opacity = random.uniform(0.02, 0.98, size=count)
        self.sh = np.zeros((count, 16, 3))
        self.sh[:, 0] = random.uniform(-1.7, 1.7, size=(count, 3))
        n = (degree + 1) ** 2
        self.sh[:, 1:n] = random.uniform(-0.9, 0.9, size=(count, n - 1, 3))

    def logit(self):
        return np.log(self.opacity / (1 - self.opacity))

    def rest(self):
        """Coefficients beyond the constant one, channel by channel."""
        n = (self.degree + 1) ** 2
        return self.sh[:, 1:n].transpose(0, 2, 1).reshape(len(self.sh), -1)


class Read:
    def __init__(self, path):
        made = subprocess.run([PRINT, path], capture_output=True)
        self.code = made.returncode
        self.lines = made.stderr.decode().splitlines()
        v = np.frombuffer(made.stdout, dtype="<f8").reshape(-1, 59)
        self.centre, self.deviations, self.rotation = v[:, :3], v[:, 3:6], v[:, 6:10]
        self.opacity, self.sh = v[:, 10], v[:, 11:].reshape(-1, 16, 3)
        if self.code == 0:
            self.format, count, degree, anti, flat, self.up, self.trainer = self.lines.pop().split("|")
            self.count, self.degree = int(count), int(degree)
            self.antialiased, self.flat = anti == "1", flat == "1"


def covariance_root(q):
    w, x, y, z = q.T
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                  [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                  [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]]).transpose(2, 0, 1)


def covariance(deviations, q):
    m = covariance_root(q) * deviations[:, None]
    return m @ m.transpose(0, 2, 1)


NUMPY = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
         "float": "f4", "double": "f8"}


def ply(columns, form="binary_little_endian", comments=(), count=None, tail=b"", more=()):
    """Columns are (type, name, values). `more` are (name, columns) of further elements."""
    def element(name, columns):
        rows = len(columns[0][2]) if count is None else count
        return [f"element {name} {rows}"] + [f"property {t} {n}" for t, n, _ in columns]

    def body(columns):
        if form == "ascii":
            return "".join(" ".join(repr(float(v[i])) for _, _, v in columns) + "\n"
                           for i in range(len(columns[0][2]))).encode()
        order = ">" if "big" in form else "<"
        rows = np.zeros(len(columns[0][2]), [(n, order + NUMPY[t]) for t, n, _ in columns])
        for _, n, v in columns:
            rows[n] = v
        return rows.tobytes()
    elements = [("vertex", columns), *more]
    head = ["ply", f"format {form} 1.0", *(f"comment {c}" for c in comments)]
    for name, of in elements:
        head += element(name, of)
    return ("\n".join(head) + "\nend_header\n").encode() + b"".join(
        body(of) for _, of in elements) + tail


def columns_of(s, length=1.0, flat=False, kind="float"):
    rest = s.rest()
    return ([(kind, a, s.centre[:, i]) for i, a in enumerate("xyz")] +
            [("float", "n" + a, np.zeros(len(s.centre))) for a in "xyz"] +
            [(kind, f"f_dc_{i}", s.sh[:, 0, i]) for i in range(3)] +
            [(kind, f"f_rest_{i}", rest[:, i]) for i in range(rest.shape[1])] +
            [(kind, "opacity", s.logit())] +
            [(kind, f"scale_{i}", np.log(s.deviations[:, i])) for i in range(2 if flat else 3)] +
            [(kind, f"rot_{i}", s.rotation[:, i] * length) for i in range(4)])


def splat(s):
    rows = np.zeros(len(s.centre), [("c", "<f4", 3), ("d", "<f4", 3), ("rgba", "u1", 4), ("q", "u1", 4)])
    rows["c"], rows["d"] = s.centre, s.deviations
    rows["rgba"][:, :3] = np.clip(np.rint((0.5 + C0 * s.sh[:, 0]) * 255), 0, 255)
    rows["rgba"][:, 3] = np.rint(s.opacity * 255)
    rows["q"] = np.clip(np.rint(s.rotation * 128 + 128), 0, 255)
    return rows.tobytes()


def smallest_three(q):
    """Packs x, y, z, w: two bits name the largest one; a sign and nine bits each for the others."""
    out = []
    for w, x, y, z in q:
        v = [x, y, z, w]
        largest = int(np.argmax(np.abs(v)))
        sign = -1 if v[largest] < 0 else 1
        bits = largest
        for i in range(4):
            if i != largest:
                part = sign * v[i]
                bits = bits << 10 | (part < 0) << 9 | int(511 * abs(part) / np.sqrt(0.5) + 0.5)
        out.append(bits)
    return np.array(out, "<u4").tobytes()


def of_three_bytes(s):
    """Returns the scene with the rotations that SPZ 1 and 2 store. A w near 0 has a large error."""
    made = copy.copy(s)
    q = s.rotation * np.where(s.rotation[:, :1] < 0, -1, 1)
    v = np.rint(q[:, 1:] * 127.5 + 127.5) / 127.5 - 1
    w = np.sqrt(np.maximum(0, 1 - (v ** 2).sum(axis=1)))
    made.rotation = np.concatenate([w[:, None], v], axis=1)
    made.rotation /= np.linalg.norm(made.rotation, axis=1)[:, None]
    return made


def spz_planes(s, version, bits):
    n = (s.degree + 1) ** 2
    if version == 1:
        centres = s.centre.astype("<f2").tobytes()
    else:
        fixed = np.rint(s.centre * 2 ** bits).astype("<i4")
        centres = fixed.view("u1").reshape(-1, 4)[:, :3].tobytes()
    q = s.rotation * np.where(s.rotation[:, :1] < 0, -1, 1)
    return [centres, np.rint(s.opacity * 255).astype("u1").tobytes(),
            np.clip(np.rint((0.5 + 0.15 * s.sh[:, 0]) * 255), 0, 255).astype("u1").tobytes(),
            np.clip(np.rint((np.log(s.deviations) + 10) * 16), 0, 255).astype("u1").tobytes(),
            smallest_three(s.rotation) if version > 2 else
            np.rint(q[:, 1:] * 127.5 + 127.5).astype("u1").tobytes(),
            np.clip(np.rint(s.sh[:, 1:n] * 128 + 128), 0, 255).astype("u1").tobytes()]


def zstd(data):
    """Returns a frame of zstd with raw blocks: no compressor is needed."""
    out = struct.pack("<IBB", 0xFD2FB528, 0, 0x70)  # window of 16 MiB
    parts = [data[i:i + 65536] for i in range(0, len(data), 65536)] or [b""]
    for i, part in enumerate(parts):
        out += struct.pack("<I", len(part) << 3 | (i == len(parts) - 1))[:3] + part
    return out


def spz(s, version, bits=12, flags=0, plain=False, tail=b""):
    planes = spz_planes(s, version, bits)
    head = struct.pack("<4sIIBBBB", b"NGSP", version, len(s.centre), s.degree, bits, flags,
                       0 if version < 4 else 6 if s.degree else 5)
    if version < 4:
        data = head + b"".join(planes) + tail
        return data if plain else gzip.compress(data)
    planes = planes if s.degree else planes[:5]
    packed = [zstd(p) for p in planes]
    return (head + struct.pack("<I12x", 32) +
            b"".join(struct.pack("<QQ", len(z), len(p)) for z, p in zip(packed, planes)) +
            b"".join(packed) + tail)


def ksplat(s, level, bucket=256):
    """One section. Levels 1 and 2 have full buckets and a partial one, sorted as they are."""
    n, count = (s.degree + 1) ** 2, len(s.centre)
    full, left = divmod(count, bucket)
    buckets = full + (left > 0)
    head = bytearray(4096)
    head[1] = 1
    struct.pack_into("<IIIIH", head, 4, 1, 1, count, count, level)
    struct.pack_into("<ff", head, 36, -1.5, 1.5)
    block, span = 64.0, 32767
    section = bytearray(1024)
    struct.pack_into("<IIIIfH", section, 0, count, count, bucket, buckets if level else 0, block,
                     12 if level else 0)
    struct.pack_into("<I", section, 24, span)
    struct.pack_into("<IIH", section, 32, full if level else 0, (left > 0) if level else 0, s.degree)
    middles = np.array([s.centre[i * bucket:(i + 1) * bucket].mean(axis=0) for i in range(buckets)], "<f4")
    data = b""
    if level:
        data = (struct.pack("<I", left) if left else b"") + middles.tobytes()
    groups = [s.sh[:, d * d:(d + 1) ** 2].transpose(0, 2, 1).reshape(count, -1)
              for d in range(1, s.degree + 1)]
    rest = np.concatenate(groups, axis=1) if groups else np.zeros((count, 0))
    real, small = ("<f4", "<f4") if level == 0 else ("<f2", "<f2" if level == 1 else "u1")
    rows = np.zeros(count, [("c", "<f4" if level == 0 else "<u2", 3), ("d", real, 3), ("q", real, 4),
                            ("rgba", "u1", 4), ("rest", small, (3 * (n - 1),))])
    rows["c"] = s.centre if level == 0 else np.rint(
        (s.centre - middles[np.arange(count) // bucket]) / (block / 2 / span) + span)
    rows["d"], rows["q"] = s.deviations, s.rotation
    rows["rgba"][:, :3] = np.clip(np.rint((0.5 + C0 * s.sh[:, 0]) * 255), 0, 255)
    rows["rgba"][:, 3] = np.rint(s.opacity * 255)
    rows["rest"] = rest if level < 2 else np.rint((rest + 1.5) / 3 * 255)
    return bytes(head) + bytes(section) + data + rows.tobytes()


def compressed_ply(s, coloured=True):
    count = len(s.centre)
    scale, colour = np.log(s.deviations), 0.5 + C0 * s.sh[:, 0]
    v = np.concatenate([s.centre, scale, colour if coloured else np.zeros((count, 3))], axis=1)
    starts = range(0, count, 256)
    lo = np.array([v[i:i + 256].min(axis=0) for i in starts], "f4").astype(float)
    hi = np.array([v[i:i + 256].max(axis=0) for i in starts], "f4").astype(float)
    chunk = np.arange(count) // 256

    def part(column, bits):
        a, b = lo[chunk, column], hi[chunk, column]
        return np.clip(np.rint((v[:, column] - a) / (b - a) * (2 ** bits - 1)), 0,
                       2 ** bits - 1).astype("u4")
    position = part(0, 11) << 21 | part(1, 10) << 11 | part(2, 11)
    packed_scale = part(3, 11) << 21 | part(4, 10) << 11 | part(5, 11)
    if coloured:
        c = [part(6 + i, 8) for i in range(3)]
    else:
        c = [np.clip(np.rint(colour[:, i] * 255), 0, 255).astype("u4") for i in range(3)]
    packed_colour = c[0] << 24 | c[1] << 16 | c[2] << 8 | np.rint(s.opacity * 255).astype("u4")
    words = []
    for q in s.rotation:
        largest = int(np.argmax(np.abs(q)))
        q, word = (-q if q[largest] < 0 else q), largest
        for i in range(4):
            if i != largest:
                word = word << 10 | int(np.rint((q[i] / np.sqrt(2) + 0.5) * 1023))
        words.append(word)
    names = ["x", "y", "z", "scale_x", "scale_y", "scale_z"] + (["r", "g", "b"] if coloured else [])
    bounds = [("float", "min_" + n, lo[:, i]) for i, n in enumerate(names)] + \
             [("float", "max_" + n, hi[:, i]) for i, n in enumerate(names)]
    vertex = [("uint", "packed_position", position), ("uint", "packed_rotation", np.array(words, "u4")),
              ("uint", "packed_scale", packed_scale), ("uint", "packed_color", packed_colour)]
    rest = s.rest()
    sh = [("uchar", f"f_rest_{i}", np.clip(np.trunc((rest[:, i] / 8 + 0.5) * 256), 0, 255))
          for i in range(rest.shape[1])]
    data = ply(bounds, more=[("vertex", vertex)] + ([("sh", sh)] if sh else []),
               comments=["Generated by SuperSplat"])
    return data.replace(b"element vertex", b"element chunk", 1)


def webp(pixels):
    """Returns a picture of at least the given pixels, which have four bytes each."""
    side = int(np.ceil(np.sqrt(len(pixels)) / 4)) * 4
    full = np.zeros((side * side, 4), "u1")
    full[:len(pixels)] = pixels
    return picture(full.reshape(side, side, 4))


def picture(pixels):
    out = io.BytesIO()
    Image.fromarray(pixels, "RGBA").save(out, "WEBP", lossless=True, exact=True)
    return out.getvalue()


def codebook(values):
    """Returns 256 values and the byte of each given one."""
    table = np.linspace(values.min(), values.max(), 256)
    table[100] += 1e-9  # the steps need not be even
    return table, np.abs(values[..., None] - table).argmin(axis=-1).astype("u1")


def sog(s, version=2, model=None):
    """Returns the parts of a scene: a dictionary of names and bytes. The harmonics of version 2 have
    a palette of 100 entries, of version 1 one for each Gaussian."""
    count = len(s.centre)
    logs = np.sign(s.centre) * np.log(np.abs(s.centre) + 1)
    lo, hi = logs.min(axis=0), logs.max(axis=0)
    steps = np.rint((logs - lo) / (hi - lo) * 65535).astype("u4")
    opaque = np.full((count, 1), 255, "u1")
    meta = {"means": {"shape": [count, 3], "mins": list(lo), "maxs": list(hi),
                      "files": ["means_l.webp", "means_u.webp"]},
            "scales": {"files": ["scales.webp"]}, "quats": {"files": ["quats.webp"]},
            "sh0": {"files": ["sh0.webp"]}}
    parts = {"means_l.webp": webp(np.concatenate([(steps & 255).astype("u1"), opaque], axis=1)),
             "means_u.webp": webp(np.concatenate([(steps >> 8).astype("u1"), opaque], axis=1))}
    rotations = np.zeros((count, 4), "u1")
    for i, q in enumerate(s.rotation):
        largest = int(np.argmax(np.abs(q)))
        q = -q if q[largest] < 0 else q
        rotations[i, :3] = np.rint((np.delete(q, largest) * np.sqrt(2) + 1) * 127.5)
        rotations[i, 3] = 252 + largest
    parts["quats.webp"] = webp(rotations)
    logs = np.log(s.deviations)
    if version == 2:
        meta.update({"version": 2, "count": count, "asset": {"generator": "test 1"}})
        table, scales = codebook(logs)
        meta["scales"]["codebook"] = list(table)
        table, colours = codebook(s.sh[:, 0])
        meta["sh0"]["codebook"] = list(table)
        opacity = np.rint(s.opacity * 255)
    else:
        def of_range(group, values):
            a, b = values.min(axis=0), values.max(axis=0)
            meta[group].update({"mins": list(a), "maxs": list(b)})
            return np.rint((values - a) / (b - a) * 255).astype("u1")
        scales = of_range("scales", logs)
        both = of_range("sh0", np.concatenate([s.sh[:, 0], s.logit()[:, None]], axis=1))
        colours, opacity = both[:, :3], both[:, 3]
    if model:
        meta["model"] = model
    parts["scales.webp"] = webp(np.concatenate([scales, opaque], axis=1))
    parts["sh0.webp"] = webp(np.concatenate([colours, opacity[:, None].astype("u1")], axis=1))
    if s.degree:
        n = (s.degree + 1) ** 2 - 1
        entries = min(100, count) if version == 2 else count
        palette = s.sh[:entries, 1:n + 1]
        meta["shN"] = {"bands": s.degree, "count": entries,
                       "files": ["shN_centroids.webp", "shN_labels.webp"]}
        if version == 2:
            table, codes = codebook(palette)
            meta["shN"]["codebook"] = list(table)
        else:
            meta["shN"].update({"mins": float(palette.min()), "maxs": float(palette.max())})
            codes = np.rint((palette - palette.min()) / np.ptp(palette) * 255).astype("u1")
        rows = -(-entries // 64)
        pixels = np.full((rows * 64, n, 4), 255, "u1")
        pixels[:entries, :, :3] = codes
        parts["shN_centroids.webp"] = picture(pixels.reshape(rows, 64 * n, 4))
        labels = np.arange(count) % entries
        parts["shN_labels.webp"] = webp(np.stack([labels & 255, labels >> 8, labels * 0, labels * 0 + 255],
                                                 axis=1).astype("u1"))
        s.sh[:, 1:n + 1] = palette[labels]
    parts["meta.json"] = json.dumps(meta).encode()
    return parts


def archive(parts, method=zipfile.ZIP_STORED):
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", method) as z:
        for name, data in parts.items():
            z.writestr(name, data)
    return out.getvalue()


EXTENSION = "KHR_gaussian_splatting"
GLTF_TYPES = {"f4": 5126, "i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123}


def gltf(s, types=None, interleaved=False, node=None, scenes=True, **members):
    """Returns the JSON and the buffer of a scene. `types` gives other types than floats to
    attributes; whole numbers are normalised."""
    columns = {"POSITION": s.centre, EXTENSION + ":ROTATION": np.roll(s.rotation, -1, axis=1),
               EXTENSION + ":SCALE": s.deviations, EXTENSION + ":OPACITY": s.opacity[:, None]}
    for k in range((s.degree + 1) ** 2):
        degree = int(np.sqrt(k))
        columns[f"{EXTENSION}:SH_DEGREE_{degree}_COEF_{k - degree * degree}"] = s.sh[:, k]
    packed = {}
    for name, v in columns.items():
        kind = (types or {}).get(name.split(":")[-1], "f4")
        if kind[0] != "f":
            v = np.rint(v * np.iinfo(kind).max)
        packed[name] = v.astype("<" + kind)
    accessors, views, data, attributes = [], [], b"", {}
    if interleaved:
        rows = [np.ascontiguousarray(v).view("u1").reshape(len(v), -1) for v in packed.values()]
        rows = [np.pad(r, ((0, 0), (0, -r.shape[1] % 4))) for r in rows]
        at = np.cumsum([0] + [r.shape[1] for r in rows])
        data = b"head" + np.concatenate(rows, axis=1).tobytes()
        views = [{"buffer": 0, "byteOffset": 4, "byteLength": len(data) - 4, "byteStride": int(at[-1])}]
    for i, (name, v) in enumerate(packed.items()):
        if interleaved:
            where = {"bufferView": 0, "byteOffset": int(at[i])}
        else:
            stride = {"byteStride": v[0].nbytes}
            views.append({"buffer": 0, "byteOffset": len(data), "byteLength": v.nbytes, **stride})
            data += v.tobytes() + bytes(-v.nbytes % 4)
            where = {"bufferView": i}
        attributes[name] = i
        accessors.append({**where, "componentType": GLTF_TYPES[v.dtype.str[1:]], "count": len(v),
                          "normalized": v.dtype.kind != "f",
                          "type": {1: "SCALAR", 3: "VEC3", 4: "VEC4"}[v.shape[1]]})
    text = {"asset": {"version": "2.0", "generator": "test 2"}, "extensionsUsed": [EXTENSION],
            "buffers": [{"byteLength": len(data)}], "bufferViews": views, "accessors": accessors,
            "meshes": [{"primitives": [{"mode": 0, "attributes": attributes, "extensions": {
                EXTENSION: {"kernel": "ellipse", "colorSpace": "srgb_rec709_display"}}}]}],
            "nodes": [{"mesh": 0, **(node or {})}]}
    if scenes:
        text.update({"scene": 0, "scenes": [{"nodes": [0]}]})
    return {**text, **members}, data


def glb(text, data):
    text = json.dumps(text).encode()
    text += b" " * (-len(text) % 4)
    return (struct.pack("<4sIIII", b"glTF", 2, 28 + len(text) + len(data), len(text), 0x4E4F534A) + text +
            struct.pack("<II", len(data), 0x004E4942) + data)


def harmonics(d):
    """The real spherical harmonics of unit directions, as trainers use them, to degree 3."""
    x, y, z = d.T
    return np.stack([
        0.28209479177387814 + 0 * x, -0.4886025119029199 * y, 0.4886025119029199 * z,
        -0.4886025119029199 * x, 1.0925484305920792 * x * y, -1.0925484305920792 * y * z,
        0.31539156525252005 * (2 * z * z - x * x - y * y), -1.0925484305920792 * x * z,
        0.5462742152960396 * (x * x - y * y), -0.5900435899266435 * y * (3 * x * x - y * y),
        2.890611442640554 * x * y * z, -0.4570457994644658 * y * (4 * z * z - x * x - y * y),
        0.3731763325901154 * z * (2 * z * z - 3 * x * x - 3 * y * y),
        -0.4570457994644658 * x * (4 * z * z - x * x - y * y), 1.445305721320277 * z * (x * x - y * y),
        -0.5900435899266435 * x * (x * x - 3 * y * y)], axis=1)


def matrix(q):
    """The rotation matrix of a quaternion from x on."""
    return covariance_root(np.roll(np.array([q]), 1, axis=1))[0]


class GaussianFile(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()

    def tearDown(self):
        self.folder.cleanup()

    def path(self, name, data):
        path = os.path.join(self.folder.name, name)
        with open(path, "wb") as f:
            f.write(data)
        return path

    def read(self, name, data):
        r = Read(self.path(name, data))
        self.assertEqual(r.code, 0, (name, r.lines))
        return r

    def agree(self, r, s, centre=1e-6, deviation=1e-6, rotation=1e-6, opacity=1e-6, constant=2e-6,
              rest=1e-6, flat=False, lines=0):
        """Compares with bounds of the error. `deviation` is relative, `rotation` is that of the
        covariance, divided by its trace."""
        self.assertEqual((r.count, r.degree, len(r.lines)), (len(s.centre), s.degree, lines), r.lines)
        deviations = s.deviations * [1, 1, 0] if flat else s.deviations
        np.testing.assert_allclose(r.centre, s.centre, rtol=1e-6, atol=centre)
        np.testing.assert_allclose(r.deviations, deviations, rtol=deviation)
        np.testing.assert_allclose(np.linalg.norm(r.rotation, axis=1), 1, atol=1e-6)
        wanted = covariance(deviations, s.rotation)
        off = np.abs(covariance(r.deviations, r.rotation) - wanted).max(axis=(1, 2))
        self.assertLess((off / np.trace(wanted, axis1=1, axis2=2)).max(), rotation + 2 * deviation)
        np.testing.assert_allclose(r.opacity, s.opacity, atol=opacity)
        np.testing.assert_allclose(r.sh[:, 0], s.sh[:, 0], atol=constant)
        np.testing.assert_allclose(r.sh[:, 1:], s.sh[:, 1:], atol=rest)

    def refuses(self, name, data, says):
        r = Read(self.path(name, data))
        self.assertEqual((r.code, len(r.lines)), (1, 1), (name, r.lines))
        self.assertIn(says, r.lines[0], name)
        self.assertTrue(r.lines[0].startswith("triptych: read: "), r.lines)

    def test_a_ply_of_each_degree_and_byte_order_holds_its_values(self):
        for degree in range(4):
            s = Scene(degree)
            for form in "binary_little_endian", "binary_big_endian", "ascii":
                r = self.read("a.ply", ply(columns_of(s, 2.5), form))
                self.agree(r, s)
                self.assertEqual((r.format, r.up, r.antialiased, r.flat), ("3DGS PLY", "-y", False, False))

    def test_properties_of_a_ply_may_have_any_order_type_and_elements_around_them(self):
        s = Scene(2)
        columns = columns_of(s, 0.01, kind="double")[::-1]
        self.agree(self.read("a.ply", ply(columns, more=[("camera", [("int", "id", [7])])])), s)
        data = ply([("short", "id", [1, 2, 3])], more=[("vertex", columns)])
        self.agree(self.read("b.ply", data.replace(b"element vertex", b"element first", 1)), s)
        data = ply([("short", "id", [1, 2, 3])], "ascii", more=[("vertex", columns)])
        self.agree(self.read("c.ply", data.replace(b"element vertex", b"element first", 1)), s)
        self.agree(self.read("d.ply.gz", gzip.compress(ply(columns))), s)
        self.agree(self.read("e.ply", ply(columns).replace(b"\n", b"\r\n", columns_lines(columns))), s)

    def test_a_ply_with_colours_of_bytes(self):
        s = Scene(0)
        bytes_ = np.rint(np.clip(0.5 + C0 * s.sh[:, 0], 0, 1) * 255)
        columns = [c for c in columns_of(s) if not c[1].startswith("f_dc")] + \
                  [("uchar", n, bytes_[:, i]) for i, n in enumerate(("red", "green", "blue"))]
        self.agree(self.read("a.ply", ply(columns)), s, constant=0.51 / 255 / C0)

    def test_surfels_have_a_third_deviation_of_0(self):
        s = Scene(1)
        r = self.read("a.ply", ply(columns_of(s, flat=True), comments=["SplatRenderMode: mip"]))
        self.agree(r, s, flat=True)
        self.assertEqual((r.format, r.flat, r.antialiased), ("2DGS PLY", True, False))

    def test_comments_tell_trainer_antialiasing_and_axis(self):
        for comments, antialiased, up in ((["Exported from Brush", "SplatRenderMode: mip"], True, "-y"),
                                          (["antialiased 1"], True, "-y"), (["antialiased 0"], False, "-y"),
                                          (["Vertical Axis: z"], False, "z"),
                                          (["Vertical axis: 0 0.1 -0.9"], False, "-z"),
                                          (["Vertical axis: y"], False, "-y")):
            r = self.read("a.ply", ply(columns_of(Scene(0, 3)), comments=comments))
            self.assertEqual((r.antialiased, r.up, r.trainer), (antialiased, up, "; ".join(comments)))

    def test_the_filter_of_mip_splatting_widens_gaussians(self):
        s = Scene(0)
        filter_3d = np.random.default_rng(5).uniform(0.01, 0.5, COUNT)
        r = self.read("a.ply", ply(columns_of(s) + [("float", "filter_3D", filter_3d)]))
        before, after = s.deviations ** 2, s.deviations ** 2 + filter_3d[:, None] ** 2
        s.opacity = s.opacity * np.sqrt(before.prod(axis=1) / after.prod(axis=1))
        s.deviations = np.sqrt(after)
        self.agree(r, s)
        self.assertTrue(r.antialiased)

    def test_gaussians_that_are_not_finite_are_left_out_and_counted(self):
        s = Scene(1)
        columns = columns_of(s)
        for row, name, value in ((3, "x", np.nan), (5, "f_rest_8", np.inf), (699, "rot_2", np.nan),
                                 (300, "scale_1", 200.0), (301, "opacity", np.nan)):
            for _, n, v in columns:
                if n == name:
                    v[row] = value
        r = self.read("a.ply", ply(columns))
        kept = np.setdiff1d(np.arange(COUNT), [3, 5, 699, 300, 301])
        np.testing.assert_allclose(r.centre, s.centre[kept], rtol=1e-6)
        self.assertEqual(len(r.lines), 1)
        self.assertIn("5 of 700 Gaussians hold a value that is not finite", r.lines[0])

    def test_infinite_logits_and_logarithms_have_a_limit(self):
        s = Scene(0, 3)
        columns = columns_of(s)
        for _, n, v in columns:
            if n == "opacity":
                v[:2] = np.inf, -np.inf
            if n == "scale_2":
                v[2] = -np.inf
        r = self.read("a.ply", ply(columns))
        self.assertEqual((r.opacity[0], r.opacity[1], r.deviations[2, 2], r.lines), (1, 0, 0, []))

    def test_a_rotation_of_length_0_is_named(self):
        s = Scene(0)
        s.rotation[7] = 0
        r = self.read("a.ply", ply(columns_of(s)))
        np.testing.assert_array_equal(r.rotation[7], [1, 0, 0, 0])
        self.assertIn("1 of 700 Gaussians have a rotation of length 0", r.lines[0])

    def test_a_damaged_ply_is_refused_in_one_line(self):
        s = Scene(1, 5)
        good = ply(columns_of(s))
        head = good[:good.index(b"end_header")]
        self.refuses("a.ply", good[:-1], "is it truncated?")
        self.refuses("b.ply", head, "the header has no end")
        self.refuses("c.ply", good.replace(b"vertex 5", b"vertex 1000000000000000000"), "1000000000000000000")
        self.refuses("d.ply", good.replace(b"vertex 5", b"vertex 100000000000000000"), "100000000000000000")
        self.refuses("e.ply", good.replace(b"vertex 5", b"vertex -5"), "-5")
        self.refuses("f.ply", good.replace(b"vertex 5", b"vertex 0"), "holds no Gaussians")
        self.refuses("g.ply", good.replace(b"float opacity", b"float opaqueness"), "lacks the property opacity")
        self.refuses("h.ply", good.replace(b"float rot_3", b"float rot_4"), "rot_3")
        self.refuses("i.ply", good.replace(b"float f_rest_8", b"float f_rest_9"), "f_rest")
        self.refuses("j.ply", good.replace(b"float ny", b"float nx"), "nx is stated twice")
        self.refuses("k.ply", good.replace(b"float nx", b"real nx"), "real")
        self.refuses("l.ply", good.replace(b"float nx", b"list uchar int nx"), "a list")
        self.refuses("m.ply", good.replace(b"little", b"middle"), "binary_middle_endian")
        many = b"".join(b"property float p%d\n" % i for i in range(30000))
        self.refuses("n.ply", head + many + b"end_header\n", "4096 properties")
        self.refuses("o.ply", head + b"comment x\n" * 200000, "longer")
        self.refuses("p.ply", ply(columns_of(s), "ascii")[:-30], "is it truncated?")
        self.refuses("q.ply", ply(columns_of(s), "ascii").replace(b"0.0", b"zero", 1), "zero")
        self.refuses("r.ply", good.replace(b"element", b"elephant", 1), "elephant")
        self.refuses("s.ply.gz", gzip.compress(good)[:-30], "truncated")

    def test_bytes_after_the_data_are_a_warning(self):
        s = Scene(0, 5)
        for name, data in (("a.ply", ply(columns_of(s), tail=b"xyz")), ("b.spz", spz(s, 3, tail=b"xyz")),
                           ("c.spz", spz(s, 4, tail=b"xyz"))):
            r = self.read(name, data)
            self.assertEqual(len(r.lines), 1, name)
            self.assertIn("after the expected", r.lines[0])

    # A step of the logarithm is a 16th: exp(1 / 32) = 1.0317.
    SPZ = {"deviation": 0.0319, "opacity": 0.51 / 255, "constant": 0.51 / 255 / 0.15, "rest": 0.51 / 128}

    def test_spz_of_each_version_and_degree_holds_its_values(self):
        for degree in range(4):
            s = Scene(degree)
            s.sh[:, 0] = np.clip(s.sh[:, 0], -3, 3)
            for version in 1, 2, 3, 4:
                r = self.read("a.spz", spz(s, version))
                self.agree(r, of_three_bytes(s) if version < 3 else s,
                           centre=0.008 if version == 1 else 0.51 / 4096,
                           rotation=1e-6 if version < 3 else 0.003, **self.SPZ)
                self.assertEqual((r.format, r.up, r.antialiased), (f"SPZ {version}", "y", False))
            self.agree(self.read("b.spz", spz(s, 3, plain=True)), s, centre=0.51 / 4096, **self.SPZ)
        self.assertTrue(self.read("c.spz", spz(s, 3, flags=1)).antialiased)
        self.agree(self.read("d.spz", spz(s, 2, bits=8)), of_three_bytes(s), centre=0.51 / 256, **self.SPZ)

    def test_a_large_spz_is_read_in_portions(self):
        s = Scene(1, 20000)
        for version in 3, 4:
            self.agree(self.read("a.spz", spz(s, version)), s, centre=0.51 / 4096, rotation=0.003, **self.SPZ)

    def test_a_damaged_spz_is_refused_in_one_line(self):
        s = Scene(1, 9)
        old, new = spz(s, 3, plain=True), spz(s, 4)
        self.refuses("a.spz", old[:-1], "is it truncated?")
        self.refuses("b.spz", old[:12], "ends in its header")
        self.refuses("c.spz", old[:4] + b"\5" + old[5:], "version 5")
        self.refuses("d.spz", old[:8] + b"\xff" * 4 + old[12:], "")
        self.refuses("e.spz", old[:12] + b"\7" + old[13:], "degree 7")
        self.refuses("f.spz", gzip.compress(old[:-1]), "")
        self.refuses("g.spz", gzip.compress(old)[:-20], "")
        self.refuses("h.spz", new[:-1], "stream 6 lies beyond the end")
        self.refuses("i.spz", new[:8] + b"\xff" * 4 + new[12:], "stream 1 holds")
        self.refuses("j.spz", new[:15] + b"\2" + new[16:], "2 streams")
        self.refuses("k.spz", new[:32] + b"\xff" * 8 + new[40:], "stream 1 lies beyond the end")
        self.refuses("l.spz", new[:128] + b"\0" + new[129:], "zstd data is corrupt")
        self.refuses("m.spz", old[:8] + bytes(4) + old[12:], "holds no Gaussians")

    BYTES = {"opacity": 0.51 / 255, "constant": 0.51 / 255 / C0}

    def test_splat_holds_its_values(self):
        s = Scene(0)
        r = self.read("a.splat", splat(s))
        self.agree(r, s, rotation=0.03, **self.BYTES)
        self.assertEqual((r.format, r.up), (".splat", "-y"))
        self.refuses("b.splat", splat(s)[:-1], "no multiple of 32")
        self.refuses("c.splat.gz", gzip.compress(splat(s)), "gzip -dc")

    def test_ksplat_of_each_level_and_degree_holds_its_values(self):
        for degree in range(4):
            s = Scene(degree)
            for level in 0, 1, 2:
                r = self.read("a.ksplat", ksplat(s, level))
                half = 0 if level == 0 else 5e-4
                self.agree(r, s, centre=0.51 * 32 / 32767, deviation=half + 1e-6, rotation=2 * half + 1e-6,
                           rest=[1e-6, 5e-4, 0.51 * 3 / 255][level], **self.BYTES)

    def test_a_damaged_ksplat_is_refused_in_one_line(self):
        good = ksplat(Scene(1, 300), 1)
        at = 4096
        self.refuses("a.ksplat", good[:-1], "is it truncated?")
        self.refuses("b.ksplat", good[:30], "truncated")
        self.refuses("c.ksplat", b"\1" + good[1:], "version 1.1")
        self.refuses("d.ksplat", good[:20] + b"\3" + good[21:], "compression level 3")
        self.refuses("e.ksplat", good[:16] + b"\1\0\0\0" + good[20:], "states 1 Gaussians")
        self.refuses("f.ksplat", good[:4] + b"\xff" * 4 + good[8:], "")
        self.refuses("g.ksplat", good[:at + 40] + b"\4" + good[at + 41:], "degree 4")
        self.refuses("h.ksplat", good[:at + 32] + bytes(4) + good[at + 36:], "more Gaussians than its buckets")
        self.refuses("i.ksplat", good[:at + 36] + b"\xff" * 4 + good[at + 40:], "contradicts itself")

    def test_compressed_ply_holds_its_values(self):
        for degree in range(4):
            s = Scene(degree)
            for coloured in True, False:
                r = self.read("a.ply", compressed_ply(s, coloured))
                self.agree(r, s, centre=0.02, deviation=0.006, rotation=0.004, opacity=0.51 / 255,
                           constant=0.51 / 255 * (1 if coloured else 1 / C0) * 4, rest=8 / 256)
                self.assertEqual((r.format, r.trainer), ("compressed PLY", "Generated by SuperSplat"))

    def test_a_damaged_compressed_ply_is_refused_in_one_line(self):
        good = compressed_ply(Scene(1))
        self.refuses("a.ply", good[:-1], "is it truncated?")
        self.refuses("b.ply", good.replace(b"chunk 3", b"chunk 2"), "states 2 chunks")
        self.refuses("c.ply", good.replace(b"sh 700", b"sh 699"), "699")
        self.refuses("d.ply", good.replace(b"min_y", b"min_q"), "lacks min_y")
        self.refuses("e.ply", good.replace(b"uint packed_scale", b"int packed_scale"), "packed_scale")
        self.refuses("f.ply", good.replace(b"uchar f_rest_8", b"uchar f_rest_9"), "f_rest_8")

    SOG = {"centre": 1e-3, "deviation": 0.02, "rotation": 0.02, "constant": 0.51 * 3.5 / 255,
           "rest": 0.51 * 1.9 / 255}

    def test_sog_of_each_version_and_degree_holds_its_values(self):
        for degree in range(4):
            for version in 1, 2:
                s = Scene(degree)
                r = self.read("a.sog", archive(sog(s, version)))
                self.agree(r, s, opacity=0.51 / 255 if version == 2 else 0.51 * 8 / 255 / 4, **self.SOG)
                self.assertEqual((r.format, r.up, r.trainer),
                                 (f"SOG {version}", "-y", "test 1" if version == 2 else ""))

    def test_sog_may_be_compressed_or_a_folder_and_tells_its_model(self):
        s = Scene(1)
        self.agree(self.read("a.zip", archive(sog(s), zipfile.ZIP_DEFLATED)), s, opacity=0.51 / 255, **self.SOG)
        for name, data in sog(s, model="antialiased").items():
            self.path(name, data)
        r = Read(os.path.join(self.folder.name, "meta.json"))
        self.agree(r, s, opacity=0.51 / 255, **self.SOG)
        self.assertTrue(r.antialiased)
        flat = self.read("b.sog", archive(sog(s, model="2dgs")))
        self.assertTrue(flat.flat)
        self.agree(flat, s, flat=True, opacity=0.51 / 255, **self.SOG)

    def test_a_damaged_sog_is_refused_in_one_line(self):
        s = Scene(1)
        parts = sog(s)
        good = archive(parts)
        meta = json.loads(parts["meta.json"])

        def changed(**members):
            return archive({**parts, "meta.json": json.dumps({**meta, **members}).encode()})
        self.refuses("a.sog", good[:-40], "damaged ZIP")
        self.refuses("b.sog", good[:300] + b"xxxx" + good[304:], "damaged")
        for name in parts:
            self.refuses("c.sog", archive({n: d for n, d in parts.items() if n != name}), f"lacks its part {name}")
        self.refuses("d.sog", archive({**parts, "quats.webp": b"RIFF"}), "no WebP picture")
        self.refuses("e.sog", archive({**parts, "quats.webp": parts["quats.webp"][:-200]}), "is damaged")
        self.refuses("f.sog", archive({**parts, "quats.webp": webp(np.zeros((9, 4), "u1"))}), "too few")
        wide = picture(np.zeros((900, 900, 4), "u1"))
        self.refuses("f.sog", archive({**parts, "quats.webp": wide}), "900 x 900 pixels, which are too many")
        self.refuses("g.sog", archive({**parts, "meta.json": b"{"}), "not JSON")
        self.refuses("h.sog", archive({**parts, "meta.json": b"[" * 1000}), "nested")
        self.refuses("i.sog", changed(count=1e12), "count")
        self.refuses("j.sog", changed(count=-1), "count")
        self.refuses("k.sog", changed(count=4e9), "too few")
        self.refuses("l.sog", changed(version=3), "version 3")
        self.refuses("m.sog", changed(quats={"files": ["../quats.webp"]}), "quats.files")
        self.refuses("n.sog", changed(scales={"files": ["scales.webp"], "codebook": [1] * 255}), "256 numbers")
        self.refuses("o.sog", changed(means={**meta["means"], "mins": [0, "x", 1]}), "means.mins")
        self.refuses("p.sog", archive({**parts, "shN_centroids.webp": parts["quats.webp"]}), "pixels wide")
        self.refuses("q.sog", changed(count=0), "holds no Gaussians")

    def test_gltf_of_each_degree_holds_its_values(self):
        for degree in range(4):
            s = Scene(degree)
            r = self.read("a.glb", glb(*gltf(s)))
            self.agree(r, s)
            self.assertEqual((r.format, r.up, r.trainer), ("glTF", "y", "test 2"))
            if degree < 3:
                self.agree(self.read("b.glb", glb(*gltf(s, interleaved=True))), s)
        self.agree(self.read("c.glb", glb(*gltf(s, scenes=False))), s)

    def test_gltf_may_hold_whole_numbers_and_a_file_beside_it(self):
        s = Scene(0)
        s.deviations /= s.deviations.max()
        types = {"ROTATION": "i2", "SCALE": "u2", "OPACITY": "u1"}
        self.agree(self.read("a.glb", glb(*gltf(s, types))), s, deviation=0.51 / 65535 / s.deviations.min(),
                   rotation=1e-4, opacity=0.51 / 255)
        text, data = gltf(s, {"ROTATION": "i1"})
        text["buffers"][0]["uri"] = "the%20data.bin"
        self.path("the data.bin", data)
        self.agree(self.read("a.gltf", json.dumps(text).encode()), s, rotation=0.02)

    def test_nodes_of_gltf_move_turn_and_scale_gaussians_and_turn_their_colours(self):
        s = Scene(3)
        q = np.array([0.5, -0.3, 0.2, 0.8])
        q /= np.linalg.norm(q)
        directions = np.random.default_rng(9).normal(size=(20, 3))
        directions /= np.linalg.norm(directions, axis=1)[:, None]
        colours = np.einsum("dk,nkc->ndc", harmonics(directions), s.sh)
        for scale in [2.5, 2.5, 2.5], [0.5, 3, 1.2]:
            m = matrix(q) * scale
            node = {"translation": [1, -2, 3], "rotation": list(q), "scale": scale}
            columns = np.concatenate([np.concatenate([m, [[1], [-2], [3]]], axis=1), [[0, 0, 0, 1]]]).T
            for node in node, {"matrix": list(columns.flat)}:
                r = self.read("a.glb", glb(*gltf(s, node=node)))
                np.testing.assert_allclose(r.centre, s.centre @ m.T + [1, -2, 3], rtol=1e-5, atol=1e-5)
                wanted = m @ covariance(s.deviations, s.rotation) @ m.T
                off = np.abs(covariance(r.deviations, r.rotation) - wanted).max(axis=(1, 2))
                self.assertLess((off / np.trace(wanted, axis1=1, axis2=2)).max(), 1e-5)
                turned = np.einsum("dk,nkc->ndc", harmonics(directions @ matrix(q).T), r.sh)
                np.testing.assert_allclose(turned, colours, atol=1e-5)

    def test_gltf_nodes_hold_several_scenes(self):
        s = Scene(1, 600)
        text, data = gltf(s)
        text["nodes"] = [{"children": [1, 2]}, {"mesh": 0}, {"mesh": 0, "translation": [10, 0, 0]}]
        r = self.read("a.glb", glb(text, data))
        self.assertEqual(r.count, 1200)
        np.testing.assert_allclose(r.centre, np.concatenate([s.centre, s.centre + [10, 0, 0]]), rtol=1e-6, atol=1e-6)

    def test_flat_gaussians_stay_flat_under_uneven_scales(self):
        s = Scene(0, 200)
        s.deviations[:100, 1] = 0
        s.deviations[50:, 2] = 0
        s.deviations[190:] = 0
        m = np.diag([1, 4, 0.25])
        r = self.read("a.glb", glb(*gltf(s, node={"scale": [1, 4, 0.25]})))
        wanted = m @ covariance(s.deviations, s.rotation) @ m
        np.testing.assert_allclose(np.linalg.norm(r.rotation, axis=1), 1, atol=1e-6)
        np.testing.assert_allclose(covariance(r.deviations, r.rotation), wanted, atol=3e-5)

    def test_damaged_gltf_is_refused_in_one_line(self):
        s = Scene(1, 9)
        text, data = gltf(s)
        good = glb(text, data)

        def changed(name, value, *path):
            made = copy.deepcopy(text)
            at = made
            for key in path:
                at = at[key]
            at[name] = value
            return glb(made, data)
        self.refuses("a.glb", good[:-1], "is it truncated?")
        self.refuses("b.glb", good[:4] + b"\1" + good[5:], "version 2")
        self.refuses("c.glb", good.replace(b'"asset"', b'"asset""', 1), "not JSON")
        self.refuses("d.glb", changed("count", 1e15, "accessors", 2), "beyond its buffer")
        self.refuses("e.glb", changed("count", -1, "accessors", 2), "no valid accessor")
        self.refuses("f.glb", changed("count", 8, "accessors", 2), "8 rows")
        self.refuses("g.glb", changed("byteOffset", 1e9, "accessors", 2), "beyond its buffer")
        self.refuses("h.glb", changed("byteLength", 1e9, "buffers", 0), "is it truncated?")
        self.refuses("i.glb", changed("byteStride", 1, "bufferViews", 0), "byteStride")
        self.refuses("j.glb", changed("buffer", 3, "bufferViews", 0), "no valid buffer")
        self.refuses("k.glb", changed("sparse", {}, "accessors", 0), "sparse")
        self.refuses("l.glb", changed("type", "VEC4", "accessors", 0), "VEC3 is read")
        self.refuses("m.glb", changed("extensionsRequired", [EXTENSION, "EXT_meshopt_compression"]),
                     "EXT_meshopt_compression")
        self.refuses("n.glb", changed("nodes", [{"children": [0], "mesh": 0}]), "nested too deep")
        self.refuses("o.glb", changed("nodes", [{"children": [7]}]), "node 7")
        self.refuses("p.glb", changed("scale", [1, -1, 1], "nodes", 0), "mirrors")
        self.refuses("q.glb", changed("uri", "data:application/octet-stream;base64,AAAA", "buffers", 0), "no file")
        for lost in "OPACITY", "SH_DEGREE_1_COEF_1", "SH_DEGREE_1_COEF_2":
            made = copy.deepcopy(text)
            del made["meshes"][0]["primitives"][0]["attributes"][f"{EXTENSION}:{lost}"]
            self.refuses("r.glb", glb(made, data), "lacks" if lost[-1] != "2" else "3 coefficients")

    def test_linear_colours_are_a_warning(self):
        text, data = gltf(Scene(0, 5))
        text["meshes"][0]["primitives"][0]["extensions"][EXTENSION]["colorSpace"] = "lin_rec709_display"
        self.assertIn("linear colours", self.read("a.glb", glb(text, data)).lines[0])

    def test_files_of_another_program_hold_the_same_gaussians(self):
        """The colours are bytes around 85 and 170. The red channel follows x, the green one z."""
        for name, turned, form in (("minimal.splat", 1, ".splat"), ("minimal.ksplat", 1, ".ksplat"),
                                   ("minimal-raw.spz", 1, "SPZ 2"), ("minimal-v2.spz", 1, "SPZ 2"),
                                   ("minimal-v3.spz", -1, "SPZ 3"), ("minimal-v4.spz", -1, "SPZ 4")):
            r = Read(os.path.join(HERE, "gaussians", name))
            self.assertEqual((r.code, r.format, r.count, r.lines), (0, form, 4, []), name)
            centre = np.array([[-1, 0, -1], [0, 0, -1], [-1, 0, 0], [0, 0, 0]]) * [1, 1, turned]
            np.testing.assert_array_equal(r.centre, centre, name)
            # a step of the logarithm in SPZ is a 16th
            np.testing.assert_allclose(r.deviations, 0.1, rtol=1 / 30, err_msg=name)
            np.testing.assert_allclose(r.opacity, 230 / 255, atol=1e-6)
            colour = np.array([[85, 85, 128], [170, 85, 128], [85, 170, 128], [170, 170, 128]]) / 255
            if form.startswith("SPZ"):  # a step of the constant term is 1 / (255 * 0.15)
                np.testing.assert_allclose(0.5 + C0 * r.sh[:, 0], colour, atol=0.17, err_msg=name)
            else:
                np.testing.assert_allclose(0.5 + C0 * r.sh[:, 0], colour, atol=1e-6, err_msg=name)


def columns_lines(columns):
    """Lines of the header of ply(columns)."""
    return 4 + len(columns)


if __name__ == "__main__":
    unittest.main()
