"""Figures as SVG: axes, lines, bands, bars and marks; the same bytes for the same numbers."""

import math
from xml.sax.saxutils import escape

BLUE, ORANGE, GREEN, RED, GREY = "#0072b2", "#e69f00", "#009e73", "#d55e00", "#6b6b6b"
FONT = "font-family='Helvetica, Arial, sans-serif'"


def number(x):
    """One digit behind the point: a tenth of a pixel."""
    text = f"{x:.1f}"
    return text[:-2] if text.endswith(".0") else text


def nice_step(span, most):
    raw = span / most
    power = 10.0 ** math.floor(math.log10(raw))
    return next(k * power for k in (1, 2, 2.5, 5, 10) if k * power >= raw * (1 - 1e-9))


class Axes:
    """A rectangle of a figure with its own scales."""

    def __init__(self, figure, box, x_range, y_range, x_label="", y_label="", title="",
                 log_y=False, log_x=False, x_step=None, y_step=None, x_numbers=True,
                 y_numbers=True):
        self.figure, self.box = figure, box
        self.x_range, self.y_range, self.log_y, self.log_x = x_range, y_range, log_y, log_x
        left, top, width, height = box
        self.drawn, self.parts = [], []  # clipped at the frame, and on top of it
        # (name, "line", "band" or "dots", colour)
        self.entries = []
        self._grid(x_step, y_step, x_numbers, y_numbers)
        if title:
            figure.text(left, top - 8, title, size=12, weight="bold")
        if x_label:
            figure.text(left + width / 2, top + height + 34, x_label, anchor="middle")
        if y_label:
            figure.text(left - 46, top + height / 2, y_label, anchor="middle", turn=-90)

    def x(self, value):
        left, _, width, _ = self.box
        return left + width * self._share(value, self.x_range, self.log_x)

    def y(self, value):
        _, top, _, height = self.box
        return top + height * (1 - self._share(value, self.y_range, self.log_y))

    @staticmethod
    def _share(value, limits, log):
        low, high = limits
        if log:
            return (math.log10(max(value, 1e-300)) - math.log10(low)) / math.log10(high / low)
        return (value - low) / (high - low)

    @staticmethod
    def _ticks(limits, log, step, most):
        low, high = limits
        if log:
            first, last = math.ceil(math.log10(low) - 1e-9), math.floor(math.log10(high) + 1e-9)
            if last - first >= 2:
                return [10.0 ** k for k in range(first, last + 1)]
            # Too few powers of ten to read a value by: 1, 2 and 5 of each decade.
            ticks = [k * 10.0 ** power for power in range(first - 1, last + 1) for k in (1, 2, 5)]
            return [t for t in ticks if low * (1 - 1e-9) <= t <= high * (1 + 1e-9)]
        step = step or nice_step(high - low, most)
        return [k * step for k in range(math.ceil(low / step - 1e-9),
                                        math.floor(high / step + 1e-9) + 1)]

    def _grid(self, x_step, y_step, x_numbers, y_numbers):
        left, top, width, height = self.box
        figure = self.figure
        for value in self._ticks(self.x_range, self.log_x, x_step, 8):
            at = self.x(value)
            figure.line(at, top, at, top + height, "#e4e4e4", 0.7)
            if x_numbers:
                figure.text(at, top + height + 16, f"{value:g}", anchor="middle", size=10)
        for value in self._ticks(self.y_range, self.log_y, y_step, 5):
            at = self.y(value)
            figure.line(left, at, left + width, at, "#e4e4e4", 0.7)
            if y_numbers:
                figure.text(left - 6, at + 3.5, f"{value:g}", anchor="end", size=10)

    def line(self, points, colour=BLUE, width=1.2, name=None, dash=None):
        path = " ".join(f"{number(self.x(x))},{number(self.y(y))}" for x, y in points)
        dashes = f" stroke-dasharray='{dash}'" if dash else ""
        self.drawn.append(f"<polyline points='{path}' fill='none' stroke='{colour}' "
                          f"stroke-width='{width}' stroke-linejoin='round'{dashes}/>")
        self._note(name, "dash" if dash else "line", colour)

    def band(self, points, colour=BLUE, opacity=0.18, name=None):
        """points: (x, low, high)"""
        upper = [f"{number(self.x(x))},{number(self.y(high))}" for x, _, high in points]
        lower = [f"{number(self.x(x))},{number(self.y(low))}" for x, low, _ in points]
        path = " ".join(upper + lower[::-1])
        self.drawn.append(f"<polygon points='{path}' fill='{colour}' opacity='{opacity}'/>")
        self._note(name, "band", colour)

    def bars(self, edges, counts, colour=BLUE, name=None):
        for k, count in enumerate(counts):
            if not count:
                continue
            x0, x1, y = self.x(edges[k]), self.x(edges[k + 1]), self.y(count)
            self.drawn.append(
                f"<rect x='{number(x0 + 0.5)}' y='{number(y)}' width='{number(x1 - x0 - 1)}' "
                f"height='{number(self.y(self.y_range[0]) - y)}' fill='{colour}' opacity='0.85'/>")
        self._note(name, "band", colour)

    def dots(self, points, colour=BLUE, radius=2.2, opacity=0.6, name=None):
        for x, y in points:
            self.parts.append(f"<circle cx='{number(self.x(x))}' cy='{number(self.y(y))}' "
                              f"r='{radius}' fill='{colour}' opacity='{opacity}'/>")
        self._note(name, "dots", colour)

    def cross(self, x, y, colour=RED, size=4):
        cx, cy = self.x(x), self.y(y)
        for sign in (1, -1):
            self.parts.append(f"<line x1='{number(cx - size)}' y1='{number(cy - sign * size)}' "
                              f"x2='{number(cx + size)}' y2='{number(cy + sign * size)}' "
                              f"stroke='{colour}' stroke-width='1.8'/>")

    def vertical(self, x, colour=GREY, text="", dash="4 3", at_top=True, anchor="start"):
        _, top, _, height = self.box
        at = self.x(x)
        self.parts.append(f"<line x1='{number(at)}' y1='{number(top)}' x2='{number(at)}' "
                          f"y2='{number(top + height)}' stroke='{colour}' stroke-width='1.3' "
                          f"stroke-dasharray='{dash}'/>")
        if text:
            shift = 4 if anchor == "start" else -4
            self.label(at + shift, top + 13 if at_top else top + height - 6, text, colour, anchor)

    def horizontal(self, y, colour=GREY, text="", dash="4 3", anchor="end"):
        left, _, width, _ = self.box
        at = self.y(y)
        self.parts.append(f"<line x1='{number(left)}' y1='{number(at)}' "
                          f"x2='{number(left + width)}' y2='{number(at)}' stroke='{colour}' "
                          f"stroke-width='1.3' stroke-dasharray='{dash}'/>")
        if text:
            x = left + width - 4 if anchor == "end" else left + 4
            self.label(x, at - 5, text, colour, anchor)

    def span(self, x0, x1, colour=GREY):
        _, top, _, height = self.box
        a, b = self.x(x0), self.x(x1)
        self.drawn.append(f"<rect x='{number(a)}' y='{number(top)}' width='{number(b - a)}' "
                          f"height='{number(height)}' fill='{colour}' opacity='0.13'/>")

    def label(self, x, y, text, colour="#222", anchor="start", size=10.5):
        self.parts.append(text_element(x, y, text, size, anchor, colour))

    def note(self, x, y, text, colour="#222", anchor="start", dx=0, dy=0):
        self.label(self.x(x) + dx, self.y(y) + dy, text, colour, anchor)

    def _note(self, name, kind, colour):
        if name:
            self.entries.append((name, kind, colour))

    def legend(self, right=True, top_offset=0):
        left, top, width, _ = self.box
        widest = max(len(name) for name, _, _ in self.entries) * 5.6 + 34
        x = left + width - widest if right else left + 8
        for row, (name, kind, colour) in enumerate(self.entries):
            y = top + 14 + 15 * row + top_offset
            if kind in ("line", "dash"):
                dash = " stroke-dasharray='4 3'" if kind == "dash" else ""
                self.parts.append(f"<line x1='{number(x)}' y1='{number(y - 4)}' "
                                  f"x2='{number(x + 20)}' y2='{number(y - 4)}' stroke='{colour}' "
                                  f"stroke-width='2'{dash}/>")
            elif kind == "band":
                self.parts.append(f"<rect x='{number(x)}' y='{number(y - 9)}' width='20' "
                                  f"height='9' fill='{colour}' opacity='0.35'/>")
            else:
                self.parts.append(f"<circle cx='{number(x + 10)}' cy='{number(y - 4)}' r='3' "
                                  f"fill='{colour}'/>")
            self.label(x + 26, y, name)


