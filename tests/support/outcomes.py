"""Outcomes as people read them."""

from __future__ import annotations

from dataclasses import replace

from bridge.command.messages.request import Outcome


def in_english(outcome: Outcome | None) -> Outcome | None:
    """The same with its sentence in place of code and facts."""
    return None if outcome is None else replace(outcome, said=outcome.message)
