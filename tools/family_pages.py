#!/usr/bin/env python3
"""Write docs/reference/families/: a page for each drive family, made from its mapping file.

``make docs`` runs it; tests/unit/test_family_pages.py fails where a page is not what it would write.
"""

from __future__ import annotations

import sys
import tomllib
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from bridge.mapping import Family, family_names, load_family
from bridge.mapping.fields import ObjectRef, pattern_bits
from bridge.mapping.loader import mappings_dir
from bridge.mapping.model import Command, Parameter, Pdo, ProcessValue, Slot
from bridge.sim.catalogue import SIMULATED

FOLDER = Path(__file__).resolve().parents[1] / "docs" / "reference" / "families"
_MADE = "<!-- Made by tools/family_pages.py from the mapping file: `make docs` writes it anew. -->"


def pages() -> dict[str, str]:
    """Every page by its file name."""
    names = family_names((mappings_dir(),))
    families = {name: load_family(name, (mappings_dir(),)) for name in names}
    made = {f"{_slug(name)}.md": _text(_page(name, family)) for name, family in families.items()}
    return {**made, "index.md": _text(_index(families))}


def _text(lines: Iterable[str]) -> str:
    return "\n".join(lines) + "\n"


def _slug(name: str) -> str:
    return name.replace("/", "-")


def _title(family: Family) -> str:
    facts = family.family
    return facts.name if facts.vendor == "any" else f"{facts.vendor} {facts.name}"


def _table(columns: Sequence[str], rows: Iterable[Sequence[object]]) -> Iterator[str]:
    yield f"| {' | '.join(columns)} |"
    yield f"|{'---|' * len(columns)}"
    for row in rows:
        yield f"| {' | '.join(str(cell).replace('|', chr(92) + '|') for cell in row)} |"
    yield ""


def _index(families: dict[str, Family]) -> Iterator[str]:
    yield "# Drive families"
    yield ""
    yield _MADE
    yield ""
    yield "What the program knows of each is in its mapping file, and these pages are made from those files. \
Simulated: `drivebridge simulate` and the virtual bus can play it. Another one is \
[one file](../../how-to/add-a-drive-family.md)."
    yield ""
    yield from _table(
        ("mapping", "device", "drives of a node", "manual", "simulated"),
        (
            (
                f"[`{name}`]({_slug(name)}.md)",
                _title(family),
                ", ".join(f"`{slot.name}`" for slot in family.slot),
                family.family.source,
                "yes" if name in SIMULATED else "",
            )
            for name, family in families.items()
        ),
    )


def _page(name: str, family: Family) -> Iterator[str]:
    facts = family.family
    chain = _chain(name)
    yield f"# {_title(family)}"
    yield ""
    yield _MADE
    yield ""
    files = ", which extends ".join(f"[`{one}`](../../../mappings/{one}.toml)" for one in chain)
    yield f'`mapping = "{name}"` in the site file. Mapping file: {files}. Source: {facts.source}. \
Addresses: {facts.node_id_low}…{facts.node_id_high}.'
    eds = [one for one in chain if (mappings_dir() / f"{one}.eds").is_file()]
    if eds:
        yield f"Object dictionary: [`{eds[0]}.eds`](../../../mappings/{eds[0]}.eds)."
    if name not in SIMULATED:
        yield "It cannot be simulated."
    yield ""
    notes = [line for one in chain for line in _notes(one)]
    if notes:
        yield "## What is special"
        yield ""
        yield from notes
    yield from _identity(family)
    yield from _process(family)
    yield from _values(family)
    yield from _words(family)
    yield from _parameters(family)
    yield from _polls(family)
    yield from _faults(family)
    yield from _own_supervision(family)


def _chain(name: str) -> list[str]:
    """The mapping and those it extends."""
    found = [name]
    while True:
        data = tomllib.loads((mappings_dir() / f"{found[-1]}.toml").read_text(encoding="utf-8"))
        base = data.get("extends")
        if not isinstance(base, str):
            return found
        found.append(base)


