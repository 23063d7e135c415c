"""A line chart as SVG, written by hand: crisp at any size, and dark where the reader's page is."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from typing import NamedTuple
from xml.sax.saxutils import escape

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

WIDTH, HEIGHT = 760, 430
LEFT, TOP, RIGHT, BOTTOM = 74, 56, 540, 360
"""The frame of the plot, pixels from the picture's top left corner."""
LINE_HEIGHT = 26
COLOURS = (("#0b63c5", "#6cb6ff"), ("#c2500a", "#f69d50"), ("#16794c", "#57d39a"), ("#8036c4", "#d2a8ff"))
"""Of the curves, in their order: on a light page and on a dark one."""
STYLE = """
text { font: 15px system-ui, 'Segoe UI', 'Helvetica Neue', Arial, sans-serif; fill: #24292f }
.card { fill: #ffffff; stroke: #d0d7de }
.title { font-size: 18px; font-weight: 600 }
.tick { font-size: 13px; fill: #57606a }
.grid { stroke: #e4e8ec }
.frame { stroke: #8c959f }
.curve { fill: none; stroke-width: 2.6; stroke-linejoin: round; stroke-linecap: round }
.measured { fill: none; stroke: #8c959f; stroke-width: 1.8; stroke-dasharray: 6 5 }
"""
DARK = """
text { fill: #e6edf3 }
.card { fill: #0d1117; stroke: #30363d }
.tick { fill: #9198a1 }
.grid { stroke: #21262d }
.frame { stroke: #6e7681 }
.measured { stroke: #7d8590 }
"""


class Axis(NamedTuple):
    """One axis: its label, its ticks with their texts; it runs from the first tick to the last."""

    label: str
    ticks: Mapping[float, str]

    def share(self, values: Floats) -> Floats:
        """Where values lie between the axis's ends, 0..1."""
        ends = list(self.ticks)
        return (values - ends[0]) / (ends[-1] - ends[0])


class Line(NamedTuple):
    """One curve: what the legend calls it, and its values over the chart's abscissae."""

    text: str
    values: Floats
    is_reference: bool = False
    """Whether it is drawn dashed and grey, as something to compare with."""


def chart(title: str, across: Axis, upwards: Axis, places: Floats, lines: Sequence[Line]) -> str:
    """The chart as the text of an SVG file. ``places`` are the abscissae of all lines."""
    colours = iter(range(len(COLOURS)))
    classes = ["measured" if line.is_reference else f"curve c{next(colours)}" for line in lines]
    numbers = range(len(lines) - sum(line.is_reference for line in lines))
    light = "".join(f".c{k} {{ stroke: {COLOURS[k][0]} }}\n" for k in numbers)
    dark = "".join(f".c{k} {{ stroke: {COLOURS[k][1]} }}\n" for k in numbers)
    size = f'viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}"'
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" {size} role="img" aria-label="{escape(title)}">',
        f"<style>{STYLE}{light}@media (prefers-color-scheme: dark) {{{DARK}{dark}}}\n</style>",
        f'<rect class="card" x="0.5" y="0.5" width="{WIDTH - 1}" height="{HEIGHT - 1}" rx="8"/>',
        f'<text class="title" x="{LEFT}" y="34">{escape(title)}</text>',
        *_axes(across, upwards),
        *_legend(lines, classes),
    ]
    x = LEFT + across.share(places) * (RIGHT - LEFT)
    for line, name in zip(lines, classes, strict=True):
        y = BOTTOM - upwards.share(line.values) * (BOTTOM - TOP)
        points = " ".join(f"{a:.1f},{b:.2f}" for a, b in zip(x, y, strict=True))
        parts.append(f'<polyline class="{name}" points="{points}"/>')
    return "\n".join([*parts, "</svg>", ""])


def _axes(across: Axis, upwards: Axis) -> list[str]:
    parts = []
    for value, text in across.ticks.items():
        x = LEFT + float(across.share(np.array(value))) * (RIGHT - LEFT)
        parts.append(f'<line class="grid" x1="{x:.1f}" y1="{TOP}" x2="{x:.1f}" y2="{BOTTOM}"/>')
        parts.append(f'<text class="tick" x="{x:.1f}" y="{BOTTOM + 21}" text-anchor="middle">{escape(text)}</text>')
    for value, text in upwards.ticks.items():
        y = BOTTOM - float(upwards.share(np.array(value))) * (BOTTOM - TOP)
        parts.append(f'<line class="grid" x1="{LEFT}" y1="{y:.1f}" x2="{RIGHT}" y2="{y:.1f}"/>')
        parts.append(f'<text class="tick" x="{LEFT - 9}" y="{y + 4.5:.1f}" text-anchor="end">{escape(text)}</text>')
    middle_x, middle_y = (LEFT + RIGHT) / 2, (TOP + BOTTOM) / 2
    return [
        *parts,
        f'<polyline class="frame" fill="none" points="{LEFT},{TOP} {LEFT},{BOTTOM} {RIGHT},{BOTTOM}"/>',
        f'<text x="{middle_x}" y="{BOTTOM + 49}" text-anchor="middle">{escape(across.label)}</text>',
        f'<text transform="translate(24 {middle_y}) rotate(-90)" text-anchor="middle">{escape(upwards.label)}</text>',
    ]


def _legend(lines: Sequence[Line], classes: Sequence[str]) -> list[str]:
    parts = []
    for number, (line, name) in enumerate(zip(lines, classes, strict=True)):
        y = TOP + 12 + LINE_HEIGHT * number
        parts.append(f'<line class="{name}" x1="{RIGHT + 22}" y1="{y}" x2="{RIGHT + 50}" y2="{y}"/>')
        parts.append(f'<text x="{RIGHT + 59}" y="{y + 5}">{escape(line.text)}</text>')
    return parts


def read_lines(svg: str, across: Axis, upwards: Axis) -> list[tuple[Floats, Floats]]:
    """The abscissae and values of the curves of a chart's file."""
    found = []
    for element in ET.fromstring(svg).iter("{http://www.w3.org/2000/svg}polyline"):  # noqa: S314 - our own file
        if element.attrib["class"] != "frame":
            x, y = np.array([point.split(",") for point in element.attrib["points"].split()], np.float64).T
            ends_x, ends_y = list(across.ticks), list(upwards.ticks)
            places = ends_x[0] + (x - LEFT) / (RIGHT - LEFT) * (ends_x[-1] - ends_x[0])
            values = ends_y[0] + (BOTTOM - y) / (BOTTOM - TOP) * (ends_y[-1] - ends_y[0])
            found.append((places, values))
    return found
