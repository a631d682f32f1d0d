"""Faults of a family, and how it supervises the bridge."""

from __future__ import annotations

from collections.abc import Iterator

from bridge.drive import FaultWords
from bridge.mapping import Family
from bridge.mapping.model import OwnSupervision
from bridge.mapping.own_places import OwnPlace, place_of
from tools.family_pages.text import table


def faults(family: Family) -> Iterator[str]:
    emcy, faults = family.emcy, family.faults
    yield "## Faults"
    yield ""
    said: list[str] = []
    if emcy.drive_byte is not None:
        said.append(f"Byte {emcy.drive_byte} of the emergency message says which drive it is about.")
    if emcy.event is not None:
        cause = "" if emcy.event.cause_byte is None else f", byte {emcy.event.cause_byte} its cause"
        said.append(f"Byte {emcy.event.byte} is the event, which decides{cause}; the code comes second.")
    if emcy.number is not None:
        codes = " and ".join(f"{code}h" for code in emcy.number.codes)
        said.append(
            f"With the codes {codes}, {emcy.number.size} bytes from byte {emcy.number.byte} on are an \
error number."
        )
    if faults.current is not None:
        said.append(f"The present fault is read from {faults.current.parameter}.")
    if faults.last is not None:
        said.append(f"The last fault is read from {faults.last.parameter}.")
    if said:
        yield " ".join(said)
        yield ""
    yield "What the bridge itself finds:"
    yield ""
    yield from table(
        ("finding", "number"),
        (
            ("the controller is silent", f"{faults.prefix}{faults.controller_silent}"),
            ("no process data from the drive", f"{faults.prefix}{faults.telegram_downtime}"),
            ("the node is missing", f"{faults.prefix}{faults.node_missing}"),
            ("the bus interface's own time-out", f"{faults.prefix}{faults.bridge_timeout}"),
        ),
    )
    words = FaultWords(family)
    yield from table(
        ("fault", "text"), ((words.listed(name).number, text) for name, text in faults.texts.items())
    )
    if family.fault:
        yield "### Causes and remedies"
        yield ""
        yield "In German: `drivebridge faults FAMILY --language de`."
        yield ""
        explained = [(one, words.listed(one.name)) for one in family.fault]
        yield from table(
            ("fault", "cause", "remedy", "source"),
            ((told.number, told.cause, told.remedy, one.source or "–") for one, told in explained),
        )
    if emcy.events:
        yield "### Event and error numbers"
        yield ""
        events = sorted(emcy.events.items(), key=lambda item: int(item[0]))
        yield from table(("number", "text"), ((words.listed(number).number, text) for number, text in events))
    yield "### Emergency codes"
    yield ""
    yield from table(
        ("code", "text"),
        ((f"{code}h" if "x" not in code else code, text) for code, text in emcy.codes.items()),
    )


def own_supervision(family: Family) -> Iterator[str]:
    yield "## A node that cannot be booted"
    yield ""
    yield f"Its drives get stopped words, and it gets {_STOPPED_BY[family.family.stopped_by]}"
    yield ""
    if not family.own_supervision:
        return
    yield "## Own supervision"
    yield ""
    yield "What the drive watches by itself, and what follows when the bridge falls silent. \
`drivebridge audit` reads it."
    yield ""
    rows = [
        (entry.name, _WATCHES[entry.watches], *_setting(family, entry)) for entry in family.own_supervision
    ]
    yield from table(("name", "watches", "time", "off", "reaction", "runs on with"), rows)


_STOPPED_BY = {
    "stop_node": "NMT stop.",
    "reset_node": "NMT reset node where its drives may be running, since in Stopped they may run on; then \
NMT stop.",
}

_WATCHES = {
    "process_data": "process data",
    "heartbeat": "the bridge's heartbeat",
    "guarding": "node guarding",
    "link": "its bus interface",
}


def _setting(family: Family, entry: OwnSupervision) -> tuple[str, str, str, str]:
    time = place_of(family, entry)
    factor = " × `100D:00`" if entry.watches == "guarding" else ""
    steps = f", in steps of {entry.unit_ms:g} ms" if entry.watches == "process_data" else ""
    off = ", ".join(map(str, entry.off))
    if entry.reaction is None:
        return f"{_named(time)}{factor}{steps}", off, "–" if entry.watches == "link" else "it stops", "–"
    reaction = place_of(family, entry.reaction)
    shown = [(one, reaction.states.get(one)) for one in entry.reaction.nothing]
    nothing = ", ".join(f"{one} ({text})" if text else str(one) for one, text in shown)
    return f"{_named(time)}{factor}{steps}", off, _named(reaction), nothing


def _named(place: OwnPlace) -> str:
    return f"`{place.ref}`" if place.name == str(place.ref) else f"{place.name} (`{place.ref}`)"
