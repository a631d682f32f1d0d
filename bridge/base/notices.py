"""Log lines on errors of strangers on the network: one line for each kind and source, then counts."""

from __future__ import annotations

import logging
from typing import Final, Protocol

from bridge.base.quietlog import log_source

_LONGEST: Final = 200

_log = logging.getLogger(__name__)


class Teller(Protocol):
    """Has a line in the log."""

    def __call__(self, kind: str, source: str, detail: str = "", level: int = logging.WARNING) -> None:
        """``kind`` is a phrase such as "refused logins", ``detail`` what is known of this one."""
        ...


def teller(protocol: str) -> Teller:
    """Lines that begin with the protocol's name."""

    def tell(kind: str, source: str, detail: str = "", level: int = logging.WARNING) -> None:
        more = f": {detail[:_LONGEST]}" if detail else ""
        extra = log_source(source, (protocol, kind))
        _log.log(level, "%s: %s from %s%s", protocol, kind, source, more, extra=extra)

    return tell
