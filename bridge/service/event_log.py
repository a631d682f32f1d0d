"""Events in the log."""

from __future__ import annotations

import logging

from bridge.base.quietlog import A_FEW, log_source
from bridge.command import Event
from bridge.command.messages.event import REPEATING

_log = logging.getLogger("bridge.events")


def log_event(event: Event) -> None:
    """Listener that logs the plant's events, limited by source, kind and severity: a trip and its
    acknowledgement are of one kind and must not hide each other."""
    kind = event.kind, event.severity
    extra = log_source(event.source, kind, first=1 if event.kind in REPEATING else A_FEW)
    _log.log(_level(event.severity), "%s: %s", event.source, event.text, extra=extra)


def _level(severity: int) -> int:
    """Level of the log for a severity of OPC UA's, 1 … 1000."""
    if severity >= 700:
        return logging.ERROR
    return logging.WARNING if severity >= 300 else logging.INFO
