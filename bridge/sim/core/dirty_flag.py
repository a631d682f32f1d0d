"""Flag of a node that has to look at what it sends."""

from __future__ import annotations


class DirtyFlag:
    """Set by each part of a node that has changed what the node shows on its bus, and cleared by whoever has
    looked. A frame that brings none costs no more than taking it in."""

    __slots__ = ("is_set",)

    def __init__(self) -> None:
        self.is_set = True
