"""Failures of SDO transfers as texts: the same as ``canopen`` says in English."""

from __future__ import annotations

import pytest

from bridge.base.sdo_texts import text_of, text_of_abort
from bridge.canopen import abort
from bridge.canopen.sdo_transfer import SdoError
from bridge.text import render


@pytest.mark.parametrize("code", [*abort.TEXTS, 0x1234_5678])
def test_an_abort_code_has_its_text(code: int) -> None:
    assert render(text_of_abort(code)) == abort.text(code)
    assert render(text_of_abort(code), "de") != abort.text(code)


@pytest.mark.parametrize("by_server", [True, False])
@pytest.mark.parametrize("code", [abort.TIMED_OUT, abort.BUSY])
def test_a_failed_transfer_has_its_text(code: int, by_server: bool) -> None:
    error = SdoError(0x1018, 1, code, by_server=by_server)
    assert render(text_of(error)) == str(error)
