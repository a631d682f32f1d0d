"""Own supervision of a family's drives: what would stop one if the bridge fell silent."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from bridge.canopen.datatypes import TypeName
from bridge.mapping.entry_types import Ref, Table

Watches = Literal["process_data", "heartbeat", "guarding", "link"]


class OwnObject(Table):
    """Place of a setting: a parameter of this file, or an object."""

    parameter: str | None = Field(None, description="one of this file, which has object, type and texts")
    object: Ref | None = Field(None, description="instead of a parameter")
    data_type: TypeName = Field("uint16", description="type of an object; a parameter has its own")
    per_drive: bool = Field(False, description="true: each drive of the node has its own")
    factory: int | None = Field(None, description="value as delivered, where that is known")
    absent: int | None = Field(None, description="value that counts where a node does not have the object")


class OwnReaction(OwnObject):
    """Reaction of the drive when the time has run out. Without one it stops."""

    nothing: list[int] = Field(default_factory=lambda: [0], description="with these values it runs on")
    stop: int | None = Field(None, description="value that `enforce` writes where it would run on")


class OwnSupervision(OwnObject):
    """One thing that the drive watches; ``object`` or ``parameter`` holds the time.

    ``heartbeat`` is an entry of 1016h, node id above the time; ``guarding`` is 100Ch, times 100Dh
    (CiA 301). ``link`` is the drive's watch over its bus interface: it says nothing of the bridge.
    """

    name: str = Field(min_length=1)
    watches: Watches = Field(description="process_data, heartbeat, guarding or link")
    unit_ms: float = Field(1.0, gt=0, description="one step of the time in ms")
    off: list[int] = Field(default_factory=lambda: [0], description="with these values nothing is watched")
    reaction: OwnReaction | None = None
