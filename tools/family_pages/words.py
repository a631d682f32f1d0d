"""Control and status word of a family."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from bridge.mapping import Family
from bridge.mapping.entry_types import pattern_bits
from bridge.mapping.model import Command
from tools.family_pages.text import table


def words(family: Family) -> Iterator[str]:
    control, status = family.control_word, family.status_word
    yield "## Control word"
    yield ""
    yield from table(("bit", "name"), _bits(control.bits))
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
    yield from table(("command", "word"), rows)
    yield "## Status word"
    yield ""
    yield from table(("bit", "name"), _bits(status.bits))
    yield "### States"
    yield ""
    yield "The first that matches counts; X is any."
    yield ""
    yield from table(
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
    return f"word & ~{command.mask:04X}h" + (f" | {command.value:04X}h" if command.value else "")
