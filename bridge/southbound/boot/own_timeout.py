"""What the node does by itself when our process data fail to come: said at boot-up where that is nothing."""

from __future__ import annotations

from bridge.command.plant import Node
from bridge.southbound.boot.actions import BootResult, Do, Step, number, optional


def note_own_timeout(node: Node, result: BootResult) -> Do:
    """Read time and reaction of the node's own supervision where the family has a reaction to be set.

    Nothing is written: what the drive is to do is for the site file (``configure``) to say.
    """
    own = node.family.own_timeout
    if own is None or own.reaction is None:
        return
    yield Step("reading the node's own time-out", "J")
    reaction = own.reaction.object
    does = yield from optional(reaction.index, reaction.sub)
    if does is not None and number(does) == own.reaction.none:
        result.notes.append(
            f"the node itself does nothing when process data fail to come: {reaction} is {own.reaction.none}"
        )
        return
    time = yield from optional(own.object.index, own.object.sub)
    if time is not None and not number(time):
        result.notes.append(f"the node itself does not watch its process data: {own.object} is 0")
