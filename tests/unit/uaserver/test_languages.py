"""Texts in several languages: which one a client is told."""

from __future__ import annotations

import pytest
from asyncua.common.utils import Buffer
from asyncua.ua.ua_binary import struct_from_binary, struct_to_binary, variant_from_binary, variant_to_binary

from bridge.uaserver.languages import Spoken, chosen, speaking
from bridge.uaserver.library import make, ua, variant

FAULT = Spoken({"en": "overcurrent", "de": "Überstrom"})
GERMAN = ua.LocalizedText("Überstrom", "de")
ENGLISH = ua.LocalizedText("overcurrent", "en")


@pytest.mark.parametrize(
    ("locales", "told"),
    [
        ([], "en"),
        (["de"], "de"),
        (["de-CH"], "de"),
        (["DE-at", "en"], "de"),
        (["fr", "de", "en"], "de"),
        (["fr-FR", "en-GB", "de"], "en"),
        (["fr"], "en"),
        (["", "-", "mul"], "en"),
    ],
)
def test_the_first_that_is_offered_is_chosen(locales: list[str], told: str) -> None:
    assert chosen(locales, ("en", "de")) == told


def test_a_text_is_encoded_in_the_language_of_who_is_answered() -> None:
    reference = make(ua.ReferenceDescription, DisplayName=FAULT)
    encoded = {}
    for locale in ("de", "en"):
        with speaking([locale]):
            encoded[locale] = struct_to_binary(reference)
    decoded = {
        locale: struct_from_binary(ua.ReferenceDescription, Buffer(one)).DisplayName
        for locale, one in encoded.items()
    }
    assert decoded == {"de": GERMAN, "en": ENGLISH}


@pytest.mark.parametrize("held", [FAULT, [FAULT, FAULT]])
def test_values_are_encoded_so_too(held: object) -> None:
    with speaking(["de"]):
        encoded = variant_to_binary(variant(held, ua.VariantType.LocalizedText))
    expected = [GERMAN, GERMAN] if isinstance(held, list) else GERMAN
    assert variant_from_binary(Buffer(encoded)).Value == expected


def test_texts_within_a_structure_are_encoded_so_too() -> None:
    argument = make(ua.Argument, Name="fault", Description=FAULT)
    with speaking(["de"]):
        encoded = variant_to_binary(variant([argument], ua.VariantType.ExtensionObject))
    (decoded,) = variant_from_binary(Buffer(encoded)).Value
    assert decoded.Description == GERMAN


def test_what_one_client_speaks_is_not_what_the_next_is_told() -> None:
    with speaking(["de"]):
        assert FAULT.Text == "Überstrom"
        with speaking(["en"]):
            assert (FAULT.Locale, FAULT.Text) == ("en", "overcurrent")
        assert FAULT.Locale == "de"
    assert FAULT.Text == "overcurrent"


def test_two_texts_are_the_same_in_whatever_language() -> None:
    with speaking(["de"]):
        assert Spoken(dict(FAULT.words)) == FAULT
        assert hash(Spoken(dict(FAULT.words))) == hash(FAULT)
        assert Spoken({"en": "overcurrent"}) != FAULT
