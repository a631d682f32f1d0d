"""Errors about parameters: their sentence, their reason, and what the drive itself has said."""

from __future__ import annotations

import pytest

from bridge.parameter.error import ParameterError, TransferFailed, Why


def test_an_error_is_a_sentence_with_a_reason() -> None:
    error = ParameterError(Why.REFUSED, "P102: no", 0x0609_0030)
    assert (str(error), error.why, error.abort_code) == ("P102: no", Why.REFUSED, 0x0609_0030)
    assert ParameterError(Why.READ_ONLY, "x").abort_code == 0


def test_each_reason_has_words_of_its_own() -> None:
    assert len({why.value for why in Why}) == len(Why)


@pytest.mark.parametrize("by_drive", [True, False])
def test_a_transfer_that_failed_says_whether_the_drive_has_said_so(by_drive: bool) -> None:
    failure = TransferFailed("no", 0x0504_0000, by_drive=by_drive)
    assert (str(failure), failure.abort_code, failure.by_drive) == ("no", 0x0504_0000, by_drive)
