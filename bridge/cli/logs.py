"""Set-up of the log: to standard error, with systemd's priorities where systemd reads it."""

from __future__ import annotations

import asyncio
import logging
import os
from typing import Any, Final

from bridge.base.errors import is_exhausted
from bridge.base.quietlog import QuietHandler, log_source
from bridge.cli.terminal import printable, printable_lines

_log = logging.getLogger(__name__)

_COUNTS_EVERY_S: Final = 1.0
_PRIORITY: Final = {
    logging.DEBUG: 7,
    logging.INFO: 6,
    logging.WARNING: 4,
    logging.ERROR: 3,
    logging.CRITICAL: 2,
}


class _Formatter(logging.Formatter):
    """Names that devices and clients give themselves are logged, and must not start lines of their own."""

    def formatMessage(self, record: logging.LogRecord) -> str:
        return printable(super().formatMessage(record))

    def formatException(self, ei: Any) -> str:
        """Nothing where a descriptor or memory was lacking: any line of the code may be the one to meet
        it."""
        return "" if is_exhausted(ei[1]) else super().formatException(ei)

    def format(self, record: logging.LogRecord) -> str:
        return printable_lines(super().format(record))


class _JournalFormatter(_Formatter):
    """``<priority>`` before each line, as sd-daemon(3) has it; the journal adds time and process."""

    def format(self, record: logging.LogRecord) -> str:
        priority = _PRIORITY.get(record.levelno, 6)
        return "\n".join(f"<{priority}>{line}" for line in super().format(record).split("\n"))


def set_up(*, verbose: bool) -> None:
    """Configure logging for the process."""
    handler = QuietHandler()
    if "JOURNAL_STREAM" in os.environ:
        handler.setFormatter(_JournalFormatter("%(name)s: %(message)s"))
    else:
        handler.setFormatter(_Formatter("%(asctime)s %(levelname)-7s %(message)s", "%H:%M:%S"))
    root = logging.getLogger()
    root.handlers[:] = [handler]
    root.setLevel(logging.DEBUG if verbose else logging.INFO)
    # What libraries log below this is for their own users.
    for name in ("asyncua", "asyncio", "pymodbus", "can"):
        logging.getLogger(name).setLevel(logging.ERROR)


def write_counts(loop: asyncio.AbstractEventLoop) -> None:
    """Log now and then, while ``loop`` runs, how many lines were left out."""
    for handler in logging.getLogger().handlers:
        if isinstance(handler, QuietHandler):
            handler.sum_up()
    loop.call_later(_COUNTS_EVERY_S, write_counts, loop)


def log_fault(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
    """An event loop's exception handler, for what nobody awaited or caught. The first from each place is
    logged with its traceback; that there is no descriptor left is one trouble, wherever it is met."""
    error: BaseException | None = context.get("exception")
    if error is not None and is_exhausted(error):
        _log.error("%s: %s", context.get("message"), error, extra=log_source("event loop", "exhausted"))
        return
    place = _place(error) or str(context.get("message"))
    message = f"unexpected: {context.get('message')}: {error!r}" if error else str(context.get("message"))
    _log.error("%s", message, exc_info=error, extra=log_source("event loop", place))


def _place(error: BaseException | None) -> tuple[str, int] | None:
    """File and line that raised it."""
    trace = error.__traceback__ if error else None
    if trace is None:
        return None
    while trace.tb_next:
        trace = trace.tb_next
    return trace.tb_frame.f_code.co_filename, trace.tb_lineno
