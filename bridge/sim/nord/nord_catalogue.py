"""Simulated NORD nodes from the parameters of a site file."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Final

from bridge.base.errors import OperationFailed
from bridge.sim.core.simulated_device import SimulatedDevice
from bridge.sim.nord.nord_drive import NordDrive
from bridge.sim.nord.nord_interface import Kind
from bridge.sim.nord.nord_parameters import NordParameters
from bridge.sim.nord.nord_posicon import commission as posicon
from bridge.sim.nord.nord_single import NordSingle
from bridge.sim.nord.nord_single_settings import RJ45_5XX, RJ45_54X, TU3, Variant
from bridge.sim.nord.nord_tu4 import NordTu4

_P151_MOST_MS: Final = 32767
_POSITION: Final = MappingProxyType(
    {"P543": 10.0, "P544": 15.0, "P545": 1.0, "P546": 23.0, "P547": 24.0, "P548": 1.0, "P600": 2.0}
)
"""Settings that the mapping sk-tu3-cao-pdo3 requires of its drive (BU 2500 §5.4): a position in two words, a
frequency, and that it positions."""
_SLOTS: Final = ("fu1", "fu2", "fu3", "fu4")


def _interface(
    kind: Kind, *, positions: bool = False
) -> Callable[[int, Mapping[str, float]], SimulatedDevice]:
    """``P105`` sets all four drives, ``fu2/P105`` one, ``P151`` (ms) the interface. ``positions``: they are
    set up as in §5.4."""

    def make(node_id: int, parameters: Mapping[str, float]) -> SimulatedDevice:
        p151_ms = parameters.get("P151", 0)
        if not 0 <= p151_ms <= _P151_MOST_MS:
            raise OperationFailed(f"P151 = {p151_ms:g} is outside 0 … {_P151_MOST_MS} ms")
        node = NordTu4(node_id, kind=kind, p151_ms=round(p151_ms))
        for drive in node.drives if positions else ():
            posicon(drive.parameters)
        others = {name: value for name, value in parameters.items() if name != "P151"}
        _commission(kind, dict(zip(_SLOTS, node.drives, strict=True)), others)
        return node

    return make


def _single(
    variant: Variant, preset: Mapping[str, float] = MappingProxyType({})
) -> Callable[[int, Mapping[str, float]], SimulatedDevice]:
    """``P105`` or ``drive/P105``; ``P513`` (s) is the drive's supervision of its master."""

    def make(node_id: int, parameters: Mapping[str, float]) -> SimulatedDevice:
        node = NordSingle(node_id, variant)
        _commission(variant.device_name, {"drive": node.drive}, {**preset, **parameters})
        return node

    return make


def _commission(name: str, drives: Mapping[str, NordDrive], parameters: Mapping[str, float]) -> None:
    # Settings for one drive come after those for all.
    for key in sorted(parameters, key=lambda key: "/" in key):
        slot, _, parameter = key.rpartition("/")
        if (slot and slot not in drives) or not parameter.removeprefix("P").isdigit():
            takes = f"P<number> or {', '.join(f'{slot}/P<number>' for slot in drives)}"
            raise OperationFailed(f"{key}: the simulated {name} takes {takes}")
        for one, drive in drives.items():
            if slot in ("", one):
                _set(drive.parameters, key, int(parameter.removeprefix("P")), parameters[key])


def _set(parameters: NordParameters, key: str, number: int, value: float) -> None:
    try:
        parameters.commission(number, value)
    except KeyError:
        raise OperationFailed(f"{key}: the simulated drive has no such parameter") from None
    except ValueError as error:
        raise OperationFailed(str(error)) from None


def _names(mapping: str, endings: Sequence[str]) -> list[str]:
    return [mapping, *(f"{mapping}-{ending}" for ending in endings)]


NORD: Final = {
    "nord/sk-cu4-cao": _interface("SK CU4-CAO"),
    **dict.fromkeys(_names("nord/sk-tu4-cao", ["ds402"]), _interface("SK TU4-CAO")),
    "nord/sk-tu4-cao-posicon": _interface("SK TU4-CAO", positions=True),
    **dict.fromkeys(_names("nord/sk-tu3-cao", ["pdo1", "pdo4"]), _single(TU3)),
    "nord/sk-tu3-cao-pdo3": _single(TU3, _POSITION),
    **dict.fromkeys(_names("nord/sk-5xxe-rj45", ["encoder"]), _single(RJ45_5XX)),
    **dict.fromkeys(_names("nord/sk-54xe-rj45", ["encoder"]), _single(RJ45_54X)),
}
"""Devices by mapping. Where mappings differ for the same device, as by the profile, the boot-up sets it."""
