"""The table of typed numbers to which both readers are held, Python's and the page's."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Final

CASES: Final[list[dict[str, Any]]] = json.loads(
    Path("tests/support/number_cases.json").read_text(encoding="utf-8")
)
"""``text`` with what it is in each language: a number, or why it is none. ``other_notation_in`` names the
language in which it is written as the other one writes it; ``readings`` are those of an ambiguous text."""
