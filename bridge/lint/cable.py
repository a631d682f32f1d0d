"""The cable of a bus beside what the manuals of its nodes allow at its bit rate.

Where several makers' nodes are on a bus the smallest length counts (EDS84DMOTCAN §5.2.4, "Mischbetrieb").
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from bridge.config import CableTable
from bridge.lint.checked_bus import CheckedBus
from bridge.lint.report import LintReport
from bridge.text import Text
from bridge.tomlfile import Key

_TERMINATIONS: Final = 2


@dataclass(frozen=True, slots=True)
class Manual:
    """Limits of a maker's manual. ``lengths`` are (bit/s, m) of the whole bus; ``wires`` (m, mm²): up to this
    length at least this cross-section, ``segments`` (nodes, m) by cross-section in mm²: up to so many nodes
    a segment without a repeater may be so long. ``line`` is the section by which nodes are in a line."""

    source: str
    line: str
    lengths: Sequence[tuple[int, float]]
    wires: Sequence[tuple[float, float]] = ()
    segments: Mapping[float, Sequence[tuple[int, float]]] = field(
        default_factory=dict[float, Sequence[tuple[int, float]]]
    )

    def longest_m(self, bitrate: int) -> float:
        """Longest bus in m at this bit rate in bit/s: that of the next higher one in the table."""
        return max((length for rate, length in self.lengths if rate >= bitrate), default=0.0)

    def fastest(self, length_m: float) -> int | None:
        """Highest bit rate of the table at which a bus may be so long; None where there is none."""
        return max((rate for rate, length in self.lengths if length >= length_m), default=None)

    def thinnest_mm2(self, length_m: float) -> float | None:
        """Least cross-section in mm² for wires of this length in m; None where the manual does not say."""
        return next((area for length, area in self.wires if length_m <= length), None)

    def segment_m(self, area_mm2: float, nodes: int) -> float | None:
        """Longest segment in m: by the next smaller cross-section and the next higher number of nodes. None
        where the manual does not say."""
        area = max((one for one in self.segments if one <= area_mm2), default=None)
        if area is None:
            return None
        return next((length for most, length in self.segments[area] if nodes <= most), None)


_ROWS: Final = (2, 5, 10, 20, 32, 63)
MANUALS: Final[Mapping[str, Manual]] = {
    "Getriebebau NORD": Manual(
        "BU 2500 §5.2",
        "BU 2500 §3.2",
        ((1_000_000, 25), (800_000, 50), (500_000, 80), (250_000, 230), (125_000, 480), (50_000, 1000)),
        ((50, 0.25), (80, 0.34), (230, 0.5), (480, 0.75), (1000, 1.0)),
    ),
    "Lenze": Manual(
        "EDS84DMOTCAN §5.2.4",
        "EDS84DMOTCAN §5.2.1",
        (
            (1_000_000, 13),
            (800_000, 38),
            (500_000, 113),
            (250_000, 275),
            (125_000, 600),
            (50_000, 1575),
            (20_000, 4013),
        ),
        ((300, 0.25), (1000, 0.5)),  # §5.2.3
        {
            0.25: tuple(zip(_ROWS, (240, 230, 230, 210, 200, 170), strict=True)),
            0.5: tuple(zip(_ROWS, (430, 420, 410, 390, 360, 310), strict=True)),
            0.75: tuple(zip(_ROWS, (650, 640, 620, 580, 550, 470), strict=True)),
            1.0: tuple(zip(_ROWS, (940, 920, 900, 850, 800, 690), strict=True)),
        },
    ),
    "STÖBER Antriebstechnik": Manual(
        "ID 441684.06 §4.1",
        "ID 441684.06 §4.1",
        (
            (1_000_000, 10),
            (800_000, 30),
            (500_000, 100),
            (250_000, 250),
            (125_000, 500),
            (100_000, 800),
            (50_000, 1000),
            (20_000, 2500),
            (10_000, 5000),
        ),
    ),
}
"""Manuals by the vendor of a family."""


def check_cable(bus: CheckedBus, report: LintReport) -> None:
    """Judge the cable by the site file; without entries there nothing is reported."""
    cable, key = bus.table.cable, (*bus.key, "cable")
    if not cable:
        return
    vendors = dict.fromkeys(node.family.family.vendor for node in bus.nodes)
    manuals = [MANUALS[vendor] for vendor in vendors if vendor in MANUALS]
    if manuals:
        _check_length(bus, manuals, report)
    else:
        report.warning(key, Text.of("check.cable_not_judged"))
    for place, segment in enumerate(cable):
        nodes = segment.nodes or len(bus.nodes) + 1
        for manual in manuals:
            _check_wires(segment, (*key, place), manual, report)
            _check_segment(segment, (*key, place), manual, nodes, report, is_first=not place)
        if segment.terminations not in (None, _TERMINATIONS):
            report.warning(
                (*key, place, "terminations"),
                Text.of("check.terminations", number=segment.terminations),
            )
        if segment.longest_stub_m and manuals:
            report.warning(
                (*key, place, "longest_stub_m"),
                Text.of("check.stub", length=segment.longest_stub_m, source=manuals[0].line),
            )


def _check_length(bus: CheckedBus, manuals: Sequence[Manual], report: LintReport) -> None:
    """Judge the length of the bus. A repeater delays the signal like a length of cable (EDS84DMOTCAN
    §5.2.4)."""
    cable, rate = bus.table.cable, bus.table.bitrate
    total_m = sum(segment.length_m for segment in cable)
    repeaters_m = sum(segment.repeater_m for segment in cable[1:])
    strictest = min(manuals, key=lambda manual: manual.longest_m(rate))
    most_m = strictest.longest_m(rate) - repeaters_m
    if total_m <= most_m:
        return
    slower = [manual.fastest(total_m + repeaters_m) for manual in manuals]
    rates = [one for one in slower if one is not None]
    advice = Text.of("check.cable_advice")
    if len(rates) == len(slower):
        advice = Text.of("check.cable_rate_advice", rate=min(rates))
    most_m, source = max(0.0, most_m), strictest.source
    said = Text.of("check.cable_long", length=total_m, rate=rate / 1000, most=most_m, source=source)
    report.warning((*bus.key, "cable"), said, advice)


def _check_wires(segment: CableTable, key: Key, manual: Manual, report: LintReport) -> None:
    least_mm2 = manual.thinnest_mm2(segment.length_m)
    area_mm2 = segment.cross_section_mm2
    if area_mm2 is None or least_mm2 is None or area_mm2 >= least_mm2:
        return
    length_m, source = segment.length_m, manual.source
    said = Text.of("check.wires_thin", area=area_mm2, length=length_m, least=least_mm2, source=source)
    report.warning((*key, "cross_section_mm2"), said, Text.of("check.wires_advice"))


def _check_segment(
    segment: CableTable, key: Key, manual: Manual, nodes: int, report: LintReport, *, is_first: bool
) -> None:
    area_mm2 = segment.cross_section_mm2
    longest_m = None if area_mm2 is None else manual.segment_m(area_mm2, nodes)
    if area_mm2 is None or longest_m is None:
        return
    most_m = longest_m if is_first else longest_m - segment.repeater_m
    if segment.length_m <= most_m:
        return
    said = Text.of(
        "check.segment_long",
        length=segment.length_m,
        nodes=nodes,
        area=area_mm2,
        most=max(0.0, most_m),
        source=manual.source,
    )
    report.warning((*key, "length_m"), said, Text.of("check.wires_advice"))
