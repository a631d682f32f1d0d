"""asyncua's own log: what it says of clients costs one line a minute for each place in its source, and no
traceback."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Final

_PAUSE_S: Final = 60.0
_LIBRARY: Final = "asyncua"
_TOLD_BY_US: Final = "Got malformed header"
"""With the client's address."""


class Seldom(logging.Filter):
    """For a logger: lets each place in the source pass once a minute, with how often it was left out."""

    def __init__(self, clock: Callable[[], float]) -> None:
        super().__init__()
        self._clock = clock
        self._told: dict[tuple[str, int], tuple[float, int]] = {}

    def filter(self, record: logging.LogRecord) -> bool:
        if str(record.msg).startswith(_TOLD_BY_US):
            return False
        place = (record.pathname, record.lineno)
        told_at, left_out = self._told.get(place, (float("-inf"), 0))
        now = self._clock()
        if now - told_at < _PAUSE_S:
            self._told[place] = (told_at, left_out + 1)
            return False
        self._told[place] = (now, 0)
        error = record.exc_info[1] if record.exc_info else None
        more = f" ({left_out} more since)" if left_out else ""
        record.msg = f"{record.getMessage()}{f': {error!r}' if error else ''}{more}"
        record.args, record.exc_info, record.exc_text = None, None, None
        return True


def quieten(clock: Callable[[], float]) -> None:
    """Put a filter on each of asyncua's loggers. May be called again."""
    library = logging.getLogger(_LIBRARY)
    if library.level == logging.NOTSET:
        # It tells every request at INFO.
        library.setLevel(logging.WARNING)
    seldom = Seldom(clock)
    for name in tuple(logging.root.manager.loggerDict):
        logger = logging.getLogger(name)
        if name.partition(".")[0] == _LIBRARY and not any(isinstance(one, Seldom) for one in logger.filters):
            logger.addFilter(seldom)
