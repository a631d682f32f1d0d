"""Boot-up of one node as a generator (after CiA 302-2): it asks, is answered, and ends with a plan.

What the node says of itself wins over the mapping file: PDOs are read back, never assumed. A node
without an object is taken by the mapping file's word, and that is noted.
"""

from __future__ import annotations

import struct
from collections.abc import Generator
from dataclasses import dataclass, field
from typing import Final

from bridge.command import Drive, Identification
from bridge.command.plant import Node
from bridge.config import NodeTable
from bridge.image import DataType
from bridge.mapping.model import IdentityRule, ObjectRef, Parameter, Pdo
from bridge.southbound.canopen import cobid
from bridge.southbound.canopen.nmt import NmtCommand, NmtState
from bridge.southbound.canopen.pdo import Entry, MappingError, PdoCodec
from bridge.southbound.canopen.sdo import SdoError

_RPDO_PARAMETER: Final = 0x1400
_RPDO_MAPPING: Final = 0x1600
_TPDO_PARAMETER: Final = 0x1800
_TPDO_MAPPING: Final = 0x1A00
_MOST_ENTRIES: Final = 64
_LONGEST_NUMBER: Final = 8
_LONGEST_NAME: Final = 64
_GOES_OPERATIONAL_S: Final = 2.0


@dataclass(frozen=True, slots=True)
class Step:
    """What the boot-up is doing now, for ``boot_status``."""

    text: str


@dataclass(frozen=True, slots=True)
class Read:
    index: int
    sub: int = 0


@dataclass(frozen=True, slots=True)
class Write:
    index: int
    sub: int
    data: bytes


@dataclass(frozen=True, slots=True)
class Nmt:
    command: NmtCommand


@dataclass(frozen=True, slots=True)
class SendStopped:
    """Send a stopped word to every drive on its factory COB-ID: the node may still be operational."""


@dataclass(frozen=True, slots=True)
class StartSupervision:
    """From now on the node is expected to be heard."""


@dataclass(frozen=True, slots=True)
class Await:
    """Wait until the node reports this state. Without supervision there is nothing to wait for."""

    state: NmtState
    timeout_s: float


Action = Step | Read | Write | Nmt | SendStopped | StartSupervision | Await


class BootError(Exception):
    """The node cannot be used as configured; the message says why."""


@dataclass(frozen=True, slots=True)
class PdoPlan:
    """One PDO as the node has it. ``words`` gives for each entry its place in ``process.rpdo`` or
    ``process.tpdo``, or None for what we do not know."""

    cob_id: int
    transmission_type: int
    event_timer_ms: int
    codec: PdoCodec
    words: tuple[int | None, ...]


@dataclass(slots=True)
class DrivePlan:
    """Both PDOs of one drive, or the reason why it cannot be served."""

    rpdo: PdoPlan | None = None
    tpdo: PdoPlan | None = None
    problem: str = ""


@dataclass(slots=True)
class BootResult:
    identification: Identification = field(default_factory=Identification)
    drives: dict[str, DrivePlan] = field(default_factory=dict[str, DrivePlan])
    scales: dict[str, dict[str, float]] = field(default_factory=dict[str, dict[str, float]])
    notes: list[str] = field(default_factory=list[str])


Boot = Generator[Action, bytes | None, BootResult]
Ask = Generator[Action, bytes | None, bytes | None]


def boot(node: Node) -> Boot:
    """Boot ``node``; returns what is to be known of it.

    Raises BootError where it is another device or does not go operational, SdoError where it does not
    answer.
    """
    result = BootResult()
    yield Step("looking for the node")
    device_type = _number((yield Read(0x1000)))
    yield SendStopped()
    yield Nmt(NmtCommand.ENTER_PRE_OPERATIONAL)
    yield Step("reading the identity")
    result.identification = yield from _identify(node)
    _check_family(node.family.identity, device_type, result.identification)
    yield Step("setting error control")
    yield from _error_control(node.table, result)
    for drive in node.drives:
        yield Step(f"reading the process data mapping of {drive.slot.name}")
        result.drives[drive.name] = yield from _read_plan(node, drive, result)
    _refuse_doubles(result)
    for drive in node.drives:
        result.scales[drive.name] = yield from _read_scales(drive, result)
    yield Step("starting")
    yield StartSupervision()
    yield Nmt(NmtCommand.START)
    yield Await(NmtState.OPERATIONAL, _GOES_OPERATIONAL_S)
    return result


