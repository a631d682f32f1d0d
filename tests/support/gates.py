"""Gates through which parameters are written in tests."""

from __future__ import annotations

from typing import Final

from bridge.parameter.protection import Gate

ENGINEER_AT_REST: Final = Gate(is_engineer=True, is_moving=lambda: False)
"""Lets in whatever anybody may ever write."""
