"""Telegrams of a drive with ``life_sign = true`` count for as long as the newest token that its owner has
brought back: from when that was offered first, for the time-out (``bridge.command.messages.life_sign``)."""

from __future__ import annotations

from typing import Final

from bridge.command.leg.draft import Draft
from bridge.command.messages.request import Action, Code, Identity, Request
from bridge.command.messages.telegram import Refusal
from bridge.image import Value
from bridge.text import Text

_PROVES: Final = frozenset((Action.KEEP_ALIVE, Action.RESET_FAULT, Action.START))
"""Commands without a place for a token, which count as telegrams."""


def read(draft: Draft, who: Identity, token: Value | None) -> float | None:
    """Time until which telegrams count with this token, or with the one that ``who`` has brought back before;
    None where there is none. Raises ``Refusal``."""
    life = draft.settings.life
    if life is None:
        if token is not None:
            raise Refusal(Code.UNKNOWN_POINT, Text.of("life_sign.not_asked_for"))
        return None
    until = draft.owner.alive_until if who.goes_on_as(draft.owner.identity) else None
    if token is None:
        return until
    if isinstance(token, bool) or not isinstance(token, int | float) or token not in range(0x1_0000):
        raise Refusal(Code.OUT_OF_RANGE, Text.of("life_sign.range"))
    issued_at = life.issued_at(int(token), draft.now)
    if issued_at is None:
        return until
    ends_at = issued_at + draft.timer.timeout_ms / 1000
    return ends_at if until is None else max(until, ends_at)


def is_missing(draft: Draft, until: float | None) -> bool:
    """Whether a telegram does not count at all, ``until`` being the time that ``read`` has given."""
    return draft.settings.life is not None and (until is None or draft.now >= until)


def refusal() -> Refusal:
    return Refusal(Code.NOT_VALID, Text.of("life_sign.missing"))


def is_there(draft: Draft, who: Identity) -> bool:
    """Whether a command of ``who`` without a token proves that its program lives."""
    until = draft.owner.alive_until if who.goes_on_as(draft.owner.identity) else None
    return not is_missing(draft, until)


def check(draft: Draft, request: Request) -> None:
    """Check a command: raises ``Refusal`` for one that would be a telegram of a program that may be dead."""
    if request.action in _PROVES and not is_there(draft, request.identity):
        raise refusal()


def note(draft: Draft, until: float | None) -> None:
    """Have the owner's telegrams count until then."""
    if until is not None and until != draft.owner.alive_until:
        draft.owner = draft.owner._replace(alive_until=until)
