"""Description of a site that the page gets once: its buses, nodes and drives, and the nature of its
points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import msgspec

from bridge.catalogue import Catalogue, DriveSpec
from bridge.condition.plant_layout import PlantLayout, layout_of
from bridge.drive.scaling import scale_of
from bridge.image import Image, Point
from bridge.mapping import Family
from bridge.text import Text, as_json

_encode = msgspec.json.Encoder().encode


def described(image: Image, catalogue: Catalogue) -> dict[str, Any]:
    """Description of the site, for JSON. ``places`` has for each drive, bus, node and the bridge which of
    ``natures`` has its points, by their names there. Drives of a kind have one in common, so that a plant of
    hundreds is loaded as soon as a small one. What is empty is left out of a point."""
    layout = layout_of(image.points, catalogue)
    places, natures = _natures(image.points, layout, _scaled(image, catalogue))
    site = catalogue.site
    nodes = [
        {"name": node.name, "bus": node.bus.name, "id": node.table.id, "family": node.family.family.name}
        for node in catalogue.nodes.values()
    ]
    drives = [_drive(one, layout.mains.get(one.name, "")) for one in catalogue.drives.values()]
    return {
        "site": site.site.name,
        "buses": [{"name": bus.name, "bitrate": bus.bitrate, "interface": bus.interface} for bus in site.bus],
        "nodes": nodes,
        "drives": drives,
        "places": places,
        "natures": natures,
    }


def _drive(drive: DriveSpec, main: str) -> dict[str, Any]:
    """``main`` is what moves it most tellingly."""
    status = drive.family.status_word
    return {
        "name": drive.name,
        "node": drive.node.name,
        "bus": drive.bus.name,
        "family": drive.family.family.name,
        "mapping": drive.node.mapping,
        "control": drive.control,
        "stop_by_anyone": drive.stop_by_anyone,
        "on_expiry": drive.table.on_expiry,
        "reaction": as_json(Text.word("reaction", drive.table.on_expiry)),
        "states": list(dict.fromkeys(state.name for state in status.state)),
        "stops_in": _stops_in(drive.family),
        "main": main,
        "set_bits": list(status.parameter_set_bits),
    }


def _natures(
    points: Sequence[Point], layout: PlantLayout, scaled: Mapping[str, dict[str, Any]]
) -> tuple[dict[str, int], list[dict[str, dict[str, Any]]]]:
    by_place: dict[str, dict[str, dict[str, Any]]] = {}
    for point in points:
        longer = "/".join(point.path[:2])
        place = longer if point.path[0] == "bus" or longer in layout.drives else point.path[0]
        by_place.setdefault(place, {})[point.name[len(place) + 1 :]] = _point(point) | scaled.get(
            point.name, {}
        )
    kinds: dict[bytes, int] = {}
    natures: list[dict[str, dict[str, Any]]] = []
    places: dict[str, int] = {}
    for place, of_place in by_place.items():
        kind = places[place] = kinds.setdefault(_encode(of_place), len(natures))
        if kind == len(natures):
            natures.append(of_place)
    return places, natures


def _scaled(image: Image, catalogue: Catalogue) -> dict[str, dict[str, Any]]:
    """Scales of the values that may be written, by the value's point: ``scaled_by`` has the point of the
    parameter in each parameter set, below the drive, empty where there is none, and ``of_full`` the limits
    as multiples of the parameter's value.

    So the page shows the limits of the drive's own P105 or C01, and not those of the site file.
    """
    there = {point.name for point in image.points}
    found: dict[str, dict[str, Any]] = {}
    for node in catalogue.nodes.values():
        family = node.family
        points = {
            family.parameter_and_set(entry.name): f"parameter/{entry.leaf}"
            for entry in node.axis_names.of().points()
        }
        for drive in node.drives:
            for value in family.values_of(drive.slot):
                one = scale_of(value, 1.0)
                if value.group != "command" or one is None or not value.full:
                    continue
                sets = [points.get((value.full, number), "") for number in range(1, family.sets + 1)]
                if f"{drive.name}/{sets[0]}" in there:
                    found[f"{drive.name}/{value.leaf}"] = {"scaled_by": sets, "of_full": [one.low, one.high]}
    return found


def _point(point: Point) -> dict[str, Any]:
    facts = {
        "type": str(point.data_type),
        "unit": point.unit,
        "low": point.low,
        "high": point.high,
        "writable": point.writable,
        "description": str(point.description),
        "states": {str(code): str(text) for code, text in point.states},
        "bits": list(point.bits),
    }
    return {name: fact for name, fact in facts.items() if fact not in ("", None, False, {}, [])}


def _stops_in(family: Family) -> str:
    """State in which a stopped drive ends: that of the ready word, where the stop takes the drive back that
    far."""
    control = family.control_word
    word = control.run & ~control.stop.mask | control.stop.value
    return "ready" if word & 0xF == control.ready & 0xF else "switched_on"
