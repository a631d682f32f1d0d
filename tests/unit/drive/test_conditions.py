"""Settings that decide what values mean: which are known, and why a value is not served."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.drive.conditions import Conditions, Lack
from bridge.image import Quality
from bridge.mapping import Family, read_family
from bridge.text import render
from tests.support.invented import SPIN

UNREAD = Lack(Quality.WAITING, "has not been read")
CONDITIONED = SPIN.replace(
    'name = "in_position"\ngroup = "actual"\nword = "status_word"\nbit = 10',
    'name = "in_position"\ngroup = "actual"\nword = "status_word"\nbit = 10\n'
    'when = { P7 = [3, 4] }\notherwise = "no position"',
)


@pytest.fixture(scope="module")
def family(tmp_path_factory: pytest.TempPathFactory) -> Family:
    assert CONDITIONED != SPIN
    path = tmp_path_factory.mktemp("spin") / "spin.toml"
    path.write_text(CONDITIONED)
    return read_family(path)


def lack(conditions: Conditions, family: Family, name: str = "in_position") -> Lack | None:
    (value,) = (one for one in family.value if one.name == name)
    return conditions.lack(value, 1, UNREAD)


def told(conditions: Conditions, family: Family) -> tuple[Quality, str] | None:
    """Result of ``lack``, in words."""
    found = lack(conditions, family)
    return found and (found.quality, render(found.why))


def test_a_setting_that_was_not_told_is_the_reason(family: Family) -> None:
    conditions = Conditions(family)
    assert told(conditions, family) == (Quality.WAITING, "P7 has not been read")
    assert not conditions.has_been_asked(("P7", 1))
    conditions.tell(("P7", 1), None)
    assert conditions.has_been_asked(("P7", 1))
    assert told(conditions, family) == (Quality.WAITING, "P7 has not been read")


@pytest.mark.parametrize("setting", [3.0, 4.0])
def test_with_one_of_its_settings_a_value_means_what_the_mapping_says(family: Family, setting: float) -> None:
    conditions = Conditions(family)
    conditions.tell(("P7", 1), setting)
    assert lack(conditions, family) is None
    assert conditions.told(("P7", 1)) == setting


def test_with_another_there_is_no_such_value(family: Family) -> None:
    conditions = Conditions(family)
    conditions.tell(("P7", 1), 5.0)
    assert told(conditions, family) == (Quality.DISABLED, "no position: P7 is 5")


def test_a_setting_is_in_the_makers_words_in_both_languages(tmp_path: Path) -> None:
    path = tmp_path / "spin.toml"
    states = 'states = { 5 = "free" }\ngerman_states = { 5 = "Frei" }\n'
    path.write_text(CONDITIONED.replace('name = "P7"\n', f'name = "P7"\n{states}'), encoding="utf-8")
    family = read_family(path)
    conditions = Conditions(family)
    conditions.tell(("P7", 1), 5.0)
    found = lack(conditions, family)
    assert found is not None
    assert [render(found.why, language) for language in ("en", "de")] == [
        "no position: P7 is 5 (free)",
        "no position: P7 ist 5 (Frei)",
    ]


def test_a_value_without_conditions_lacks_nothing(family: Family) -> None:
    assert lack(Conditions(family), family, "valve_a") is None


def test_where_there_is_no_drive_to_ask_all_means_what_the_mapping_says(family: Family) -> None:
    conditions = Conditions(family)
    conditions.take_defaults()
    assert conditions.told(("P7", 1)) == 3
    assert lack(conditions, family) is None


def test_what_all_sets_share_is_known_by_the_first(family: Family) -> None:
    assert Conditions(family).key("P7", 4) == ("P7", 1)
