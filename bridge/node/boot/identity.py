"""Identity of the node: 1000h, 1008h, 100Ah and 1018h, compared with mapping and site file (CiA 302-2)."""

from __future__ import annotations

import re
from collections.abc import Generator
from dataclasses import dataclass

from bridge.canopen import datatypes
from bridge.canopen.dialogue import SdoRead, optional
from bridge.canopen.sdo import SdoError
from bridge.command import Identification
from bridge.command.node import Node
from bridge.node.boot.actions import Action, BootResult, BootSignal, BootStep, Do, number, wish
from bridge.node.boot.error_status import BootError
from bridge.text import Text

_ALL = 0xFFFF_FFFF
_LONGEST_TEXT = 64


@dataclass(frozen=True, slots=True)
class IdentityCheck:
    """Rule that ``read & mask`` must equal ``expected & mask``; without a value nothing is compared. ``key``
    is its place in the file."""

    key: str
    letter: str
    index: int
    sub: int
    expected: int | None
    mask: int | None = None

    def check(self, read: int | None, where: Text) -> None:
        """Raise BootError where the value differs; ``read`` is None where the node has none."""
        mask = _ALL if self.mask is None else self.mask
        if self.expected is None or not ((read or 0) ^ self.expected) & mask:
            return
        name = f"{self.index:04X}h:{self.sub:02X}"
        found = Text.of("boot.has_no", object=name)
        if read is not None:
            found = Text.of("boot.number_read", object=name, read=read)
        what = Text.of("boot.not_expected", found=found, wanted=self.expected, where=where)
        if mask != _ALL:
            what = Text.of("boot.not_as_masked", found=found, wanted=self.expected, mask=mask, where=where)
        raise BootError(self.letter, what)


def _rules(expected: object, where: Text, table: str) -> list[tuple[IdentityCheck, Text]]:
    """Rules of an identity table; the mapping's has fewer keys than the site file's."""
    rules: list[tuple[IdentityCheck, Text]] = []
    for letter, index, sub, name in (
        ("C", 0x1000, 0, "device_type"),
        ("D", 0x1018, 1, "vendor_id"),
        ("M", 0x1018, 2, "product_code"),
        ("N", 0x1018, 3, "revision"),
        ("O", 0x1018, 4, "serial"),
    ):
        value = getattr(expected, name, None)
        mask = getattr(expected, f"{name}_mask", None)
        rules.append((IdentityCheck(f"{table}.{name}", letter, index, sub, value, mask), where))
    return rules


def identify(node: Node, device_type: int | None, result: BootResult) -> Do:
    """Read the node's identity and compare it. Raises BootError C, D, M, N or O. Values that no rule asks for
    may be missing.

    The mapping's device name is a hint for ``scan``; the site file's is a rule.
    """
    rules = _rules(node.table.identity, Text.of("boot.by_site"), "identity")
    # What the site file says of a field stands in place of what the mapping says.
    given = {rule.letter for rule, _ in rules if rule.expected is not None}
    rules += [
        (rule, where)
        for rule, where in _rules(node.family.identity, Text.of("boot.by_mapping"), "mapping.identity")
        if rule.letter not in given
    ]
    read: dict[tuple[int, int], int | None] = {(0x1000, 0): device_type}
    for sub, letter in ((1, "D"), (2, "M"), (3, "N"), (4, "O")):
        key = next((rule.key for rule, _ in rules if rule.letter == letter and rule.expected is not None), "")
        yield BootStep(Text.of("boot_step.identity"), letter, needed_by=key)
        data = yield from (optional(0x1018, sub) if key else wish(result, 0x1018, sub))
        read[0x1018, sub] = None if data is None else number(data)
    for rule, where in rules:
        rule.check(read[rule.index, rule.sub], where)
    wanted = node.table.identity
    name = yield from _text("M", 0x1008, wanted.device_name, "identity.device_name", result)
    version = yield from _text("N", 0x100A, wanted.software_version, "identity.software_version", result)
    result.software_version = version
    vendor, product, revision, serial = (read[0x1018, sub] or 0 for sub in (1, 2, 3, 4))
    result.identification = Identification(vendor, product, revision, serial, name)


def look_for() -> Generator[Action, bytes | None, int | None]:
    """Device type of the node; None where it is there and does not tell. Raises SdoError where nobody
    answers, nor after the node was woken."""
    yield BootStep(Text.of("boot_step.look"), "B")
    try:
        return (yield from _device_type())
    except SdoError:
        yield BootSignal.WAKE
    return (yield from _device_type())


def _device_type() -> Generator[SdoRead, bytes | None, int | None]:
    """Device type; None where the node does not tell. Raises SdoError where there is no answer at all."""
    try:
        return number((yield SdoRead(0x1000)))
    except SdoError as error:
        if not error.was_answered:
            raise
        return None


def _text(
    letter: str, index: int, wanted: str | None, key: str, result: BootResult
) -> Generator[Action, bytes | None, str]:
    """A text of the node, in which the regular expression ``wanted``, if given, has to be found. Raises
    BootError."""
    yield BootStep(Text.of("boot_step.name"), letter, needed_by="" if wanted is None else key)
    data = yield from (wish(result, index) if wanted is None else optional(index))
    text = datatypes.readable((data or b"")[:_LONGEST_TEXT]).strip()
    if wanted is not None and not re.search(wanted, text, re.IGNORECASE):
        name = f"{index:04X}h"
        found = Text.of("boot.text_read", object=name, read=text)
        if data is None:
            found = Text.of("boot.has_no", object=name)
        raise BootError(letter, Text.of("boot.text_not_expected", found=found, wanted=wanted))
    return text
