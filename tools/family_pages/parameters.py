"""Parameters of a family, their objects and their EEPROM; objects that are polled."""

from __future__ import annotations

from collections.abc import Iterator

from bridge.mapping import Family
from bridge.mapping.model import Parameter
from tools.family_pages.text import object_text, range_text, states_text, table


def parameters(family: Family) -> Iterator[str]:
    names = family.parameter_names
    if not family.parameter and names is None:
        return
    yield "## Parameters"
    yield ""
    if names is not None:
        written = ", ".join(f"`{one.strip()}`" for one in names.example.split(","))
        yield f"Written as {written}; every object as \
`2066:01` too. \
{_rule(family)}"
        yield ""
    if family.parameter:
        yield from table(
            ("name", "title", "object", "type", "unit", "range", "access", "remarks"),
            (_parameter(family, parameter) for parameter in family.parameter),
        )
    yield from _aliases(family)
    eeprom = family.eeprom
    if eeprom is None:
        return
    said: list[str] = []
    if eeprom.cycles:
        said.append(f"It endures {eeprom.cycles:,} writes.")
    if eeprom.ram_only:
        said.append(
            f"While {eeprom.ram_only.parameter} is {eeprom.ram_only.value:g}, writes go to the RAM alone."
        )
    if eeprom.written_on_save_only:
        said.append("A write stays in the RAM until it is saved.")
    if eeprom.save:
        said.append(f"Saved on request, by `{eeprom.save}`.")
    if eeprom.save_command:
        said.append(f"Saved on request, by {eeprom.save_command.parameter} = {eeprom.save_command.value}.")
    yield "### EEPROM"
    yield ""
    yield " ".join(said)
    yield ""


def _aliases(family: Family) -> Iterator[str]:
    rows: list[tuple[str, str, str]] = []
    for kind, listed in (("the same", family.aliases.same), ("in another form", family.aliases.related)):
        for name, targets in listed.items():
            objects = ", ".join("/".join(str(ref) for ref in refs) for refs in targets)
            rows.append((f"{name} …" if len(targets) > 1 else name, f"`{objects}`", kind))
    if rows:
        yield "### Other names of communication objects"
        yield ""
        yield "Nobody writes these as parameters: the site file sets the objects. `…` goes on with the next \
elements."
        yield ""
        yield from table(("name", "objects", "value"), rows)


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
        (states_text(parameter.states), bool(parameter.states)),
    ]
    return (
        f"`{parameter.name}`",
        parameter.title,
        object_text(family.object_of(parameter)),
        parameter.data_type,
        parameter.unit or "–",
        range_text(parameter.low, parameter.high),
        parameter.access,
        "; ".join(text for text, holds in remarks if holds),
    )


def polls(family: Family) -> Iterator[str]:
    if not family.poll:
        return
    yield "## Polled objects"
    yield ""
    yield "Points of the node."
    yield ""
    yield from table(
        ("point", "object", "type", "every", "meaning"),
        (
            (
                f"`{poll.name}`",
                object_text(poll.object),
                poll.data_type.value,
                f"{poll.every_ms} ms",
                str(poll.description)
                + (
                    "; bits: " + ", ".join(f"{bit} {name}" for bit, name in enumerate(poll.bits) if name)
                    if poll.bits
                    else ""
                ),
            )
            for poll in family.poll
        ),
    )