def _notes(name: str) -> Iterator[str]:
    """The comments at the top of a mapping file, as paragraphs."""
    for line in (mappings_dir() / f"{name}.toml").read_text(encoding="utf-8").splitlines():
        if line and not line.startswith("#"):
            break
        if not line.startswith("#:"):
            yield line.removeprefix("#").removeprefix(" ")
    yield ""


def _identity(family: Family) -> Iterator[str]:
    shown = {key: value for key, value in family.identity.model_dump().items() if value is not None}
    yield "## Identity"
    yield ""
    if not shown:
        yield "Nothing that a node answers tells the family."
        yield ""
        return
    yield from _table(
        ("key", "value"),
        (
            (f"`{key}`", f"`{value}`" if isinstance(value, str) else f"`{value:X}h`")
            for key, value in shown.items()
        ),
    )


# process data


def _process(family: Family) -> Iterator[str]:
    yield "## Process data"
    yield ""
    many = len(family.slot) > 1
    rows = [
        (f"`{slot.name}`", *row)
        for slot in family.slot
        for row in (*_pdos(family, slot, receives=True), *_pdos(family, slot, receives=False))
    ]
    columns = ("drive", "PDO", "COB-ID", "words and their objects", "remarks")
    yield from _table(columns if many else columns[1:], (row if many else row[1:] for row in rows))
    if family.process.exact_length:
        yield "A PDO of any other length is not evaluated."
        yield ""
    if family.sdo:
        yield from _table(
            ("SDO channel", "request", "reply", "drive"),
            (
                (
                    server.number,
                    f"{server.request:X}h + id",
                    f"{server.reply:X}h + id",
                    f"`{server.slot}`" if server.slot else "–",
                )
                for server in family.sdo
            ),
        )
    starts = [(slot, write) for slot in family.slot for write in slot.start]
    if starts:
        yield (
            "Written at boot-up: "
            + ", ".join(f"`{write.object}` = {write.value} ({write.type})" for _, write in starts)
            + "."
        )
        yield ""


def _pdos(family: Family, slot: Slot, *, receives: bool) -> Iterator[tuple[str, str, str, str]]:
    for pdo in slot.rpdo if receives else slot.tpdo:
        names = family.rpdo_words(pdo) if receives else family.tpdo_words(pdo)
        words = "; ".join(
            f"`{word}`" if pdo.static else f"`{word}` {' or '.join(str(ref) for ref in refs)}"
            for word, refs in zip(names, pdo.objects, strict=True)
        )
        yield f"{'RPDO' if receives else 'TPDO'}{pdo.number}", f"{pdo.cob_id:X}h + id", words, _remarks(pdo)


def _remarks(pdo: Pdo) -> str:
    said = [
        ("optional", pdo.optional),
        ("fixed in the device", pdo.static),
        ("written at boot-up", pdo.write),
        (f"type {pdo.transmission_type}", pdo.transmission_type is not None),
        (f"inhibit {pdo.inhibit_ms or 0:g} ms", pdo.inhibit_ms is not None),
        (f"event {pdo.event_ms} ms", pdo.event_ms is not None),
    ]
    return ", ".join(text for text, holds in said if holds)


def _values(family: Family) -> Iterator[str]:
    if not family.value:
        return
    yield "## Values"
    yield ""
    yield from _table(
        ("point", "made of", "unit", "range", "meaning"),
        (
            (
                f"`{value.leaf}`",
                _made_of(value),
                value.unit or "–",
                _range(value.low, value.high),
                _meaning(value),
            )
            for value in family.value
        ),
    )


def _made_of(value: ProcessValue) -> str:
    words = " and ".join(f"`{word}`" for word in value.word_names)
    scale = value.scale
    if value.bit is not None:
        return f"{words}, bit {value.bit}"
    if scale is None:
        return words
    if scale.full is not None:
        return f"{words} × {scale.full} / {scale.at}"
    factor = "" if scale.factor == 1 else f" × {scale.factor:g}"
    offset = "" if not scale.offset else f" {'+' if scale.offset > 0 else '−'} {abs(scale.offset):g}"
    return f"{words}{factor}{offset}"


