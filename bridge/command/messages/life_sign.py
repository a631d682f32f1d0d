"""A token that a controller's program has to bring back: a telegram proves a connection, this a program.

Relays, I/O scanners and PLCs in STOP go on writing what they wrote last. So the bridge offers a number that
is another one each second, and follows no rule that they could follow; what is repeated grows old. It is no
secret from a program: who can read it may bring it back.

Sans-IO: ``now`` is monotonic seconds.
"""

from __future__ import annotations

import math
import secrets
from dataclasses import dataclass
from typing import Final

from bridge.config import LIFE_SIGN_MS

_OFFERED_S: Final = LIFE_SIGN_MS / 1000
_TOKENS: Final = 65_535
"""Number of tokens, from 1 on; 0 is none. None comes again before all others, which takes 18 hours."""
_LEAST_STEP: Final = 1_000


@dataclass(frozen=True, slots=True)
class LifeSign:
    """The tokens of one drive. ``start`` is where they begin, ``step``, which has no divisor in common with
    65535, leads from one to the next."""

    start: int
    step: int

    @classmethod
    def at_random(cls) -> LifeSign:
        """Random tokens, others at each start and for each drive: none is fresh by chance elsewhere."""
        step = 0
        while math.gcd(step, _TOKENS) != 1:
            step = _LEAST_STEP + secrets.randbelow(_TOKENS - 2 * _LEAST_STEP)
        return cls(secrets.randbelow(_TOKENS), step)

    def token(self, now: float) -> int:
        """Token that is offered now: 1…65535."""
        return (self.start + _number(now) * self.step) % _TOKENS + 1

    def issued_at(self, token: int, now: float) -> float | None:
        """Start of the last period in which ``token`` was offered; None for a number that is no token."""
        if not 1 <= token <= _TOKENS:
            return None
        number = _number(now)
        place = (token - 1 - self.start) * pow(self.step, -1, _TOKENS)
        return (number - (number - place) % _TOKENS) * _OFFERED_S


def _number(now: float) -> int:
    """Number of the token that is offered now."""
    return math.floor(now / _OFFERED_S)
