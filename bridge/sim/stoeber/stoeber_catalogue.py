"""A site file's parameters for a simulated STÖBER inverter."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from bridge.base.errors import OperationFailed
from bridge.sim.stoeber.stoeber_5000 import Stoeber5000

_AXES: Final = 4
_PARAMETERS: Final = {
    "C01": ("c01_rpm", 1.0, 32767.0),
    "accelerate_s": ("accelerate_s", 0.0, 600.0),
    "decelerate_s": ("decelerate_s", 0.0, 600.0),
    "quick_stop_s": ("quick_stop_s", 0.0, 600.0),
}
"""Name in the simulation, and limits."""
_POSITIONING: Final = {
    **_PARAMETERS,
    "I07": ("i07", 1.0, 1e6),
    "I08": ("i08", 1.0, 1e6),
    "I10": ("max_speed", 1.0, 1e6),
}


def stoeber_5000(node_id: int, parameters: Mapping[str, float]) -> Stoeber5000:
    """One axis."""
    return _commissioned(Stoeber5000(node_id), parameters)


def stoeber_5000_posi(node_id: int, parameters: Mapping[str, float]) -> Stoeber5000:
    """One axis with the application command positioning."""
    return _commissioned(Stoeber5000(node_id, positions=True), parameters, _POSITIONING)


def stoeber_5000_four_axes(node_id: int, parameters: Mapping[str, float]) -> Stoeber5000:
    return _commissioned(Stoeber5000(node_id, axes=_AXES, name="SDS 5015"), parameters)


def _commissioned(
    node: Stoeber5000,
    parameters: Mapping[str, float],
    known: Mapping[str, tuple[str, float, float]] = _PARAMETERS,
) -> Stoeber5000:
    slots = [f"axis{axis.number}" for axis in node.axes]
    # Settings for one axis come after those for all.
    for name in sorted(parameters, key=lambda name: "/" in name):
        slot, _, parameter = name.rpartition("/")
        if parameter not in known or slot not in ("", *slots):
            takes = ", ".join(known)
            hint = f"the simulated STÖBER 5000 takes {takes}, or {slots[-1]}/C01 for one axis"
            raise OperationFailed(f"{name}: {hint}")
        attribute, low, high = known[parameter]
        value = parameters[name]
        if not low <= value <= high:
            raise OperationFailed(f"{name} = {value:g} is outside {low:g} … {high:g}")
        whole = value if attribute.endswith("_s") else round(value)
        node.commission(slots.index(slot) if slot else None, **{attribute: whole})
    return node
