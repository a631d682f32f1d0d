"""Questions to nodes about their own supervision, side by side: judgements by drive, failures by node."""

from __future__ import annotations

from bridge.bustools.own_check import OwnCheck, ask
from bridge.canopen.frame import Frame
from bridge.drive import OwnVerdict
from bridge.mapping.own_places import places
from tests.support import sites
from tests.support.answering import Answering
from tests.support.nodes import node_of


def held(value: int) -> dict[tuple[int, int], bytes]:
    """Every object of the own supervision holds this."""
    return {
        place.key: value.to_bytes(place.number.size, "little")
        for place in places(sites.family(sites.FAMILY), link=True)
    }


def test_every_drive_is_judged_by_what_its_node_holds() -> None:
    node = node_of(sites.drive("fu1", "none", 0, ""), sites.drive("fu2", "none", 0, ""))
    asked = Answering(held(0))
    found = asked.run(ask(node.spec))
    assert set(found) == {"conveyor/fu1", "conveyor/fu2"}
    assert all(one.verdict is OwnVerdict.RUNS_ON for one in found.values())
    assert asked.writes == []


def test_what_cannot_be_read_is_not_known() -> None:
    (own,) = Answering().run(ask(node_of().spec)).values()
    assert own.verdict is OwnVerdict.UNKNOWN


def test_why_the_site_accepts_it_is_kept() -> None:
    node = node_of(sites.drive("fu1", "none", 0, sites.ACCEPTED))
    (own,) = Answering(held(0)).run(ask(node.spec)).values()
    assert own.accepted == "nothing moves in a test"


def test_a_node_that_does_not_answer_is_named_and_the_task_ends() -> None:
    check = OwnCheck([node_of().spec], 10.0)
    sent: list[Frame] = []
    while (due := check.next_deadline()) is not None and not check.is_finished(due):
        sent += check.take_frames()
        check.on_time(due)
    assert check.is_finished(99.0)
    assert {frame.can_id for frame in sent} == {0x605}
    assert list(check.failed) == ["conveyor"]
    assert check.found == {}
