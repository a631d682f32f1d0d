"""SDO transfers of a node for a parameter."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from bridge.mapping.model import ObjectRef
from bridge.text import Text


@dataclass(frozen=True, slots=True)
class Transfer:
    """Read an object (``data`` None) or write it. ``of_node``: over the node's first SDO channel. A write is
    not begun where ``why_not``, asked at that moment, has a reason."""

    address: ObjectRef
    data: bytes | None = None
    of_node: bool = False
    why_not: Callable[[], Text | None] | None = None
