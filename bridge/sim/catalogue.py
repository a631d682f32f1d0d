"""The drive families that can be simulated, and how a node of a site file becomes one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from bridge.errors import OperationFailed
from bridge.sim.device import SimulatedDevice
from bridge.sim.nord_catalogue import NORD
from bridge.sim.object_catalogue import MAPPINGS, cia402, lenze_8400_motec
from bridge.sim.stoeber_catalogue import stoeber_5000, stoeber_5000_four_axes

Factory = Callable[[int, Mapping[str, float]], SimulatedDevice]


def simulate_node(mapping: str, node_id: int, parameters: dict[str, float]) -> SimulatedDevice:
    """A simulated node of the family ``mapping``, with parameters in engineering units.

    NORD: ``P105`` sets all drives of a node, ``fu2/P105`` one, ``P151`` (ms) the interface, and without an
    interface that has parameters ``P513`` (s) the drive's own supervision. STÖBER: ``C01`` (1/min) and the
    ramps ``accelerate_s``, ``decelerate_s``, ``quick_stop_s``, ``axis2/C01`` of one. CiA 402: objects,
    ``6083``, ``6046:02``, in the drive's units. Lenze: codes, ``C00011`` (1/min), ``C00593/1``. Raises
    ``OperationFailed`` for a family or a parameter that the simulation does not have.
    """
    factory = _FAMILIES.get(mapping)
    if factory is None:
        known = ", ".join(sorted(_FAMILIES))
        raise OperationFailed(f"{mapping} cannot be simulated; families that can: {known}")
    return factory(node_id, parameters)


_FAMILIES: Final[dict[str, Factory]] = {
    **{f"cia402/{mapping}": cia402 for mapping in MAPPINGS},
    "lenze/8400-motec": lenze_8400_motec,
    **NORD,
    "stoeber/5000": stoeber_5000,
    "stoeber/5000-four-axes": stoeber_5000_four_axes,
}

SIMULATED: Final = tuple(sorted(_FAMILIES))
"""The mappings whose nodes can be simulated."""