def _optional(index: int, sub: int = 0) -> Ask:
    """An object that the node need not have: None where it aborts. A time-out is still an error."""
    try:
        return (yield Read(index, sub))
    except SdoError as error:
        if error.by_server:
            return None
        raise


def _number(data: bytes | None, default: int = 0) -> int:
    """The number in an answer. Raises BootError where it is longer than any number of CANopen."""
    if data is None:
        return default
    if len(data) > _LONGEST_NUMBER:
        raise BootError(f"the node answers with {len(data)} bytes where a number belongs")
    return int.from_bytes(data, "little")


def _check_family(rule: IdentityRule, device_type: int, found: Identification) -> None:
    """Raises BootError where the node is no device of its mapping's family."""
    for what, want, have in (
        ("device type", rule.device_type, device_type),
        ("vendor id", rule.vendor_id, found.vendor),
        ("product code", rule.product_code, found.product),
    ):
        if want is not None and want != have:
            raise BootError(f"another device: {what} is {have:08X}h, the mapping says {want:08X}h")


def _identify(node: Node) -> Generator[Action, bytes | None, Identification]:
    vendor = _number((yield from _optional(0x1018, 1)))
    product = _number((yield from _optional(0x1018, 2)))
    revision = _number((yield from _optional(0x1018, 3)))
    serial = _number((yield from _optional(0x1018, 4)))
    name = (yield from _optional(0x1008)) or b""
    text = name[:_LONGEST_NAME].split(b"\0", 1)[0].decode("latin-1").strip()
    expected = node.table.identity
    for what, want, have in (
        ("vendor id", expected.vendor_id, vendor),
        ("product code", expected.product_code, product),
        ("revision", expected.revision, revision),
        ("serial number", expected.serial, serial),
    ):
        if want is not None and want != have:
            raise BootError(f"another device: {what} is {have:08X}h, the site file says {want:08X}h")
    return Identification(vendor, product, revision, serial, text)


