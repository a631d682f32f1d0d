"""The cable of a bus beside the tables in the manuals."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.lint import Severity, lint
from bridge.lint.cable import MANUALS, Manual
from bridge.mapping import load_family
from bridge.project import load_project
from tests.support import sites

NORD, LENZE, STOEBER = "nord/sk-tu4-cao", "lenze/8400-motec", "stoeber/5000"
CIA402 = "cia402/velocity"


def told(folder: Path, bitrate: int, *segments: str, mappings: tuple[str, ...] = (NORD,)) -> list[str]:
    """Findings on a cable, each with the number of its segment, without file and line."""
    cable = "".join(f"\n[[bus.cable]]\n{segment}\n" for segment in segments)
    nodes = [
        sites.node(
            sites.drive(load_family(mapping).slot[0].name, "modbus", 200, ""),
            name=f"n{number}",
            node_id=number,
            mapping=mapping,
        )
        for number, mapping in enumerate(mappings, 1)
    ]
    bus = sites.bus(*nodes, more=f"bitrate = {bitrate}\n{cable}")
    project = load_project(sites.write(folder, bus, sites.modbus()))
    findings = lint(project.site, project.families, project.path, project.downloads).findings
    of_cable = [one for one in findings if one.fault.key.startswith("bus[0].cable")]
    assert {one.severity for one in of_cable} <= {Severity.WARNING}
    return [
        f"{one.fault.key.removeprefix('bus[0].')}: {one.fault.message}; {one.fault.hint}".removesuffix("; ")
        for one in of_cable
    ]


def segment(length_m: float, *more: str) -> str:
    return "\n".join((f"length_m = {length_m}", *more))


def test_the_worked_example_of_lenze(tmp_path: Path) -> None:
    """EDS84DMOTCAN §5.2.4: 125 kbit/s, 0.5 mm², 28 nodes, 450 m need a repeater after 360 m."""
    wires = ("cross_section_mm2 = 0.5", "nodes = 28")
    assert told(tmp_path, 125_000, segment(450, *wires), mappings=(LENZE,)) == [
        "cable[0].length_m: 450 m are too long a segment for 28 nodes with 0.5 mm²: "
        "360 m at most (EDS84DMOTCAN §5.2.4); thicker wires, or a repeater"
    ]
    assert told(tmp_path, 125_000, segment(360, *wires), segment(90, *wires), mappings=(LENZE,)) == []


def test_with_one_repeater_the_example_reaches_690_m(tmp_path: Path) -> None:
    """Repeater type 2176 costs the second one 30 m. At 50 kbit/s the bus may be so long."""
    wires = ("cross_section_mm2 = 0.5", "nodes = 28")
    assert told(tmp_path, 50_000, segment(360, *wires), segment(330, *wires), mappings=(LENZE,)) == []
    (said,) = told(tmp_path, 50_000, segment(360, *wires), segment(331, *wires), mappings=(LENZE,))
    assert said.startswith("cable[1].length_m: 331 m are too long a segment")
    assert "330 m at most" in said


@pytest.mark.landing(6)
@pytest.mark.parametrize(
    ("bitrate", "length_m"),
    [(1_000_000, 25), (800_000, 50), (500_000, 80), (250_000, 230), (125_000, 480), (50_000, 1000)],
)
def test_nords_table(tmp_path: Path, bitrate: int, length_m: int) -> None:
    """BU 2500 §5.2, table 1."""
    assert told(tmp_path, bitrate, segment(length_m)) == []
    (said,) = told(tmp_path, bitrate, segment(length_m + 1))
    assert f"{length_m} m at most (BU 2500 §5.2)" in said


def test_the_bit_rate_that_fits_is_named(tmp_path: Path) -> None:
    assert told(tmp_path, 500_000, segment(200)) == [
        "cable: 200 m of cable are too long for 500 kbit/s: 80 m at most (BU 2500 §5.2); "
        "bitrate = 250000, or a shorter cable"
    ]
    (said,) = told(tmp_path, 500_000, segment(1200))
    assert said.endswith("; a shorter cable"), "no bit rate has a length for that"


@pytest.mark.landing(4)
@pytest.mark.parametrize(
    ("length_m", "area_mm2", "least_mm2"),
    [(25, 0.2, 0.25), (80, 0.25, 0.34), (230, 0.34, 0.5), (480, 0.5, 0.75)],
)
def test_long_wires_are_thick(tmp_path: Path, length_m: int, area_mm2: float, least_mm2: float) -> None:
    assert told(tmp_path, 50_000, segment(length_m, f"cross_section_mm2 = {least_mm2}")) == []
    assert told(tmp_path, 50_000, segment(length_m, f"cross_section_mm2 = {area_mm2}")) == [
        f"cable[0].cross_section_mm2: {area_mm2} mm² are too thin for {length_m} m: "
        f"{least_mm2} mm² at least (BU 2500 §5.2); thicker wires, or a repeater"
    ]


def test_where_makers_differ_the_smaller_length_counts(tmp_path: Path) -> None:
    """EDS84DMOTCAN §5.2.4: 275 m at 250 kbit/s; NORD 230 m, STÖBER 250 m."""
    assert told(tmp_path, 250_000, segment(275), mappings=(LENZE,)) == []
    (said,) = told(tmp_path, 250_000, segment(240), mappings=(LENZE, NORD))
    assert "230 m at most (BU 2500 §5.2)" in said
    (said,) = told(tmp_path, 250_000, segment(260), mappings=(LENZE, STOEBER))
    assert "250 m at most (ID 441684.06 §4.1)" in said


def test_repeaters_delay_as_cable_does(tmp_path: Path) -> None:
    assert told(tmp_path, 250_000, segment(100), segment(100)) == []
    (said,) = told(tmp_path, 250_000, segment(100), segment(101))
    assert "201 m of cable are too long for 250 kbit/s: 200 m at most" in said
    assert told(tmp_path, 250_000, segment(100), segment(120, "repeater_m = 10")) == []


@pytest.mark.parametrize("number", [0, 1, 3])
def test_each_segment_has_two_terminating_resistors(tmp_path: Path, number: int) -> None:
    assert told(tmp_path, 250_000, segment(10, "terminations = 2")) == []
    (said,) = told(tmp_path, 250_000, segment(10, "terminations = 2"), segment(5, f"terminations = {number}"))
    assert said == (
        f"cable[1].terminations: {number} terminating resistors: two of 120 Ω, one at each end of a segment"
    )


def test_nodes_are_in_a_line(tmp_path: Path) -> None:
    (said,) = told(tmp_path, 250_000, segment(10, "longest_stub_m = 0.5"))
    assert said == (
        "cable[0].longest_stub_m: a stub of 0.5 m: nodes are in a line, without branches (BU 2500 §3.2)"
    )


def test_a_bus_of_other_makers_is_not_judged_in_silence(tmp_path: Path) -> None:
    (said,) = told(tmp_path, 250_000, segment(10), mappings=(CIA402,))
    assert said.startswith("cable: its length is not judged")


def test_a_bus_of_which_nothing_is_said_is_not_judged(tmp_path: Path) -> None:
    assert told(tmp_path, 1_000_000) == []


@pytest.mark.parametrize("manual", MANUALS.values(), ids=list(MANUALS))
def test_the_tables_are_monotonous(manual: Manual) -> None:
    """A slower bus, thicker wires and fewer nodes may be longer."""
    rates = sorted({rate for rate, _ in manual.lengths})
    lengths = [manual.longest_m(rate) for rate in rates]
    assert lengths == sorted(lengths, reverse=True)
    for rate, length in manual.lengths:
        assert manual.longest_m(rate) == length
        assert manual.fastest(length) == rate
    for nodes in (2, 5, 10, 20, 32, 63):
        by_area = [manual.segment_m(area, nodes) or 0.0 for area in sorted(manual.segments)]
        assert by_area == sorted(by_area)
    assert manual.segment_m(0.1, 10) is None
    assert manual.segment_m(1.0, 64) is None


def test_makers_are_called_as_in_their_mapping_files() -> None:
    assert {load_family(mapping).family.vendor for mapping in (NORD, LENZE, STOEBER)} == MANUALS.keys()
