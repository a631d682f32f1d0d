"""Faults and emergencies of a mapping file that do not go together."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.invented import SPIN
from tests.support.sample_family import told


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ('[[fault]]\nname = "9"\n', "fault[0].name: there is no fault '9'"),
        ('[faults.german]\n"9" = "neun"\n', "there is no fault '9'"),
        ('[faults.kinds]\n"9" = "trip"\n', "faults.advice has no 'trip' (it has none)"),
    ],
)
def test_what_does_not_go_together_is_named(tmp_path: Path, text: str, fault: str) -> None:
    whole = SPIN + "\n" + text
    assert any(fault in one for one in told(tmp_path, whole))


def test_what_is_said_in_one_language_is_said_in_the_other(tmp_path: Path) -> None:
    text = SPIN + '\n[[fault]]\nname = "1.0"\nen = { cause = "why" }\n'
    assert any("has no cause, which en has" in one for one in told(tmp_path, text))