def heartbeat_period_ms(supervision_ms: int) -> int:
    """The producer time for a consumer time: two heartbeats in a row may be lost."""
    return max(1, supervision_ms // 3)


def _error_control(table: NodeTable, result: BootResult) -> Generator[Action, bytes | None, None]:
    """Heartbeat or guarding, never both (CiA 301 §7.2.8.3.2); written only where it differs."""
    heartbeat_ms = heartbeat_period_ms(table.supervision_ms) if table.supervision == "heartbeat" else 0
    guard = (table.supervision_ms, table.life_time_factor) if table.supervision == "guarding" else (0, 0)
    wanted = [
        (0x1017, struct.pack("<H", heartbeat_ms)),
        (0x100C, struct.pack("<H", guard[0])),
        (0x100D, struct.pack("<B", guard[1])),
    ]
    # What is to be off goes off first.
    wanted.sort(key=lambda item: any(item[1]))
    for index, data in wanted:
        have = yield from _optional(index)
        if have == data or (have is None and not any(data)):
            continue
        try:
            yield Write(index, 0, data)
        except SdoError as error:
            if not error.by_server:
                raise
            raise BootError(f"{table.supervision} is not possible: {error}") from None
        result.notes.append(f"{index:04X}h was {_number(have)}, is {_number(data)} now")


def _read_plan(node: Node, drive: Drive, result: BootResult) -> Generator[Action, bytes | None, DrivePlan]:
    plan = DrivePlan()
    exact = node.family.process.exact_length
    try:
        plan.rpdo = yield from _read_pdo(node, drive.slot.rpdo, _RPDO_PARAMETER, _RPDO_MAPPING, result)
        plan.tpdo = yield from _read_pdo(node, drive.slot.tpdo, _TPDO_PARAMETER, _TPDO_MAPPING, result)
        if 0 not in plan.rpdo.words:
            raise MappingError(f"RPDO{drive.slot.rpdo.number} does not carry the control word")
        if 0 not in plan.tpdo.words:
            raise MappingError(f"TPDO{drive.slot.tpdo.number} does not carry the status word")
        words = len(node.family.process.rpdo)
        if exact and plan.rpdo.codec.length != 2 * words:
            raise MappingError(
                f"RPDO{drive.slot.rpdo.number} maps {plan.rpdo.codec.length} bytes; the interface "
                f"evaluates only {words} words"
            )
    except MappingError as error:
        plan.problem = str(error)
        result.notes.append(f"{drive.slot.name}: {error}")
    return plan


def _refuse_doubles(result: BootResult) -> None:
    """Two drives behind one identifier would get each other's words: neither is served."""
    users: dict[int, list[DrivePlan]] = {}
    for plan in result.drives.values():
        for pdo in (plan.rpdo, plan.tpdo):
            if pdo is not None:
                users.setdefault(pdo.cob_id, []).append(plan)
    for cob_id, plans in users.items():
        for plan in plans if len(plans) > 1 else ():
            plan.problem = plan.problem or f"{cob_id:03X}h is the identifier of more than one PDO"
            if plan.problem not in result.notes:
                result.notes.append(plan.problem)


def _read_pdo(
    node: Node, pdo: Pdo, parameter: int, mapping: int, result: BootResult
) -> Generator[Action, bytes | None, PdoPlan]:
    """One PDO as the node has it. Raises MappingError where it is off or cannot be used."""
    parameter += pdo.number - 1
    mapping += pdo.number - 1
    default_id = pdo.cob_id + node.table.id
    cob_id = _number((yield from _optional(parameter, 1)), default_id)
    if cob_id & cobid.PDO_DISABLED:
        raise MappingError(f"{parameter:04X}h:01: the PDO is switched off in the node")
    if cob_id & cobid.PDO_EXTENDED or not cobid.is_for_pdos(cob_id & cobid.COB_ID_MASK):
        raise MappingError(f"{parameter:04X}h:01 is {cob_id:08X}h: no identifier for a PDO")
    kind = _number((yield from _optional(parameter, 2)), 255)
    event_ms = 0
    if parameter >= _TPDO_PARAMETER and kind >= 254:
        event_ms = _number((yield from _optional(parameter, 5)))
    count = yield from _optional(mapping, 0)
    if count is None:
        result.notes.append(f"the node has no {mapping:04X}h: taken as the mapping file has it")
        entries = tuple(Entry(refs[0].index, refs[0].sub, 16) for refs in pdo.objects)
    else:
        entries = yield from _read_entries(mapping, _number(count))
    words = match_words(entries, pdo.objects)
    return PdoPlan(cob_id & cobid.COB_ID_MASK, kind, event_ms, PdoCodec(entries), words)


def _read_entries(mapping: int, count: int) -> Generator[Action, bytes | None, tuple[Entry, ...]]:
    if count > _MOST_ENTRIES:
        raise MappingError(f"{mapping:04X}h:00 is {count}, at most {_MOST_ENTRIES} objects can be mapped")
    entries: tuple[Entry, ...] = ()
    for sub in range(1, count + 1):
        value = _number((yield Read(mapping, sub)))
        entries = (*entries, Entry.from_object(value))
    return entries


def match_words(entries: tuple[Entry, ...], objects: list[list[ObjectRef]]) -> tuple[int | None, ...]:
    """For each entry the word it is, by the layout of the mapping file that explains the most of them."""
    best: tuple[int | None, ...] = (None,) * len(entries)
    for layout in range(max(len(refs) for refs in objects)):
        places: dict[tuple[int, int], int] = {}
        for word, refs in enumerate(objects):
            ref = refs[min(layout, len(refs) - 1)]
            places[ref.index, ref.sub] = word
        found = tuple(places.get((entry.index, entry.sub)) for entry in entries)
        if best.count(None) > found.count(None):
            best = found
    return best


def _read_scales(drive: Drive, result: BootResult) -> Generator[Action, bytes | None, dict[str, float]]:
    """The drive's own values of the parameters that scale its words, where they can be read."""
    scales: dict[str, float] = {}
    if not drive.slot.parameters_by_sdo:
        return scales
    for parameter in drive.family.parameter:
        if not parameter.read:
            continue
        data = yield from _optional(parameter.object.index, parameter.object.sub)
        value = 0.0 if data is None else parameter_value(parameter, data)
        if value <= 0:
            continue
        scales[parameter.name] = value
        given = drive.given_parameters.get(parameter.name)
        if given is not None and abs(given - value) > 1e-6:
            result.notes.append(
                f"{drive.slot.name}: {parameter.name} is {value:g} {parameter.unit} in the drive, "
                f"{given:g} in the site file; the drive's counts"
            )
    return scales


def number_from(data_type: DataType, data: bytes) -> int:
    """The number in ``data``, little-endian, signed where its type is. Bytes beyond the type's are left
    out: some servers answer every read with four."""
    size = 4 if data_type.value.endswith("32") else 2 if data_type.value.endswith("16") else 1
    return int.from_bytes(data[:size], "little", signed=data_type in (DataType.INT16, DataType.INT32))


def parameter_value(parameter: Parameter, data: bytes) -> float:
    """The value of a parameter from its bytes, in its unit."""
    return round(number_from(parameter.data_type, data) * parameter.factor, 9)
