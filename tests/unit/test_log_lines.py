"""Foreign text in the log: it is never taken for a line of the bridge's."""

from __future__ import annotations

import logging

from hypothesis import given
from hypothesis import strategies as st

from bridge.cli import logs

FORGED = "a drive\r\n00:00:00 ERROR   conveyor/fu1: forged\x1b[2J"


def lines_of(message: str) -> list[str]:
    """Lines of ``message`` with each of the formatters."""
    record = logging.LogRecord("bridge", logging.WARNING, __file__, 1, "put on %s", (message,), None)
    formatters = (logs._Formatter("%(asctime)s %(levelname)-7s %(message)s"), logs._JournalFormatter())
    return [line for one in formatters for line in one.format(record).split("\n")]


@given(st.text())
def test_a_message_is_one_line_whatever_a_client_calls_itself(text: str) -> None:
    lines = lines_of(text)
    assert len(lines) == 2
    assert all(line.isprintable() for line in lines)


def test_a_forged_line_can_be_seen_for_what_it_is() -> None:
    assert r"put on a drive\r\n00:00:00 ERROR   conveyor/fu1: forged\x1b[2J" in lines_of(FORGED)[0]


def test_a_traceback_has_its_lines() -> None:
    try:
        raise KeyError("x")
    except KeyError as error:
        record = logging.LogRecord("bridge", logging.ERROR, __file__, 1, "unexpected", (), None)
        record.exc_info = (KeyError, error, error.__traceback__)
    lines = logs._Formatter("%(message)s").format(record).split("\n")
    assert lines[0] == "unexpected"
    assert lines[1] == "Traceback (most recent call last):"
    assert lines[-1] == "KeyError: 'x'"


def test_the_journal_gets_a_priority_on_each_line() -> None:
    assert lines_of(FORGED)[1].startswith("<4>")
