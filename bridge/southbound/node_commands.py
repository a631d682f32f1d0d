"""Commands on a node: who may give them."""

from __future__ import annotations

from collections.abc import Sequence

from bridge.command import Drive, Request, Role


def refusal(request: Request, drives: Sequence[Drive]) -> str | None:
    """Why this identity may not command the node now, or None if it may.

    A command on the node touches all its drives, so nobody gives one while another identity controls
    one of them; an engineer may.
    """
    if request.identity.role < Role.OPERATOR:
        return f"{request.identity} may only read"
    if request.identity.role >= Role.ENGINEER:
        return None
    for drive in drives:
        owner = drive.channel.owner
        if owner is not None and not request.identity.is_same(owner):
            return f"{drive.name} is controlled by {owner}"
    return None
