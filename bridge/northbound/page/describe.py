"""What the page has to know of a site once: its buses, nodes and drives, and the nature of its points."""

from __future__ import annotations

from typing import Any, Final

from bridge.config import Site
from bridge.image import Image, Point
from bridge.mapping import Family
from bridge.northbound.page.troubles import Layout

_MOVES_BY: Final = ("velocity", "frequency", "speed", "position", "torque")
"""What a drive is moved by, the most telling first."""


def described(image: Image, site: Site, families: dict[str, Family]) -> dict[str, Any]:
    """For JSON. What is empty is left out of a point."""
    points = {point.name: _point(point) for point in image.points}
    nodes: list[dict[str, Any]] = []
    drives: list[dict[str, Any]] = []
    for bus in site.bus:
        for node in bus.node:
            family = families[node.mapping]
            of_node = {"name": node.name, "bus": bus.name, "id": node.id, "family": family.family.name}
            nodes.append(of_node)
            for drive in node.drive:
                name = f"{node.name}/{family.leaf_of(drive)}"
                drives.append(
                    {
                        "name": name,
                        "node": node.name,
                        "bus": bus.name,
                        "family": family.family.name,
                        "mapping": node.mapping,
                        "control": drive.control,
                        "stop_by_anyone": drive.stop_by_anyone,
                        "on_expiry": drive.on_expiry,
                        "states": list(dict.fromkeys(state.name for state in family.status_word.state)),
                        "stops_in": _stops_in(family),
                        "main": _main(name, points),
                    }
                )
    return {
        "site": site.site.name,
        "buses": [{"name": bus.name, "bitrate": bus.bitrate, "interface": bus.interface} for bus in site.bus],
        "nodes": nodes,
        "drives": drives,
        "points": points,
    }


def layout_of(image: Image, site: Site, families: dict[str, Family]) -> Layout:
    """Which drives are where, and what moves them."""
    points = {point.name: _point(point) for point in image.points}
    nodes = [(bus.name, node) for bus in site.bus for node in bus.node]
    drives = {
        f"{node.name}/{families[node.mapping].leaf_of(drive)}": node.name
        for _, node in nodes
        for drive in node.drive
    }
    return Layout(
        drives=drives,
        nodes={node.name: bus for bus, node in nodes},
        buses=tuple(bus.name for bus in site.bus),
        mains={drive: main for drive in drives if (main := _main(drive, points))},
    )


def _point(point: Point) -> dict[str, Any]:
    facts = {
        "type": str(point.data_type),
        "unit": point.unit,
        "low": point.low,
        "high": point.high,
        "writable": point.writable,
        "description": point.description,
        "states": {str(code): text for code, text in point.states},
        "bits": list(point.bits),
    }
    return {name: fact for name, fact in facts.items() if fact not in ("", None, False, {}, [])}


def _stops_in(family: Family) -> str:
    """The state in which a drive ends that is stopped: that of the word which is made ready, where the stop
    takes back as much."""
    control = family.control_word
    word = control.run & ~control.stop.mask | control.stop.value
    return "ready" if word & 0xF == control.ready & 0xF else "switched_on"


def _main(drive: str, points: dict[str, Any]) -> str:
    """The leaf of setpoint and actual value that tell most of the drive; empty where it has no such pair."""
    pairs = [
        name.rpartition("/")[2]
        for name in points
        if name.startswith(f"{drive}/command/")
        and points[name].get("unit")
        and name.replace("/command/", "/actual/", 1) in points
    ]
    return next((leaf for leaf in _MOVES_BY if leaf in pairs), pairs[0] if pairs else "")
