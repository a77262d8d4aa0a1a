"""Puts one view by every program side by side: picture, difference from the first program, opacity
and difference of opacity."""
import numpy as np
from PIL import Image, ImageDraw

LABEL_PX = 36
GAIN = 3  # factor of displayed differences


def load(path, is_opacity=False):
    """Returns r, g, b, a of a file in [0, 1]. With is_opacity, all four are the grey value of a
    picture over black."""
    image = Image.open(path)
    if is_opacity:
        grey = np.asarray(image.convert("L")).astype(np.float32) / 255
        return np.repeat(grey[..., None], 4, axis=2)
    return np.asarray(image.convert("RGBA")).astype(np.float32) / 255


def premultiply(rgba):
    return np.concatenate([rgba[..., :3] * rgba[..., 3:], rgba[..., 3:]], axis=2)


def difference(a, b):
    return {"mean": float(np.abs(a - b).mean()), "max": float(np.abs(a - b).max())}


def _figures(apart):
    if not apart.size:
        return {"median": 0.0, "mean": 0.0, "percentile_99": 0.0, "max": 0.0}
    return {"median": float(np.median(apart)), "mean": float(apart.mean()),
            "percentile_99": float(np.percentile(apart, 99)), "max": float(apart.max())}


def distance(picture, truth):
    """Returns figures of the difference, of 255, over the pixels where the opacity of either
    picture is above 1/255: for all channels, and for opacity alone, which light does not change."""
    covered = np.maximum(picture[..., 3], truth[..., 3]) > 1 / 255
    apart = 255 * np.abs(picture - truth)[covered]
    opacity = _figures(apart[:, 3])
    return dict(_figures(apart), opacity_median=opacity["median"], opacity_mean=opacity["mean"])


def _as_image(values):
    if values.ndim == 2:
        values = np.repeat(values[..., None], 3, axis=2)
    return Image.fromarray(np.rint(np.clip(values, 0, 1) * 255).astype(np.uint8), "RGB")


def _signed(values):
    """Returns colours: red where values exceed the first picture, blue where they are below it."""
    return np.stack([values * GAIN, np.abs(values) * 0, -values * GAIN], axis=2)


def side_by_side(path, title, names, pictures):
    """Writes a PNG. `pictures` are premultiplied RGBA arrays of one size, compared with the
    first."""
    size = pictures[0].shape[0]
    rows = ["picture", "difference of brightness x %d (red: brighter, blue: darker)" % GAIN,
            "opacity", "difference of opacity x %d" % GAIN]
    sheet = Image.new("RGB", (size * len(names), (size + LABEL_PX) * len(rows) + LABEL_PX))
    draw = ImageDraw.Draw(sheet)
    draw.text((8, 12), title, fill=(255, 255, 255))
    for column, (name, picture) in enumerate(zip(names, pictures)):
        bright = picture[..., :3].mean(axis=2) - pictures[0][..., :3].mean(axis=2)
        opacity = picture[..., 3] - pictures[0][..., 3]
        cells = [_as_image(picture[..., :3]), _as_image(_signed(bright)),
                 _as_image(picture[..., 3]), _as_image(_signed(opacity))]
        notes = ["", " mean %.3f" % np.abs(bright).mean(), "", " mean %.3f" % np.abs(opacity).mean()]
        for row, cell in enumerate(cells):
            top = LABEL_PX + row * (size + LABEL_PX)
            draw.text((column * size + 8, top + 12), "%s: %s%s" % (name, rows[row], notes[row]),
                      fill=(220, 220, 220))
            sheet.paste(cell, (column * size, top + LABEL_PX))
    sheet.save(path)


def edges(opacity):
    """Returns the left, right, top and bottom edge of the area with opacity above one half, in
    pixels."""
    solid = opacity > 0.5
    columns, rows = np.nonzero(solid.any(axis=0))[0], np.nonzero(solid.any(axis=1))[0]
    return np.array([columns[0], columns[-1] + 1, rows[0], rows[-1] + 1], float)


def centroid(opacity):
    y, x = np.nonzero(opacity > 0.5)
    return np.array([x.mean() + 0.5, y.mean() + 0.5])
