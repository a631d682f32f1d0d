"""A simulated drive of a known kind as one of a family that extends the mapping of its kind."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Final

from bridge.mapping import Family
from bridge.mapping.model import IdentityRule
from bridge.sim.core.dictionary import Cell, Dictionary, Domain, Entry, IntegerType, Number, constant
from bridge.sim.core.sdo_abort import SdoAbort
from bridge.sim.core.simulated_device import SimulatedDevice
from bridge.sim.generic.generic_family import objects_of_family
from bridge.sim.generic.generic_plan import At, BytesPlan, NumberPlan

_ALL: Final = 0xFFFF_FFFF


def adopt(node: SimulatedDevice, family: Family, values: Mapping[At, int]) -> None:
    """Let ``node`` say of itself what the family asks for, and give it the objects that it lacks. Those are
    plain variables, which hold ``values`` at first: nothing in the drive follows them, and they last until
    the simulation ends."""
    for at, want, mask in _identity(family.identity):
        have = _number(node.dictionary, at)
        if (have ^ want) & mask:
            node.dictionary.add(*at, constant(IntegerType.UNSIGNED32, have & ~mask | want & mask))
    for plan in objects_of_family(family):
        if not _has(node.dictionary, plan.at):
            node.dictionary.add(*plan.at, _variable(plan, values.get(plan.at)))


def _variable(plan: NumberPlan | BytesPlan, value: int | None) -> Entry:
    if isinstance(plan, BytesPlan):
        content = [plan.value]

        def write(data: bytes) -> None:
            content[0] = data

        return Domain(1 << 16, lambda: content[0], write)
    cell = Cell(plan.value if value is None else value)
    return Number(
        plan.data_type,
        cell.get if plan.readable else None,
        cell.set if plan.writable else None,
        plan.low,
        plan.high,
        plan.in_rpdo and plan.writable,
        plan.in_tpdo and plan.readable,
    )


def _identity(rule: IdentityRule) -> Iterable[tuple[At, int, int]]:
    """Bits of 1000h and 1018h that an identity rule requires: object, value and mask."""
    for at, want, mask in (
        ((0x1000, 0), rule.device_type, rule.device_type_mask),
        ((0x1018, 1), rule.vendor_id, None),
        ((0x1018, 2), rule.product_code, rule.product_code_mask),
        ((0x1018, 3), rule.revision, rule.revision_mask),
    ):
        if want is not None:
            yield at, want, _ALL if mask is None else mask


def _has(dictionary: Dictionary, at: At) -> bool:
    try:
        dictionary.find(*at)
    except SdoAbort:
        return False
    return True


def _number(dictionary: Dictionary, at: At) -> int:
    entry = dictionary.find(*at) if _has(dictionary, at) else None
    return entry.read() if isinstance(entry, Number) and entry.read else 0
