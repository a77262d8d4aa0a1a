"""Plots time and error of every program as SVG, one file for each scene and size. One panel shows
colour, the other opacity, which light does not change. Left is faster, and down is closer to the
exact picture. All axes are logarithmic."""
import math
from xml.sax.saxutils import escape

WIDTH, HEIGHT = 900, 520  # of a panel
LEFT, RIGHT, TOP, BOTTOM = 70, 30, 56, 60
LEAST_ERROR = 0.01  # of 255; smaller errors are drawn at this value
LABEL_PX = 15  # minimum vertical distance of two labels
COLOURS = {"triptych": "#1769aa", "vtk": "#c2410c", "vdb_render": "#4d7c0f"}


def colour_of(name):
    return next(colour for start, colour in COLOURS.items() if name.startswith(start))


def _decades(values):
    """Returns the edges of an axis as decimal logarithms, a little beyond the values."""
    low, high = math.log10(min(values)), math.log10(max(values))
    room = max(0.12, 0.08 * (high - low))
    return low - room, high + room


def _ticks(edges):
    """Returns the values 1, 2, 5, 10, ... within an axis."""
    first, last = math.floor(edges[0]), math.ceil(edges[1])
    every = [(mantissa * 10.0 ** power) for power in range(first, last + 1)
             for mantissa in (1, 2, 5)]
    return [v for v in every if edges[0] <= math.log10(v) <= edges[1]]


class Plot:
    def __init__(self, points):
        self.x = _decades([p[1] for p in points])
        self.y = _decades([max(LEAST_ERROR, p[2]) for p in points])

    def place(self, ms, error):
        along = (math.log10(ms) - self.x[0]) / (self.x[1] - self.x[0])
        up = (math.log10(max(LEAST_ERROR, error)) - self.y[0]) / (self.y[1] - self.y[0])
        return LEFT + along * (WIDTH - LEFT - RIGHT), HEIGHT - BOTTOM - up * (HEIGHT - TOP - BOTTOM)


def _text(x, y, text, more=""):
    return '<text x="%.1f" y="%.1f"%s>%s</text>' % (x, y, more and " " + more, escape(text))


def _axes(plot, what):
    bottom, right = HEIGHT - BOTTOM, WIDTH - RIGHT
    for ms in _ticks(plot.x):
        x, _ = plot.place(ms, 1)
        yield '<path d="M%.1f %dV%d"/>' % (x, TOP, bottom)
        yield _text(x, bottom + 18, "%g" % ms, 'text-anchor="middle"')
    for error in _ticks(plot.y):
        _, y = plot.place(1, error)
        yield '<path d="M%d %.1fH%d"/>' % (LEFT, y, right)
        yield _text(LEFT - 8, y + 4, "%g" % error, 'text-anchor="end"')
    yield _text((LEFT + right) / 2, HEIGHT - 16, "milliseconds per frame, median",
                'text-anchor="middle"')
    yield _text(0, 0, "mean error of %s, of 255" % what, 'text-anchor="middle" transform="translate(20 %d) '
                'rotate(-90)"' % ((TOP + bottom) / 2))


def _labels(points, plot):
    """Returns the position of each name: beside its point, moved down until it covers no other name
    and no other point."""
    dots = {name: plot.place(ms, error) for name, ms, error in points}
    taken, places = [], {}
    for name, ms, error in sorted(points, key=lambda p: plot.place(p[1], p[2])[1]):
        x, y = plot.place(ms, error)
        width = 7 * len(name)
        left = x + 9 if x + 9 + width < WIDTH - 4 else x - 9 - width
        row = y + 4
        others = taken + [(u - 6, v + 4, 12) for other, (u, v) in dots.items() if other != name]
        while any(abs(row - r) < LABEL_PX and left < l + w and l < left + width
                  for l, r, w in others):
            row += 3
        taken.append((left, row, width))
        places[name] = left, row
    return places


def _panel(points, what):
    """Returns SVG lines of a panel. `points` are (name, milliseconds, error)."""
    plot = Plot(points)
    axes = list(_axes(plot, what))
    lines = ['<g stroke="#ddd" fill="none">']
    lines += [line for line in axes if line.startswith("<path")] + ["</g>"]
    lines += [line for line in axes if line.startswith("<text")]
    labels = _labels(points, plot)
    for name, ms, error in points:
        x, y = plot.place(ms, error)
        left, row = labels[name]
        lines.append('<circle cx="%.1f" cy="%.1f" r="5" fill="%s"/>' % (x, y, colour_of(name)))
        if abs(row - y - 4) > LABEL_PX:
            lines.append('<path d="M%.1f %.1fL%.1f %.1f" stroke="#999"/>' %
                         (x, y, left - 2 if left > x else left + 7 * len(name), row - 4))
        lines.append(_text(left, row, name, 'fill="%s"' % colour_of(name)))
    return lines


def svg(title, panels):
    """Returns SVG text. `panels` maps "colour" or "opacity" to points (name, milliseconds, mean
    error)."""
    height = HEIGHT * len(panels)
    lines = ['<svg xmlns="http://www.w3.org/2000/svg" width="%d" height="%d" viewBox="0 0 %d %d" '
             'font-family="sans-serif" font-size="12">' % (WIDTH, height, WIDTH, height),
             '<rect width="100%" height="100%" fill="#fff"/>',
             _text(LEFT, 26, title, 'font-size="15"')]
    for number, (what, points) in enumerate(panels.items()):
        lines += ['<g transform="translate(0 %d)">' % (number * HEIGHT), *_panel(points, what),
                  "</g>"]
    return "\n".join(lines + ["</svg>"]) + "\n"