def _meaning(value: ProcessValue) -> str:
    parts = [value.description] if value.description else []
    if value.states:
        parts.append(_states(value.states))
    if value.bits:
        parts.append("bits: " + ", ".join(f"{bit} {name}" for bit, name in enumerate(value.bits) if name))
    if value.follows:
        parts.append(f"follows `actual/{value.follows}` until the drive is enabled")
    return "; ".join(parts)


def _states(states: dict[int, str]) -> str:
    return ", ".join(f"{number} {text}" for number, text in sorted(states.items()))


def _range(low: float | None, high: float | None) -> str:
    if low is None and high is None:
        return "–"
    return f"{'' if low is None else f'{low:g}'}…{'' if high is None else f'{high:g}'}"


# words


def _words(family: Family) -> Iterator[str]:
    control, status = family.control_word, family.status_word
    yield "## Control word"
    yield ""
    yield from _table(("bit", "name"), _bits(control.bits))
    rows = [
        ("stopped", f"{control.stopped:04X}h"),
        ("ready", f"{control.ready:04X}h"),
        ("run", f"{control.run:04X}h"),
    ]
    rows += [
        (name, f"run with {bits:04X}h")
        for name, bits in (
            ("forward", control.forward),
            ("reverse", control.reverse),
            ("begin", control.begin),
        )
        if bits
    ]
    rows.append(("enabling", f"word & {control.enabling.mask:04X}h = {control.enabling.value:04X}h"))
    rows += [
        (name, _command(command))
        for name, command in (
            ("stop", control.stop),
            ("quick stop", control.quick_stop),
            ("disable voltage", control.disable_voltage),
        )
    ]
    rows.append(("acknowledge", f"rising edge of bit {control.acknowledge_bit}"))
    if control.valid_bit is not None:
        rows.append(("valid", f"bit {control.valid_bit} must be 1"))
    if control.handshake is not None:
        shake = control.handshake
        rows.append(
            (
                f"new `{shake.value}`",
                f"rising edge of bit {shake.bit}, taken with bit {shake.acknowledge_bit} of the status word",
            )
        )
    yield from _table(("command", "word"), rows)
    yield "## Status word"
    yield ""
    yield from _table(("bit", "name"), _bits(status.bits))
    yield "### States"
    yield ""
    yield "The first that matches counts; X is any."
    yield ""
    yield from _table(
        ("state", "bits, the highest first", "word & mask = value"),
        (
            (
                f"`{state.name}`",
                f"`{state.pattern}`",
                "{:04X}h = {:04X}h".format(*pattern_bits(state.pattern)),
            )
            for state in status.state
        ),
    )


def _bits(bits: Sequence[str]) -> Iterator[tuple[int, str]]:
    return ((bit, f"`{name}`" if name else "–") for bit, name in enumerate(bits))


def _command(command: Command) -> str:
    return f"word & ~{command.mask:04X}h \\| {command.value:04X}h".replace("\\|", "|")


# parameters


def _parameters(family: Family) -> Iterator[str]:
    names = family.parameter_names
    if not family.parameter and names is None:
        return
    yield "## Parameters"
    yield ""
    if names is not None:
        yield f"Written as {', '.join(f'`{one.strip()}`' for one in names.example.split(','))}; every object as \
`2066:01` too. {_rule(family)}"
        yield ""
    if family.parameter:
        yield from _table(
            ("name", "title", "object", "type", "unit", "range", "access", "remarks"),
            (_parameter(family, parameter) for parameter in family.parameter),
        )
    eeprom = family.eeprom
    if eeprom is None:
        return
    said: list[str] = []
    if eeprom.cycles:
        said.append(f"It stands {eeprom.cycles:,} writes.")
    if eeprom.ram_only:
        said.append(
            f"While {eeprom.ram_only.parameter} is {eeprom.ram_only.value:g}, writes go to the RAM alone."
        )
    if eeprom.written_on_save_only:
        said.append("A write stays in the RAM until it is saved.")
    if eeprom.save:
        said.append(f"Saved on request, by `{eeprom.save}`.")
    yield "### EEPROM"
    yield ""
    yield " ".join(said)
    yield ""


