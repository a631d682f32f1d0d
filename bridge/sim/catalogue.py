"""Which drive families can be simulated, and how a site file's node becomes one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from bridge.errors import OperationFailed
from bridge.sim.cia402_catalogue import MAPPINGS, cia402
from bridge.sim.lenze_catalogue import lenze_8400_motec
from bridge.sim.node import SimulatedNode
from bridge.sim.nord_tu4 import NordTu4
from bridge.sim.stoeber_catalogue import stoeber_5000, stoeber_5000_four_axes

Factory = Callable[[int, Mapping[str, float]], SimulatedNode]


def simulate_node(mapping: str, node_id: int, parameters: dict[str, float]) -> SimulatedNode:
    """A simulated node of the family ``mapping``, with parameters in engineering units.

    NORD: ``P105`` sets all four drives, ``fu2/P105`` one, ``P151`` (ms) the interface. STÖBER: ``C01``
    (1/min) and the ramps ``accelerate_s``, ``decelerate_s``, ``quick_stop_s``, ``axis2/C01`` of one.
    CiA 402: objects, ``6083``, ``6046:02``, in the drive's units. Lenze: codes, ``C00011`` (1/min), ``C00593/1``. Raises
    ``OperationFailed`` for a family or a parameter that the simulation does not have.
    """
    factory = _FAMILIES.get(mapping)
    if factory is None:
        known = ", ".join(sorted(_FAMILIES))
        raise OperationFailed(f"{mapping} cannot be simulated; families that can: {known}")
    return factory(node_id, parameters)


def _nord_tu4(node_id: int, parameters: Mapping[str, float]) -> SimulatedNode:
    p151_ms = parameters.get("P151", 0)
    if not 0 <= p151_ms <= 32767:
        raise OperationFailed(f"P151 = {p151_ms:g} is outside 0 … 32767 ms")
    node = NordTu4(node_id, p151_ms=round(p151_ms))
    # What is meant for one drive comes after what is meant for all.
    for name in sorted(parameters, key=lambda name: "/" in name):
        if name != "P151":
            _commission(node, name, parameters[name])
    return node


def _commission(node: NordTu4, name: str, value: float) -> None:
    slot, _, parameter = name.rpartition("/")
    slots = ("fu1", "fu2", "fu3", "fu4")
    if (slot and slot not in slots) or not parameter.removeprefix("P").isdigit():
        raise OperationFailed(f"{name}: the simulated SK TU4-CAO takes P<number> or fu<n>/P<number>")
    for one, drive in zip(slots, node.drives, strict=True):
        if slot not in ("", one):
            continue
        try:
            drive.parameters.commission(int(parameter.removeprefix("P")), value)
        except KeyError:
            raise OperationFailed(f"{name}: the simulated drive has no such parameter") from None
        except ValueError as error:
            raise OperationFailed(str(error)) from None


_FAMILIES: Final[dict[str, Factory]] = {
    **{f"cia402/{mapping}": cia402 for mapping in MAPPINGS},
    "lenze/8400-motec": lenze_8400_motec,
    "nord/sk-tu4-cao": _nord_tu4,
    "stoeber/5000": stoeber_5000,
    "stoeber/5000-four-axes": stoeber_5000_four_axes,
}

SIMULATED: Final = tuple(sorted(_FAMILIES))
"""The mappings whose nodes can be played."""
