"""Drawings that are part of an HTML page: a graph of boxes and arrows, and curves on logarithmic axes.

Text and lines have the colour of the page's text, so that they show on light and on dark pages, and boxes are links:
matplotlib's SVG has fixed colours, no links, and more than twice the size.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from markupsafe import Markup, escape

_BOX, _HEIGHT, _GAP, _BETWEEN = 148, 44, 16, 56
_MARGIN = 4


class Node(NamedTuple):
    """A box of a graph: its name, a line below it, and what it links to, if anything."""

    name: str
    words: str
    target: str | None = None


def flow_graph(columns: Sequence[Mapping[str, Node]], arrows: Sequence[tuple[str, str]], title: str) -> Markup:
    """A graph of boxes in columns, from left to right, with arrows between them.

    Parameters
    ----------
    columns : the boxes of every column, from top to bottom, by keys that `arrows` name.
    arrows : pairs of keys; the first stands further left.
    title : what the graph shows, for those who cannot see it.
    """
    columns = [column for column in columns if column]
    tallest = max(map(len, columns))
    height = tallest * _HEIGHT + (tallest - 1) * _GAP + 2 * _MARGIN
    width = len(columns) * _BOX + (len(columns) - 1) * _BETWEEN + 2 * _MARGIN
    places = {}
    for k, column in enumerate(columns):
        top = (height - len(column) * _HEIGHT - (len(column) - 1) * _GAP) / 2
        for row, key in enumerate(column):
            places[key] = (_MARGIN + k * (_BOX + _BETWEEN), top + row * (_HEIGHT + _GAP))
    parts = [
        f'<svg class="graph" viewBox="0 0 {width} {height:g}" width="{width}" height="{height:g}" role="img" '
        f'aria-label="{escape(title)}">',
        '<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
        '<path class="tip" d="M0 0.5 8 4 0 7.5z"></path></marker></defs>',
    ]
    for start, end in arrows:
        (x, y), (to_x, to_y) = places[start], places[end]
        x, y, to_y = x + _BOX, y + _HEIGHT / 2, to_y + _HEIGHT / 2
        # Between the columns, so that arrows that pass a column stay level there.
        bend = to_x - _BETWEEN / 2
        parts.append(
            f'<path class="arrow" marker-end="url(#tip)" d="M{x:g} {y:g}H{bend - _BETWEEN / 2:g}'
            f'C{bend:g} {y:g} {bend:g} {to_y:g} {to_x - 1:g} {to_y:g}"></path>'
        )
    for key, (x, y) in places.items():
        node = next(column[key] for column in columns if key in column)
        box = (
            f'<rect class="box" x="{x:g}" y="{y:g}" width="{_BOX}" height="{_HEIGHT}" rx="7"></rect>'
            f'<text class="name" x="{x + _BOX / 2:g}" y="{y + 19:g}">{escape(node.name)}</text>'
            f'<text class="words" x="{x + _BOX / 2:g}" y="{y + 35:g}">{escape(node.words)}</text>'
        )
        parts.append(f'<a href="{escape(node.target)}">{box}</a>' if node.target else f"<g>{box}</g>")
    return Markup("".join([*parts, "</svg>"]))


class Curve(NamedTuple):
    """A curve of positive values: its name in the legend (none if empty), colour, and points."""

    name: str
    colour: str
    x: np.ndarray
    y: np.ndarray


_WIDTH, _TALL = 720, 400
_LEFT, _RIGHT, _TOP, _BOTTOM = 74, 14, 12, 48
_LEGEND_LINE = 18


def logarithmic_chart(curves: Sequence[Curve], x_label: str, y_label: str, title: str) -> Markup:
    """Curves on double logarithmic axes; labels and names may hold HTML's entities for powers, as superscripts."""
    x, y = (np.concatenate([getattr(curve, name) for curve in curves]) for name in "xy")
    x_range, y_range = ((np.log10(values.min()), np.log10(values.max())) for values in (x, y))
    x_range, y_range = (_widened(*limits) for limits in (x_range, y_range))
    inner = (_WIDTH - _LEFT - _RIGHT, _TALL - _TOP - _BOTTOM)

    def across(values):
        return _LEFT + (np.log10(values) - x_range[0]) / (x_range[1] - x_range[0]) * inner[0]

    def down(values):
        return _TOP + (y_range[1] - np.log10(values)) / (y_range[1] - y_range[0]) * inner[1]

    parts = [
        f'<svg class="chart" viewBox="0 0 {_WIDTH} {_TALL}" role="img" aria-label="{escape(title)}">',
        f'<rect class="frame" x="{_LEFT}" y="{_TOP}" width="{inner[0]}" height="{inner[1]}"></rect>',
    ]
    for power in _decades(*x_range):
        at = float(across(10.0**power))
        parts.append(f'<path class="grid" d="M{at:.1f} {_TOP}v{inner[1]}"></path>')
        parts.append(f'<text class="tick" text-anchor="middle" x="{at:.1f}" y="{_TALL - 28}">{_power(power)}</text>')
    for power in _decades(*y_range):
        at = float(down(10.0**power))
        parts.append(f'<path class="grid" d="M{_LEFT} {at:.1f}h{inner[0]}"></path>')
        parts.append(f'<text class="tick" text-anchor="end" x="{_LEFT - 7}" y="{at + 4:.1f}">{_power(power)}</text>')
    for curve in curves:
        points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(across(curve.x), down(curve.y), strict=True))
        parts.append(f'<polyline class="curve" stroke="{curve.colour}" points="{points}"></polyline>')
    for k, curve in enumerate(curve for curve in curves if curve.name):
        at = _TALL - _BOTTOM - 14 - _LEGEND_LINE * (sum(bool(each.name) for each in curves) - 1 - k)
        parts.append(f'<path class="curve" stroke="{curve.colour}" d="M{_LEFT + 14} {at - 4}h26"></path>')
        parts.append(f'<text class="tick" x="{_LEFT + 48}" y="{at}">{escape(curve.name)}</text>')
    middle = _TOP + inner[1] / 2
    parts.append(f'<text class="label" x="{_LEFT + inner[0] / 2:g}" y="{_TALL - 7}">{escape(x_label)}</text>')
    parts.append(f'<text class="label" transform="translate(15 {middle:g}) rotate(-90)">{escape(y_label)}</text>')
    return Markup("".join([*parts, "</svg>"]))


def _widened(low, high):
    room = max(0.05 * (high - low), 0.05)
    return low - room, high + room


def _decades(low, high):
    powers = range(int(np.ceil(low)), int(np.floor(high)) + 1)
    return powers[:: 1 + len(powers) // 7]


def _power(exponent):
    return f'10<tspan dy="-5" font-size="9">{str(exponent).replace("-", "−")}</tspan>'
