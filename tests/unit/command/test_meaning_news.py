"""News about the meaning of a drive's words: what is told, and what becomes of setpoints in force."""

from __future__ import annotations

import pytest

from bridge.command import EventQueue
from bridge.command.meaning_news import MeaningNews
from tests.support import sites

DRIVE = "conveyor/fu1"


class Case:
    """A NORD drive that has told nothing of itself yet."""

    def __init__(self) -> None:
        self.plant = sites.plant_of(sites.site(sites.bus(sites.node(sites.drive("fu1", "lease", 200, "")))))
        self.drive = self.plant.drives[DRIVE]
        self.events = EventQueue()
        self.news = MeaningNews(self.drive, self.events)

    def told(self) -> list[str]:
        return [event.message for event in self.events.take()]


@pytest.fixture
def case() -> Case:
    return Case()


def test_what_is_read_for_the_first_time_is_no_news(case: Case) -> None:
    case.news.on_parameter("P105", 50.0, 10.0)
    assert case.told() == []


def test_a_boot_up_says_what_its_parameters_say_one_by_one_and_compiles_once(
    case: Case, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = {("P105", 1): 50.0, ("P105", 2): 60.0, ("P112", 1): 401.0}
    other = Case()
    for (name, in_set), setting in settings.items():
        other.news.on_parameter(name, setting, 10.0, in_set)
    compiled: list[float] = []
    monkeypatch.setattr(case.drive, "compile", lambda compile=case.drive.compile: compiled.append(compile()))
    case.news.on_boot_up(settings, 10.0)
    assert len(compiled) == 1
    assert case.told() == other.told() == []
    assert list(case.plant.image) == list(other.plant.image)
    case.news.on_boot_up(settings, 11.0)
    assert len(compiled) == 1


def test_a_boot_up_that_finds_another_scale_than_before_tells_it(case: Case) -> None:
    case.news.on_boot_up({("P105", 1): 50.0}, 10.0)
    case.news.on_boot_up({("P105", 1): 60.0, ("P112", 1): 401.0}, 11.0)
    (message,) = case.told()
    assert message.startswith("P105 of parameter set 1 is 60, it was 50: ")


def test_a_scale_that_has_changed_is_told_with_both_and_with_what_it_is_for(case: Case) -> None:
    case.news.on_parameter("P105", 50.0, 10.0)
    case.news.on_parameter("P105", 50.0, 11.0)
    assert case.told() == []
    case.news.on_parameter("P105", 60.0, 12.0)
    (message,) = case.told()
    assert message.startswith("P105 of parameter set 1 is 60, it was 50: ")
    assert "has another scale" in message


def test_one_that_cannot_be_read_any_more_is_told(case: Case) -> None:
    case.news.on_parameter("P105", 50.0, 10.0)
    case.news.on_parameter("P105", None, 11.0)
    (message,) = case.told()
    assert message.startswith("P105 of parameter set 1 cannot be read, it was 50")


def test_a_scale_that_is_none_is_told_as_that(case: Case) -> None:
    case.news.on_parameter("P105", 50.0, 10.0)
    case.news.on_parameter("P105", 0.0, 11.0)
    (message,) = case.told()
    assert "P105 is 0 in the drive, which is no scale" in message


def test_what_a_word_carries_is_told_when_it_changes(case: Case) -> None:
    (meaning, *_) = case.drive.family.meaning
    case.news.on_code(meaning, 1, 10.0)
    case.told()
    case.news.on_code(meaning, 1, 11.0)
    assert case.told() == []
    case.news.on_code(meaning, 0, 12.0)
    (message,) = case.told()
    assert message.startswith("P546[1] of parameter set 1 is 0, it was 1: ")
