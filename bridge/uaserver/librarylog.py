"""asyncua's own log: what it says of clients costs a line for each place in its source, then counts, and no
traceback."""

from __future__ import annotations

import logging
from typing import Final

from bridge.base.quietlog import log_source

_LIBRARY: Final = "asyncua"
_TOLD_BY_US: Final = "Got malformed header"
"""With the client's address."""


def _shorten(record: logging.LogRecord) -> bool:
    """Filter of a logger that shortens its records."""
    if str(record.msg).startswith(_TOLD_BY_US):
        return False
    error = record.exc_info[1] if record.exc_info else None
    record.msg = f"{record.getMessage()}{f': {error!r}' if error else ''}"
    record.args, record.exc_info, record.exc_text = None, None, None
    record.__dict__.update(log_source(_LIBRARY))
    return True


def quieten() -> None:
    """Put a filter on each of asyncua's loggers. May be called again."""
    library = logging.getLogger(_LIBRARY)
    if library.level == logging.NOTSET:
        # It tells every request at INFO.
        library.setLevel(logging.WARNING)
    for name in tuple(logging.root.manager.loggerDict):
        logger = logging.getLogger(name)
        if name.partition(".")[0] == _LIBRARY and _shorten not in logger.filters:
            logger.addFilter(_shorten)
