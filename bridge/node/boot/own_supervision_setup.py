"""Own supervision of each drive, its reaction to a silent bridge: set where the site file enforces it, then
read."""

from __future__ import annotations

from collections.abc import Callable, Generator
from functools import partial

from bridge.base.sdo_texts import text_of
from bridge.canopen.dialogue import SdoRead, optional
from bridge.canopen.sdo import SdoError
from bridge.catalogue import MemberSpec, NodeSpec
from bridge.command.node import Node
from bridge.drive import OwnJudgement, OwnVerdict
from bridge.drive.own_judgement import judge
from bridge.mapping.model import Family
from bridge.mapping.own_places import OwnPlace, OwnWant, places, wanted
from bridge.node.boot.actions import Action, BootResult, BootStep, Do, told_as, wish, write_number
from bridge.node.boot.error_status import BootError
from bridge.node.places.sdo_channels import FIRST
from bridge.parameter import ParameterError
from bridge.text import Said, Text

Raws = dict[tuple[int, int], int]


def set_own_supervision(node: Node, result: BootResult) -> Do:
    """Read every drive's own supervision into ``result.own``; ``own_timeout_ms`` is written first where
    ``enforce`` is true and the node holds something else.

    Raises BootError J where an enforced value is not taken.
    """
    if not node.drives:
        return
    if not node.family.own_supervision:
        for drive in node.drives:
            result.own[drive.name] = OwnJudgement(accepted=drive.table.accepts.runs_on or "")
        return
    needed_by = "enforce" if node.table.enforce else ""
    yield BootStep(Text.of("boot_step.own_supervision"), "J", needed_by=needed_by)
    of_node = yield from bring_node(node, result)
    for drive in node.drives:
        of_drive = yield from read_places(node, drive.spec, read=_reader(node, result))
        channel = drive.spec.sdo_channel
        for want in wanted(drive.family, node.bus, node.table):
            if want.place.per_drive and want.place.key in of_drive and channel is not None:
                yield from _bring(node, want, of_drive, channel, drive.name, result)
        raw = {**of_node, **of_drive}
        own = judge(drive.family, raw, node.bus, node.table, drive.table.accepts.runs_on or "")
        result.own[drive.name] = own
    _note_who_runs_on(node, result)


def bring_node(node: Node, result: BootResult) -> Generator[Action, bytes | None, Raws]:
    """Values of the node's own objects, brought to what is wanted. Raises BootError J."""
    of_node = yield from read_places(node, None, read=_reader(node, result))
    for want in wanted(node.family, node.bus, node.table):
        if not want.place.per_drive:
            yield from _bring(node, want, of_node, FIRST, node.name, result)
    return of_node


Reader = Callable[[int, int, int], Generator[SdoRead, bytes | None, bytes | None]]
"""Reads an object: index, sub-index, SDO channel."""


def _reader(node: Node, result: BootResult) -> Reader:
    """Reader of the objects. A value that is only judged, not enforced, is optional."""
    return optional if node.table.enforce else partial(wish, result)


def read_places(
    node: Node | NodeSpec,
    member: MemberSpec | None,
    *,
    link: bool = False,
    read: Reader = optional,
) -> Generator[SdoRead, bytes | None, Raws]:
    """Values of the node's own objects, or, for a drive, of those that each drive has for itself. Objects
    that cannot be read are left out."""
    raw: Raws = {}
    channel = FIRST if member is None else member.sdo_channel
    if channel is None:
        return raw
    family = node.family if member is None else member.family
    for place in places(family, link=link):
        if place.per_drive is not (member is not None):
            continue
        try:
            data = yield from read(place.ref.index, place.ref.sub, channel)
        except SdoError as error:
            if error.was_answered:
                continue
            if channel == FIRST:
                raise
            return raw  # the drive behind the channel may be away while the node itself is there
        if data is not None:
            raw[place.key] = place.number.decode(data)
        elif place.absent is not None:
            raw[place.key] = place.absent
    return raw


def _bring(node: Node, want: OwnWant, raw: Raws, channel: int, owner: str, result: BootResult) -> Do:
    """Bring one object to its wanted value, once; ``raw`` has the present value, and gets the new one."""
    place = want.place
    have = raw.get(place.key)
    if have is not None and want.met_by(have):
        return
    if not node.table.enforce:
        note = Text.of("boot.own_other", owner=owner, place=place.name, held=have or 0, wanted=want.value)
        if have is None:
            note = Text.of("boot.own_not_known", owner=owner, place=place.name, wanted=want.value)
        result.notes.append(note)
        return
    if have is None:
        ref = str(place.ref)
        what = Text.of("boot.own_absent", owner=owner, place=place.name, object=ref, wanted=want.value)
        raise BootError("J", what)
    memory, data = result.memory, place.number.encode(want.value)
    # Each drive has its own object of the same number.
    tried = place.ref.index | channel << 16
    if memory.was_not_kept(tried, place.ref.sub, data):
        what = Text.of("boot.own_stays", owner=owner, place=place.name, held=have, wanted=want.value)
        raise BootError("J", what)
    if _wears(node.family, place):
        try:
            warning = memory.count_write(owner, str(place.ref).upper(), place.name)
        except ParameterError as error:
            raise BootError("J", Text.of("boot.of", owner=owner, what=error.said)) from None
        if warning:
            result.notes.append(warning)

    def refused(error: SdoError) -> BootError:
        memory.note_not_kept(tried, place.ref.sub, data)
        what = Text.of(
            "boot.own_not_taken", owner=owner, place=place.name, wanted=want.value, why=text_of(error)
        )
        return BootError("J", what)

    with told_as(refused):
        yield from write_number(place.ref.index, place.ref.sub, data, None, channel=channel)
    read = yield from optional(place.ref.index, place.ref.sub, channel)
    kept = None if read is None else place.number.decode(read)
    if kept != want.value:
        memory.note_not_kept(tried, place.ref.sub, data)
        found, written = str(kept), str(want.value)
        what = Text.of("boot.not_kept", object=place.name, read=found, written=written)
        raise BootError("J", Text.of("boot.of", owner=owner, what=what))
    raw[place.key] = want.value
    note = Text.of("boot.own_enforced", owner=owner, place=place.name, before=have, now=want.value)
    result.notes.append(note)


def _wears(family: Family, place: OwnPlace) -> bool:
    """Whether writing the object may go to an EEPROM. A switch that keeps writes in the RAM is not consulted:
    one write too many in the count does no harm."""
    if family.eeprom is None or family.eeprom.written_on_save_only:
        return False
    return not any(parameter.volatile and parameter.name == place.name for parameter in family.parameter)


def _note_who_runs_on(node: Node, result: BootResult) -> None:
    """Add one note for all drives of the node that run on for the same reason."""
    names: dict[Said, list[str]] = {}
    for drive in node.drives:
        own = result.own[drive.name]
        if own.verdict is OwnVerdict.RUNS_ON and not own.accepted:
            names.setdefault(own.because, []).append(drive.name.partition("/")[2])
    for reason, drives in names.items():
        note = Text.of("boot.runs_on", why=reason)
        if len(drives) < len(node.drives):
            note = Text.of("boot.some_run_on", drives=tuple(drives), why=reason)
        result.notes.append(note)
