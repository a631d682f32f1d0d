"""Qualities of a point: their numbers on Modbus, and which of them have a value."""

from __future__ import annotations

from bridge.image.quality import Quality


def test_they_are_numbered_as_modbus_serves_them() -> None:
    """docs/reference: input register 11."""
    assert [(quality.value, quality.label) for quality in Quality] == [
        (0, "waiting"),
        (1, "good"),
        (2, "stale"),
        (3, "lost"),
        (4, "dead"),
        (5, "device_fault"),
        (6, "disabled"),
        (7, "config_error"),
    ]


def test_a_last_value_is_served_as_long_as_it_may_still_mean_something() -> None:
    with_value = {quality for quality in Quality if quality.has_value}
    assert with_value == {Quality.GOOD, Quality.STALE, Quality.LOST, Quality.DEVICE_FAULT}
