"""Notices of what strangers do wrong: protocol, kind, source and detail in one line."""

from __future__ import annotations

import logging

import pytest

from bridge.base.notices import teller


def test_a_notice_says_who_did_what(caplog: pytest.LogCaptureFixture) -> None:
    teller("modbus")("refused logins", "10.0.0.1", "user eve")
    (record,) = caplog.records
    assert record.getMessage() == "modbus: refused logins from 10.0.0.1: user eve"
    assert record.levelno == logging.WARNING
    assert (record.__dict__["line_source"], record.__dict__["line_kind"]) == (
        "10.0.0.1",
        ("modbus", "refused logins"),
    )


def test_without_a_detail_there_is_none_and_a_level_may_be_given(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO):
        teller("opcua")("refused logins", "10.0.0.1", level=logging.INFO)
    (record,) = caplog.records
    assert (record.getMessage(), record.levelno) == ("opcua: refused logins from 10.0.0.1", logging.INFO)


def test_what_others_say_is_cut(caplog: pytest.LogCaptureFixture) -> None:
    teller("zenoh")("odd keys", "a", "x" * 10_000)
    assert caplog.records[0].getMessage() == f"zenoh: odd keys from a: {'x' * 200}"
