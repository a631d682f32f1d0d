"""Faults of a family, and how it supervises the bridge."""

from __future__ import annotations

from collections.abc import Iterator

from bridge.mapping import Family
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
    yield from table(
        ("fault", "text"), ((f"{faults.prefix}{number}", text) for number, text in faults.texts.items())
    )
    if emcy.events:
        yield "### Event and error numbers"
        yield ""
        yield from table(("number", "text"), sorted(emcy.events.items(), key=lambda item: int(item[0])))
    yield "### Emergency codes"
    yield ""
    yield from table(
        ("code", "text"),
        ((f"{code}h" if "x" not in code else code, text) for code, text in emcy.codes.items()),
    )


def own_supervision(family: Family) -> Iterator[str]:
    own = family.own_timeout
    if own is None:
        return
    yield "## Own supervision"
    yield ""
    does = (
        f"`{own.reaction.object}` is what it does then; {own.reaction.none}: nothing."
        if own.reaction
        else "It stops its drives then."
    )
    yield f"`{own.object}` is the time within which the device expects process data, in steps of \
{own.unit_ms:g} ms; 0 is off. {does}"
    yield ""
