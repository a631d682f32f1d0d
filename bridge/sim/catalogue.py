"""The drive families that can be simulated, and how a node of a site file becomes one."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Final

from bridge.base.errors import OperationFailed
from bridge.canopen.datatypes import REALS
from bridge.eds import Description
from bridge.mapping import Family, load_family
from bridge.sim.cia402.cia402_catalogue import MAPPINGS, cia402
from bridge.sim.core.simulated_device import SimulatedDevice
from bridge.sim.generic.adopted import adopt
from bridge.sim.generic.generic_eds import plan_of_description
from bridge.sim.generic.generic_family import pattern, plan_of_family
from bridge.sim.generic.generic_inputs import motions_of
from bridge.sim.generic.generic_node import GenericNode
from bridge.sim.generic.generic_plan import At
from bridge.sim.lenze.lenze_catalogue import lenze_8400_motec
from bridge.sim.nord.nord_catalogue import NORD
from bridge.sim.stoeber.stoeber_catalogue import stoeber_5000, stoeber_5000_four_axes, stoeber_5000_posi

NOTHING: Final[Mapping[At, int]] = MappingProxyType({})
Factory = Callable[[int, Mapping[str, float]], SimulatedDevice]


def simulate_node(mapping: str, node_id: int, parameters: dict[str, float]) -> SimulatedDevice:
    """A simulated node of the family ``mapping``, with parameters in engineering units.

    NORD: ``P105`` sets all drives of a node, ``fu2/P105`` one, ``P151`` (ms) the interface, and without an
    interface that has parameters ``P513`` (s) the drive's own supervision. STÖBER: ``C01`` (1/min) and the
    ramps ``accelerate_s``, ``decelerate_s``, ``quick_stop_s``, ``axis2/C01`` of one; ``I07``, ``I08``,
    ``I10`` where it positions. CiA 402: objects, ``6083``, ``6046:02``, in the drive's units. Lenze: codes,
    ``C00011`` (1/min), ``C00593/1``. Raises ``OperationFailed`` for a family or a parameter that the
    simulation does not have.
    """
    factory = _FAMILIES.get(mapping)
    if factory is None:
        known = ", ".join(sorted(_FAMILIES))
        raise OperationFailed(f"{mapping} cannot be simulated; families that can: {known}")
    return factory(node_id, parameters)


def simulate_family(
    mappings: Sequence[str], family: Family, node_id: int, parameters: Mapping[str, float]
) -> SimulatedDevice:
    """A simulated node of a family of the site's own. ``mappings`` names it and those that it extends, the
    nearest first: it is played as the first of them that has a simulation, else as a generic node, whose
    values are its set-points. Raises ``OperationFailed`` as ``simulate_node`` does."""
    of_one_axis = all(slot.axis == 1 for slot in family.slot)
    kind = next((name for name in mappings if name in _FAMILIES and of_one_axis), None)
    own: dict[str, float] = {}
    known = dict(parameters)
    if kind is None or kind != mappings[0]:
        of_kind = {one.name for one in load_family(kind).parameter} if kind else set[str]()
        for name in parameters:
            of_slot, _, leaf = name.rpartition("/")
            is_of_family = leaf in {one.name for one in family.parameter} - of_kind
            if is_of_family and (kind or of_slot in ("", *(slot.name for slot in family.slot))):
                own[name] = known.pop(name)
    values = values_of(family, own)
    if kind is None:
        if known:
            raise OperationFailed(f"{', '.join(known)}: the simulated {mappings[0]} has no such parameter")
        plan = plan_of_family(family, node_id).with_numbers(values)
        return GenericNode(node_id, plan, motions_of(plan))
    node = simulate_node(kind, node_id, known)
    adopt(node, family, values)
    return node


def simulate_description(
    description: Description, node_id: int, values: Mapping[At, int] = NOTHING
) -> SimulatedDevice:
    """A simulated node that is as its device description says, and whose inputs move. ``values`` are in
    place of the file's."""
    plan = plan_of_description(description, node_id).with_numbers(values)
    return GenericNode(node_id, plan, motions_of(plan))


def values_of(family: Family, parameters: Mapping[str, float]) -> dict[At, int]:
    """Values of objects for parameters in engineering units, of all axes or, as ``axis2/6083``, of one.
    Raises ``OperationFailed`` where that cannot be."""
    return {at: value for name, given in parameters.items() for at, value in _value(family, name, given)}


def _value(family: Family, name: str, given: float) -> Iterator[tuple[At, int]]:
    of_slot, _, leaf = name.rpartition("/")
    parameter = family.parameter_named(leaf)
    axes = [family.of_slot(slot) for slot in family.slot if of_slot in ("", slot.name)] or [family]
    is_real = parameter.data_type in REALS
    raw = given / parameter.factor
    try:
        word = pattern(parameter.data_type, raw if is_real else round(raw))
    except ValueError as error:
        raise OperationFailed(f"{name} = {given:g}: {error}") from None
    for axis in axes:
        ref = axis.object_of(parameter)
        yield (ref.index, ref.sub), word


_FAMILIES: Final[dict[str, Factory]] = {
    **{f"cia402/{mapping}": cia402 for mapping in MAPPINGS},
    "lenze/8400-motec": lenze_8400_motec,
    **NORD,
    "stoeber/5000": stoeber_5000,
    "stoeber/5000-four-axes": stoeber_5000_four_axes,
    "stoeber/5000-posi": stoeber_5000_posi,
}

SIMULATED: Final = tuple(sorted(_FAMILIES))
"""The mappings whose nodes can be simulated."""
