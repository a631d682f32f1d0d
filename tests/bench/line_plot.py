"""A small plot of lines as SVG: x logarithmic with a mark at each point, y linear from 0 or logarithmic."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape

_WIDTH, _HEIGHT = 480, 280
_LEFT, _RIGHT, _TOP, _BOTTOM = 56, 80, 32, 44
_COLOURS = ("#0a7d4f", "#b8741a", "#a33030", "#4a4a8a")
_STEPS = (1, 2, 5)
_LINE = 13
"""From one line of text to the next."""


@dataclass(frozen=True, slots=True)
class Line:
    name: str
    points: list[tuple[float, float]]


def line_plot(title: str, x_name: str, lines: Sequence[Line], *, log_y: bool = False) -> str:
    """Lines without points are left out. Logarithmic: all values must be above 0."""
    shown = [line for line in lines if line.points]
    xs = sorted({x for line in shown for x, _ in line.points}) or [1.0]
    ys = [y for line in shown for _, y in line.points] or [1.0]
    marks = _decades(min(ys), max(ys)) if log_y else _linear(max(ys))
    scale = _scale(marks[0], marks[-1], log_y)

    def at_x(x: float) -> float:
        span = math.log(xs[-1] / xs[0]) or 1.0
        return _LEFT + (_WIDTH - _LEFT - _RIGHT) * math.log(x / xs[0]) / span

    def at_y(y: float) -> float:
        return _HEIGHT - _BOTTOM - (_HEIGHT - _TOP - _BOTTOM) * scale(y)

    parts = [
        _text(_LEFT, 18, title, weight="bold"),
        _text((_LEFT + _WIDTH - _RIGHT) / 2, _HEIGHT - 8, x_name, anchor="middle"),
    ]
    for mark in marks:
        y = at_y(mark)
        parts.append(f'<path d="M{_LEFT} {y:.1f}H{_WIDTH - _RIGHT}" stroke="#ddd"/>')
        parts.append(_text(_LEFT - 6, y + 4, f"{mark:g}", anchor="end"))
    parts += [_text(at_x(x), _HEIGHT - _BOTTOM + 16, f"{x:g}", anchor="middle") for x in xs]
    beyond = -math.inf
    ends = sorted(zip(_COLOURS, shown, strict=False), key=lambda pair: at_y(pair[1].points[-1][1]))
    for colour, line in ends:
        places = [(at_x(x), at_y(y)) for x, y in line.points]
        path = "L".join(f"{x:.1f} {y:.1f}" for x, y in places)
        parts.append(f'<path d="M{path}" fill="none" stroke="{colour}" stroke-width="2"/>')
        parts += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="{colour}"/>' for x, y in places]
        # Names stand below each other even where lines end at the same height.
        beyond = max(places[-1][1] + 4, beyond + _LINE)
        parts.append(_text(places[-1][0] + 8, beyond, line.name, colour=colour))
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH} {_HEIGHT}" font-family="sans-serif"'
    )
    background = f'<rect width="{_WIDTH}" height="{_HEIGHT}" fill="#fff"/>'
    return "\n".join([f'{head} font-size="11">', background, *parts, "</svg>"]) + "\n"


def _scale(least: float, most: float, is_log: bool) -> Callable[[float], float]:
    if is_log:
        return lambda value: math.log(value / least) / math.log(most / least)
    return lambda value: (value - least) / (most - least)


def _linear(most: float) -> list[float]:
    """Round numbers from 0 to beyond the greatest value, four to eight of them."""
    least_step = (most or 1.0) / 6
    decade = 10 ** math.floor(math.log10(least_step))
    step = next(decade * one for one in (*_STEPS, 10) if decade * one >= least_step)
    return [step * n for n in range(math.ceil((most or 1.0) / step) + 1)]


def _decades(least: float, most: float) -> list[float]:
    """1, 2 and 5 of each decade, as far as the values reach."""
    first, last = math.floor(math.log10(least)), math.ceil(math.log10(most))
    marks = [one * 10.0**decade for decade in range(first, last + 1) for one in _STEPS]
    below = [mark for mark in marks if mark <= least][-1]
    above = next(mark for mark in marks if mark >= most and mark > below)
    return [mark for mark in marks if below <= mark <= above]


def _text(
    x: float, y: float, text: str, *, anchor: str = "start", weight: str = "normal", colour: str = "#333"
) -> str:
    style = f'text-anchor="{anchor}" font-weight="{weight}" fill="{colour}"'
    return f'<text x="{x:.1f}" y="{y:.1f}" {style}>{escape(text)}</text>'
