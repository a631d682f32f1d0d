"""Faults of drives in German: for those who are told of them by their numbers."""

from __future__ import annotations

from collections.abc import Mapping

from bridge.drive import FaultWords
from bridge.drive.fault_words import listed_faults
from bridge.mapping import Family
from bridge.text import render

FamilyFaults = Mapping[str, Mapping[str, str]]
"""Text, cause and remedy of a family's faults, by their numbers in the maker's form."""


def german_faults(families: Mapping[str, Family]) -> dict[str, FamilyFaults]:
    """Faults in German by the families' names; the points have the English ones."""
    return {name: _in_german(family) for name, family in families.items()}


def _in_german(family: Family) -> FamilyFaults:
    words = FaultWords(family, "de")
    listed = [words.listed(name) for name in listed_faults(family)]
    return {
        one.number: {"text": render(one.text), "cause": one.cause, "remedy": one.remedy} for one in listed
    }
