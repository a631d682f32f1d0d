"""Sentences about stops that are ignored: of outputs, whether they ever had their safe values."""

from __future__ import annotations

import pytest

from bridge.command.stop_check.ignored_texts import ignored_by_outputs
from bridge.command.stop_check.output_check import OutputStopCheck
from bridge.command.stop_check.state import LastStop, StopVerdict
from bridge.text import render


@pytest.mark.parametrize(
    ("before", "begins"),
    [
        (LastStop.FORWARDED, "ignores its stop: safe values are sent since 1.50 s"),
        (LastStop.FOLLOWED, "has other outputs than it is sent: safe values are sent for 1.50 s"),
    ],
)
def test_outputs_that_were_safe_before_do_not_ignore_their_stop(before: LastStop, begins: str) -> None:
    """Somebody else has set them since."""
    verdict = StopVerdict(LastStop.IGNORED, before, 10.0, 11.5)
    assert render(ignored_by_outputs(OutputStopCheck(), verdict, 1.5)).startswith(begins)
