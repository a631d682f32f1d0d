"""Patterns by which a site file chooses points by their names."""

from __future__ import annotations

import re
from fnmatch import fnmatchcase
from typing import Final

HISTORY_POINTS: Final = (
    "*/*/status/state",
    "*/*/status/status_word",
    "*/*/actual/frequency",
    "*/*/actual/velocity",
    "*/*/actual/current",
    "*/*/supervision/watchdog_state",
    "*/*/supervision/current_fault",
    "*/*/supervision/last_fault",
)
"""Points of a drive that are kept where the site file names none."""

_PATTERN: Final = re.compile(r"[a-z0-9_*?]+(/[a-z0-9_*?]+)+")


def is_pattern(text: str) -> bool:
    """Whether ``text`` can be the name of a point with ``*`` and ``?`` in it."""
    return _PATTERN.fullmatch(text) is not None


def fits(name: str, pattern: str) -> bool:
    """Whether a point of this name is meant. ``*`` and ``?`` stand for what is between two slashes."""
    words, wanted = name.split("/"), pattern.split("/")
    return len(words) == len(wanted) and all(map(fnmatchcase, words, wanted))
