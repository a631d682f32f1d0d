"""Outcomes in words: as explanations of operations and as an output argument of methods."""

from __future__ import annotations

from typing import Final

from bridge.canopen import abort
from bridge.command.messages.request import Outcome
from bridge.text import LANGUAGES, Text, Words, render
from bridge.uaserver.explanations import Explanation
from bridge.uaserver.languages import Spoken

SYMBOLS: Final = "urn:drivebridge:codes"
"""Namespace of the codes that explanations have."""


def spoken(words: Words) -> Spoken:
    return Spoken({one: render(words, one) for one in LANGUAGES})


def explanation(outcome: Outcome) -> Explanation:
    """The bridge's code and sentence, and the drive's SDO abort code with its text."""
    code = outcome.abort_code
    more = f"SDO abort {code:08X}h: {abort.text(code)}" if code else ""
    symbol = outcome.said.code if isinstance(outcome.said, Text) else outcome.code.value
    return Explanation(symbol, SYMBOLS, spoken(outcome.said or outcome.code.value), more)


def outcome_text(outcome: Outcome) -> Spoken:
    """Sentence of an outcome; of a request that was taken without one, that it is done."""
    if outcome.said:
        return spoken(outcome.said)
    return spoken(Text.of("opcua.done") if outcome.forwarded else Text.of("opcua.not_forwarded"))