def text_element(x, y, text, size=10.5, anchor="start", colour="#222", weight=None, turn=None):
    extra = f" font-weight='{weight}'" if weight else ""
    if turn is not None:
        extra += f" transform='rotate({turn} {number(x)} {number(y)})'"
    return (f"<text x='{number(x)}' y='{number(y)}' font-size='{size}' text-anchor='{anchor}' "
            f"fill='{colour}'{extra}>{escape(text)}</text>")


class Figure:
    def __init__(self, width, height):
        self.width, self.height = width, height
        self.parts, self.all_axes = [], []

    def axes(self, *box, **options):
        made = Axes(self, box, **options)
        self.all_axes.append(made)
        return made

    def line(self, x0, y0, x1, y1, colour, width):
        self.parts.append(f"<line x1='{number(x0)}' y1='{number(y0)}' x2='{number(x1)}' "
                          f"y2='{number(y1)}' stroke='{colour}' stroke-width='{width}'/>")

    def text(self, x, y, text, size=11, anchor="start", weight=None, turn=None, colour="#222"):
        self.parts.append(text_element(x, y, text, size, anchor, colour, weight, turn))

    def write(self, path):
        frame = [f"<rect x='{number(a.box[0])}' y='{number(a.box[1])}' "
                 f"width='{number(a.box[2])}' height='{number(a.box[3])}' fill='none' "
                 "stroke='#444' stroke-width='0.9'/>" for a in self.all_axes]
        lines = [f"<svg xmlns='http://www.w3.org/2000/svg' width='{self.width}' "
                 f"height='{self.height}' viewBox='0 0 {self.width} {self.height}' {FONT}>",
                 "<rect width='100%' height='100%' fill='white'/>", *self.parts]
        for k, a in enumerate(self.all_axes):
            left, top, width, height = map(number, a.box)
            lines += [f"<clipPath id='c{k}'><rect x='{left}' y='{top}' width='{width}' "
                      f"height='{height}'/></clipPath><g clip-path='url(#c{k})'>",
                      *a.drawn, "</g>", *a.parts]
        path.write_text("\n".join(lines + frame + ["</svg>"]) + "\n", encoding="utf-8")
