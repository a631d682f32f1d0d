#!/usr/bin/env python3
"""Draw docs/images/demo.svg from a run of ``drivebridge demo``: a controller falls silent, its drive stops.

    .venv/bin/python -m tools.demo_picture

Every curve, number and state in the picture is what this run's Modbus client wrote and read.
"""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Final
from xml.sax.saxutils import escape

from pymodbus.client import ModbusTcpClient

PICTURE: Final = Path(__file__).resolve().parents[1] / "docs" / "images" / "demo.svg"

PREPARE_S: Final = 0.75
RUN_S: Final = 2.0
SILENT_S: Final = 3.0
WRITE_EVERY_S: Final = 0.25
READ_EVERY_S: Final = 0.02
READY: Final = (0x047E, 0)
RUN_HALF: Final = (0x047F, 0x2000)
P105_HZ: Final = 50.0
TRIPPED: Final = 3
STATES: Final = {1: "switch-on inhibited", 2: "ready", 4: "operation enabled", 7: "fault"}
COLOURS: Final = {2: "#d9e2ec", 4: "#b7e4c7", 7: "#ffc9c9"}


@dataclass(frozen=True, slots=True)
class Sample:
    """What one read showed; ``at_s`` counts from the first word that enables the drive."""

    at_s: float
    status_word: int
    frequency_hz: float
    state: int
    watchdog: int


@dataclass(frozen=True, slots=True)
class Run:
    writes_s: Sequence[float]
    samples: Sequence[Sample]
    promised_ms: int

    @property
    def tripped_s(self) -> float:
        return next(sample.at_s for sample in self.samples if sample.watchdog == TRIPPED)


@contextmanager
def demo() -> Iterator[None]:
    """The demo, from when fu1's node is in operation."""
    command = [sys.executable, "-m", "bridge", "demo"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as process:
        try:
            assert process.stdout
            if not any("conveyor: node operational" in line for line in process.stdout):
                raise SystemExit("the demo did not start: does another one run?")
            yield
        finally:
            process.terminate()
            process.communicate()


def record() -> Run:
    """Move fu1 as a PLC would, then stop writing and only look."""
    writes: list[float] = []
    samples: list[Sample] = []
    with ModbusTcpClient("127.0.0.1", port=1502) as plc:
        while plc.read_input_registers(0, count=15).isError():  # no data from the drive yet
            time.sleep(READ_EVERY_S)
        high, low = plc.read_input_registers(42, count=2).registers
        start = time.monotonic() + PREPARE_S
        due = time.monotonic()
        while (now := time.monotonic() - start) < RUN_S + SILENT_S:
            if now < RUN_S and time.monotonic() >= due:
                due += WRITE_EVERY_S
                plc.write_registers(0, list(READY if now < 0 else RUN_HALF))
                writes.append(now)
            words = plc.read_input_registers(0, count=15).registers
            hz = P105_HZ * (words[1] - (words[1] >> 15 << 16)) / 16384
            samples.append(Sample(time.monotonic() - start, words[0], hz, words[10], words[14]))
            time.sleep(READ_EVERY_S)
    return Run(writes, samples, high << 16 | low)


# drawing

_LEFT, _PER_S, _WIDTH, _HEIGHT = 130, 105, 760, 300
_TOP_HZ, _ZERO_HZ = 105, 190


def _x(at_s: float) -> float:
    return round(_LEFT + _PER_S * (at_s + PREPARE_S), 1)


def _y(hz: float) -> float:
    return round(_ZERO_HZ - (_ZERO_HZ - _TOP_HZ) * hz / 25, 1)


def _text(x: float, y: float, words: str, more: str = "") -> str:
    return f'<text x="{x}" y="{y}" {more}>{escape(words)}</text>'


def draw(run: Run) -> str:
    """The picture as SVG."""
    last, end = run.writes_s[-1], run.samples[-1].at_s
    took_ms = round(1000 * (run.tripped_s - last))
    silent = round(_x(run.tripped_s) - _x(last), 1)
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {_WIDTH} {_HEIGHT}" '
        'font-family="sans-serif" font-size="13" fill="#243b53">',
        "<title>A controller falls silent, and its drive stops</title>",
        f'<rect width="{_WIDTH}" height="{_HEIGHT}" fill="#ffffff"/>',
        _text(
            16, 26, "A PLC runs drive fu1 of the demo, then falls silent", 'font-size="16" font-weight="bold"'
        ),
        *_labels(),
        *(f'<path d="M{_x(at)} 52v18" stroke="#0b7285" stroke-width="3"/>' for at in run.writes_s),
        f'<rect x="{_x(last)}" y="48" width="{silent}" height="184" fill="#fff3bf"/>',
        f'<path d="M{_x(last)} 52v18" stroke="#0b7285" stroke-width="3"/>',
        *(f'<path d="M{_LEFT} {_y(hz)}H{_x(end)}" stroke="#bcccdc" stroke-width="1"/>' for hz in (0, 25)),
        f'<polyline fill="none" stroke="#c92a2a" stroke-width="2.5" points="{_curve(run.samples)}"/>',
        *_states(run.samples),
        *(_text(_x(s), 254, f"{s} s", 'text-anchor="middle" font-size="11"') for s in range(int(end) + 1)),
        _text(
            _x(run.tripped_s) + 8, 66, f"stopped after {took_ms} ms; promised: {run.promised_ms} ms at most"
        ),
        _text(16, 286, "Drawn by tools/demo_picture.py from what a Modbus client read.", 'font-size="11"'),
        "</svg>",
    ]
    return "\n".join(lines) + "\n"


def _labels() -> Iterator[str]:
    yield _text(16, 66, "PLC writes")
    yield _text(16, _TOP_HZ + 4, "frequency   25 Hz")
    yield _text(_LEFT - 34, _ZERO_HZ + 4, "0 Hz")
    yield _text(16, 222, "status word")


def _curve(samples: Sequence[Sample]) -> str:
    """Where it bends: the first and the last sample of each value."""
    points: list[str] = []
    for _, same in groupby(samples, key=lambda sample: sample.frequency_hz):
        first, *rest = same
        points += [f"{_x(sample.at_s)},{_y(sample.frequency_hz)}" for sample in (first, *rest[-1:])]
    return " ".join(points)


def _states(samples: Sequence[Sample]) -> Iterator[str]:
    """A bar for each state, from when it was first read until the next one was."""
    bars = [next(same) for _, same in groupby(samples, key=lambda sample: sample.state)]
    ends = [*(sample.at_s for sample in bars[1:]), samples[-1].at_s]
    for bar, end in zip(bars, ends, strict=True):
        width = _x(end) - _x(bar.at_s)
        colour = COLOURS.get(bar.state, "#f1f3f5")
        yield f'<rect x="{_x(bar.at_s)}" y="206" width="{width:.1f}" height="26" fill="{colour}"/>'
        words = f"{bar.status_word:04X}h {STATES.get(bar.state, '')}"
        shown = words if width > 7 * len(words) else words[:5]
        if width > 7 * len(shown):
            yield _text(_x(bar.at_s) + 6, 223, shown, 'font-size="12"')


def main() -> None:
    with demo():
        run = record()
    PICTURE.parent.mkdir(exist_ok=True)
    PICTURE.write_text(draw(run), encoding="utf-8")
    print(
        f"{PICTURE.name}: {len(run.samples)} samples, tripped {run.tripped_s - run.writes_s[-1]:.3f} s later"
    )


if __name__ == "__main__":
    main()
