"""What strangers on the network do wrong, in the log: one line for each kind and source, then counts."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Final

from bridge.quietlog import about

_LONGEST: Final = 200

Tell = Callable[[str, str, str], None]
"""Given a kind, a source and a detail: ``tell``."""

_log = logging.getLogger(__name__)


def tell(kind: str, source: str, detail: str = "", level: int = logging.WARNING) -> None:
    """``kind`` is a phrase such as "refused logins", ``detail`` what is known of this one."""
    more = f": {detail[:_LONGEST]}" if detail else ""
    _log.log(level, "OPC UA: %s from %s%s", kind, source, more, extra=about(source, kind))
