"""What clients may not do to a drive's own watch, and what is no longer known once they have written it."""

from __future__ import annotations

from bridge.image import Value
from bridge.mapping.own_places import place_of, settable
from bridge.node.parameters.own_watch import OwnWatch
from bridge.parameter import ParameterEntry
from bridge.text import render
from tests.support import sites
from tests.support.nodes import node_of

SK54X = "nord/sk-54xe-rj45"
"""P513 of each drive is over its own process data."""


class Case:
    def __init__(self, drive: str) -> None:
        slot = sites.family(SK54X).slot[0].name
        self.node = node_of(sites.drive(slot, "none", 0, drive), mapping=SK54X)
        (self.drive,) = self.node.drives
        self.watch = OwnWatch(self.node)
        entry = settable(sites.family(SK54X))
        assert entry is not None
        self.off = entry.off[0]
        self.entry: ParameterEntry = self.node.names.at(place_of(sites.family(SK54X), entry).ref)

    def why_kept(self, value: Value) -> str:
        return self.watch.why_kept(self.drive, self.entry, value)


def test_a_watch_by_which_silence_stops_a_drive_is_not_ended() -> None:
    case = Case('on_expiry = "silence"')
    definition = case.entry.definition
    assert definition is not None
    why = render(case.why_kept(case.off * definition.factor))
    assert why.startswith(f"{case.entry.name} would end the watch by which silence stops {case.drive.name}: ")
    assert "another on_expiry" in why


def test_another_time_is_no_end() -> None:
    assert Case('on_expiry = "silence"').why_kept(0.3) == ""


def test_of_a_drive_that_is_not_stopped_by_silence_it_may_be_ended() -> None:
    case = Case('on_expiry = "disable_voltage"')
    definition = case.entry.definition
    assert definition is not None
    assert case.why_kept(case.off * definition.factor) == ""


def test_a_value_that_does_not_fit_ends_nothing() -> None:
    assert Case('on_expiry = "silence"').why_kept("nonsense") == ""


def test_another_parameter_is_nobodys_watch() -> None:
    case = Case('on_expiry = "silence"')
    other = case.node.names.resolve("P102")
    assert case.watch.why_kept(case.drive, other, 0) == ""
