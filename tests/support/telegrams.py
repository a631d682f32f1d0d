"""Telegrams by zenoh on a machine that may be slow."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

_LIMIT_S = 8.0
_AGAIN_S = 0.2


def answered(ask: Callable[[], Any]) -> Any:
    """The answer. What has waited on its way for too long is refused, as it has to be, and asked again."""
    end = time.monotonic() + _LIMIT_S
    while (answer := ask()).get("code") == "stale" and time.monotonic() < end:
        time.sleep(_AGAIN_S)
    return answer
