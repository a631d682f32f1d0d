"""Process data of a family: PDOs, channels, values."""

from __future__ import annotations

from collections.abc import Iterator

from bridge.mapping import Family
from bridge.mapping.model import Pdo, ProcessValue, Slot
from tools.family_pages.text import range_text, states_text, table


def process(family: Family) -> Iterator[str]:
    yield "## Process data"
    yield ""
    many = len(family.slot) > 1
    rows = [
        (f"`{slot.name}`", *row)
        for slot in family.slot
        for row in (*_pdos(family, slot, receives=True), *_pdos(family, slot, receives=False))
    ]
    columns = ("drive", "PDO", "COB-ID", "words and their objects", "remarks")
    yield from table(columns if many else columns[1:], (row if many else row[1:] for row in rows))
    if family.process.exact_length:
        yield "A PDO of any other length is not evaluated."
        yield ""
    if family.sdo:
        yield from table(
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


def values(family: Family) -> Iterator[str]:
    there = {value.leaf for slot in family.slot for value in family.values_of(slot)}
    if not there:
        return
    yield "## Values"
    yield ""
    yield from table(
        ("point", "made of", "unit", "range", "meaning"),
        (
            (
                f"`{value.leaf}`",
                _made_of(family, value),
                value.unit or "–",
                range_text(value.low, value.high),
                _meaning(family, value),
            )
            for value in family.value
            if value.leaf in there
        ),
    )


def _made_of(family: Family, value: ProcessValue) -> str:
    words = " and ".join(f"`{word}`" for word in value.word_names)
    if value.code and not value.word_names:
        asked = [meaning.parameter for meaning in family.meaning if meaning.group == value.group]
        codes = " and ".join(str(code) for code in value.code)
        words = f"the word{'s' * (value.width - 1)} with {codes} in {', '.join(asked)}"
    scale = value.scale
    if value.bit is not None:
        return f"{words}, bit {value.bit}"
    if scale is None:
        return words
    if scale.full is not None:
        under = " / ".join(
            [*([f"{scale.at}"] if scale.at != 1 else []), *([scale.over] if scale.over else [])]
        )
        return f"{words} × {scale.full}{f' / {under}' if under else ''}"
    factor = "" if scale.factor == 1 else f" × {scale.factor:g}"
    offset = "" if not scale.offset else f" {'+' if scale.offset > 0 else '−'} {abs(scale.offset):g}"
    return f"{words}{factor}{offset}"


def _meaning(family: Family, value: ProcessValue) -> str:
    parts = [str(value.description)] if value.description else []
    told = {meaning.word: meaning.parameter for meaning in family.meaning if meaning.group == value.group}
    if value.word_names and value.code:
        pairs = zip(value.word_names, value.code, strict=True)
        parts.append("while " + " and ".join(f"{told[word]} is {code}" for word, code in pairs))
    alike: dict[str, list[str]] = {}
    for name, settings in value.when.items():
        alike.setdefault(" or ".join(f"{one:g}" for one in settings), []).append(name)
    for told, names in alike.items():
        parts.append(f"while {', '.join(names)} {'is' if len(names) == 1 else 'are'} {told}")
    if value.needs:
        parts.append(f"while there is `{value.needs}`")
    if family.steady_of(value):
        parts.append(f"until {' or '.join(family.steady_of(value))} is changed")
    if value.states:
        parts.append(states_text(value.states))
    if value.bits:
        parts.append("bits: " + ", ".join(f"{bit} {name}" for bit, name in enumerate(value.bits) if name))
    if value.follows:
        parts.append(f"follows `actual/{value.follows}` until the drive is enabled")
    return "; ".join(parts)
