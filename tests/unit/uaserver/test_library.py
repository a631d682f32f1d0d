"""asyncua with types: what the helpers make of its structures."""

from __future__ import annotations

import pytest
from asyncua import ua

from bridge.uaserver.library import (
    GOOD,
    change,
    data_value,
    first_certificate,
    get,
    make,
    node_id,
    text,
    variant,
)


def test_a_structure_is_made_and_changed_by_its_fields() -> None:
    made = make(ua.ReadValueId, NodeId=node_id("x", 2), AttributeId=13)
    assert (made.NodeId, made.AttributeId) == (ua.NodeId("x", 2), 13)
    assert change(made, AttributeId=1) is made
    assert get(made, "AttributeId") == 1


def test_a_text_is_english_and_nothing_is_nothing() -> None:
    assert text("hello") == ua.LocalizedText("hello", "en")
    assert text("") == ua.LocalizedText()


def test_values_are_asyncuas() -> None:
    made = data_value(variant(7, ua.VariantType.Byte), GOOD)
    assert (made.Value.Value, made.StatusCode.is_good()) == (7, True)


def test_no_certificate_is_none_and_noise_is_refused() -> None:
    assert first_certificate(None) is None
    with pytest.raises((ValueError, IndexError)):
        first_certificate(b"noise")
