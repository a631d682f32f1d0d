"""Messages and signals of a bus, as a DBC file has them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

BRIDGE: Final = "DRIVEBRIDGE"
"""The bridge as a node. Names of nodes in a site file are in lower case: none can be the same."""


@dataclass(frozen=True, slots=True)
class MessageSignal:
    """``start`` and ``length`` in bits, little-endian; physical value = raw × factor + offset.

    ``is_float``: raw is a floating-point number of IEEE 754. ``choices`` has the texts of an enumeration.
    ``low`` and ``high`` are in ``unit``, None where not known.
    """

    name: str
    start: int
    length: int
    is_signed: bool = False
    factor: float = 1.0
    offset: float = 0.0
    low: float | None = None
    high: float | None = None
    unit: str = ""
    is_float: bool = False
    choices: Mapping[int, str] = field(default_factory=dict[int, str])
    comment: str = ""


@dataclass(frozen=True, slots=True)
class Message:
    """``length`` in bytes; ``groups`` are signals that belong together, by the name of the group.

    ``receivers`` are names of nodes, ``cycle_ms`` is 0 where nothing makes it regular.
    """

    cob_id: int
    name: str
    length: int
    sender: str
    receivers: tuple[str, ...]
    signals: tuple[MessageSignal, ...]
    comment: str = ""
    cycle_ms: int = 0
    groups: Mapping[str, tuple[str, ...]] = field(default_factory=dict[str, tuple[str, ...]])


@dataclass(frozen=True, slots=True)
class BusDescription:
    """``nodes`` has what is to be said of each by its name, the bridge first."""

    name: str
    bitrate: int
    comment: str
    nodes: Mapping[str, str]
    messages: tuple[Message, ...]