def _rule(family: Family) -> str:
    names = family.parameter_names
    if names is None:
        return ""
    index = f"{names.index:X}h"
    if names.letter_step:
        index += f" + {names.letter_step:X}h × (letter − A)"
    sign = "−" if names.number_step < 0 else "+"
    step = abs(names.number_step)
    index += f" {sign} {'' if step == 1 else f'{step:X}h × '}number"
    sub = f"{names.sub}"
    if "element" in names.pattern:
        first = f"(element − {names.element_first})" if names.element_first else "element"
        sub += f" + {'' if names.element_step == 1 else f'{names.element_step} × '}{first}"
    if names.set_step:
        sub += f" + {'' if names.set_step == 1 else f'{names.set_step} × '}parameter set"
    if sub.startswith("0 + "):
        sub = sub[4:]
    if index.startswith("0h + "):
        index = index[5:]
    return f"Index = {index}, sub-index = {sub}."


def _parameter(family: Family, parameter: Parameter) -> tuple[object, ...]:
    remarks = [
        ("point" + (f", every {parameter.every_ms} ms" if parameter.every_ms else ""), parameter.point),
        (f"{parameter.sets} sets", bool(parameter.sets)),
        (f"{parameter.elements} elements", bool(parameter.elements)),
        (f"× {parameter.factor:g}", parameter.factor != 1),
        ("from the site file only", not parameter.read),
        ("not kept", parameter.volatile),
        (_states(parameter.states), bool(parameter.states)),
    ]
    return (
        f"`{parameter.name}`",
        parameter.title,
        _object(family.object_of(parameter)),
        parameter.data_type,
        parameter.unit or "–",
        _range(parameter.low, parameter.high),
        parameter.access,
        "; ".join(text for text, holds in remarks if holds),
    )


def _object(ref: ObjectRef) -> str:
    return f"`{ref}`"


def _polls(family: Family) -> Iterator[str]:
    if not family.poll:
        return
    yield "## Polled objects"
    yield ""
    yield "Points of the node."
    yield ""
    yield from _table(
        ("point", "object", "type", "every", "meaning"),
        (
            (
                f"`{poll.name}`",
                _object(poll.object),
                poll.data_type.value,
                f"{poll.every_ms} ms",
                poll.description
                + (
                    "; bits: " + ", ".join(f"{bit} {name}" for bit, name in enumerate(poll.bits) if name)
                    if poll.bits
                    else ""
                ),
            )
            for poll in family.poll
        ),
    )


# faults


def _faults(family: Family) -> Iterator[str]:
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
            f"With the codes {codes}, {emcy.number.size} bytes from byte {emcy.number.byte} on are an error number."
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
    yield from _table(
        ("finding", "number"),
        (
            ("the controller is silent", f"{faults.prefix}{faults.controller_silent}"),
            ("no process data from the drive", f"{faults.prefix}{faults.telegram_downtime}"),
            ("the node is missing", f"{faults.prefix}{faults.node_missing}"),
            ("the bus interface's own time-out", f"{faults.prefix}{faults.bridge_timeout}"),
        ),
    )
    yield from _table(
        ("fault", "text"), ((f"{faults.prefix}{number}", text) for number, text in faults.texts.items())
    )
    if emcy.events:
        yield "### Event and error numbers"
        yield ""
        yield from _table(("number", "text"), sorted(emcy.events.items(), key=lambda item: int(item[0])))
    yield "### Emergency codes"
    yield ""
    yield from _table(
        ("code", "text"),
        ((f"{code}h" if "x" not in code else code, text) for code, text in emcy.codes.items()),
    )


def _own_supervision(family: Family) -> Iterator[str]:
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


def main() -> int:
    FOLDER.mkdir(exist_ok=True)
    made = pages()
    for path in FOLDER.glob("*.md"):
        if path.name not in made:
            path.unlink()
    for name, text in made.items():
        (FOLDER / name).write_text(text, encoding="utf-8")
    print(f"{FOLDER}: {len(made)} pages")
    return 0


if __name__ == "__main__":
    sys.exit(main())
