"""Messages of a tab, and their effects."""

from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.command import Action, Code, Outcome, Reply, Request, Role, Source
from bridge.command.messages.request import DONE
from bridge.northbound.page.viewer import MOST_BYTES, MOST_FOLLOWED, BadMessage, Viewer
from tests.support import sites

DRIVE = "conveyor/fu1"
_SITE = sites.site(sites.bus(sites.node(sites.drive("fu1", "lease", 1000))))


class Seen:
    """A view that answers what it is told to, and keeps what was asked."""

    def __init__(self, outcome: Outcome = DONE) -> None:
        self.plant = sites.plant_of(_SITE)
        self.image = self.plant.image
        self.requests: list[Request] = []
        self.told: list[dict[str, Any]] = []
        self.outcome = outcome

    def submit(self, request: Request, reply: Reply) -> None:
        self.requests.append(request)
        reply(self.outcome)

    def viewer(self, role: Role = Role.OPERATOR) -> Viewer:
        return Viewer(self, "ann", role, "127.0.0.1", lambda data: self.told.append(json.loads(data)))  # type: ignore[arg-type]


def say(viewer: Viewer, message: Any, now: float = 0.0) -> None:
    viewer.on_message(json.dumps(message).encode(), now, {"plant", f"drive {DRIVE}", "bus can0"}.__contains__)


def ask(viewer: Viewer, action: str, target: str = DRIVE, **fields: Any) -> None:
    say(viewer, {"ask": 7, "target": target, "action": action, "fields": fields})


def test_two_tabs_of_one_person_are_two_controllers() -> None:
    seen = Seen()
    one, other = seen.viewer(), seen.viewer()
    assert not one.identity.is_same(other.identity)
    assert one.identity.source is Source.LOCAL


def test_a_request_has_one_outcome_with_its_number() -> None:
    seen = Seen(Outcome(Code.NOT_ALLOWED, "not you", forwarded=False))
    viewer = seen.viewer()
    ask(viewer, "start", direction=-1)
    (request,) = seen.requests
    assert (request.identity, request.target, request.action) == (viewer.identity, DRIVE, Action.START)
    (told,) = seen.told
    assert (told["outcome"], told["ok"], told["code"]) == (7, False, "not_allowed")
    assert (told["message"], told["forwarded"]) == ("not you", False)


@pytest.mark.parametrize("action", list(Action))
def test_every_action_is_asked_as_it_is(action: Action) -> None:
    fields: dict[Action, dict[str, Any]] = {
        Action.WRITE: {"values": {"frequency": 12.5}},
        Action.TAKE_CONTROL: {"ttl_ms": 1000},
        Action.SET_TIMEOUT: {"timeout_ms": 500},
        Action.READ_PARAMETER: {"parameter": "P105"},
        Action.WRITE_PARAMETER: {"parameter": "P105", "value": 50},
    }
    seen = Seen()
    ask(seen.viewer(), str(action), **fields.get(action, {}))
    assert [request.action for request in seen.requests] == [action]


@pytest.mark.parametrize(
    ("action", "fields"),
    [
        ("dance", {}),
        ("stop", {"direction": 1}),
        ("start", {"direction": "left"}),
        ("take_control", {"ttl_ms": None}),
        ("set_timeout", {}),
        ("write", {"values": [1]}),
        ("read_parameter", {"parameter": "P105", "raw": True}),
        ("write_parameter", {"parameter": "P105", "value": 1, "raw": True}),
    ],
)
def test_what_is_no_request_is_refused_and_not_passed_on(action: str, fields: dict[str, Any]) -> None:
    seen = Seen()
    ask(seen.viewer(), action, **fields)
    assert not seen.requests
    assert [one["ok"] for one in seen.told] == [False]
    assert seen.told[0]["message"]


_JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=8,
)
_KEYS = st.sampled_from(["show", "trend", "ask", "hidden", "target", "action", "fields"])


@given(st.binary(max_size=200) | st.dictionaries(_KEYS, _JSON).map(lambda one: json.dumps(one).encode()))
def test_nothing_but_a_bad_message_comes_of_what_a_tab_may_send(data: bytes) -> None:
    viewer = Seen().viewer()
    try:
        viewer.on_message(data, 0.0, "plant".__eq__)
    except BadMessage as error:
        assert str(error)


def test_a_tab_shows_what_there_is() -> None:
    viewer = Seen().viewer()
    say(viewer, {"show": ["plant", "plant"]})
    assert viewer.topics == ("plant",)
    with pytest.raises(BadMessage, match="no topic 'cellar'"):
        say(viewer, {"show": ["cellar"]})
    name = f"{DRIVE}/actual/value_1"
    say(viewer, {"trend": [name]})
    assert (viewer.followed, viewer.choice) == ((Seen().image.index[name],), 0)
    say(viewer, {"trend": [name], "number": 7})
    assert viewer.choice == 7
    for number in (-1, 2**60, 1.5, "7"):
        with pytest.raises(BadMessage):
            say(viewer, {"trend": [name], "number": number})
    for names in (["cellar"], [name] * (MOST_FOLLOWED + 1)):
        with pytest.raises(BadMessage, match="there is no point"):
            say(viewer, {"trend": names})


def test_a_wish_has_no_more_kinds_and_nodes_than_there_are() -> None:
    viewer = Seen().viewer()
    say(viewer, {"hear": {"bus": "can0", "kinds": ["pdo", "pdo"], "nodes": list(range(1, 128))}})
    assert viewer.traffic is not None
    assert (viewer.traffic.kinds, len(viewer.traffic.nodes)) == ({"pdo"}, 127)
    for wish in ({"kinds": [str(n) for n in range(17)]}, {"nodes": list(range(129))}):
        with pytest.raises(BadMessage):
            say(viewer, {"hear": {"bus": "can0", **wish}})


def test_long_and_frequent_messages_end_the_connection() -> None:
    viewer = Seen().viewer()
    with pytest.raises(BadMessage, match="at most"):
        viewer.on_message(b" " * (MOST_BYTES + 1), 0.0, bool)
    for number in range(1000):
        say(viewer, {"show": []}, now=number * 0.1)
    with pytest.raises(BadMessage, match="too many"):
        for _ in range(1000):
            say(viewer, {"show": []}, now=100.0)


@pytest.mark.parametrize("by", ["hidden", "closed"])
def test_what_a_tab_leaves_behind_is_given_back_once(by: str) -> None:
    seen = Seen()
    viewer = seen.viewer()
    ask(viewer, "take_control", ttl_ms=1000)
    ask(viewer, "take_control", "conveyor/fu2", ttl_ms=1000)
    ask(viewer, "release_control", "conveyor/fu2")
    seen.requests.clear()
    for _ in range(2):
        say(viewer, {"hidden": True}) if by == "hidden" else viewer.leave()
    assert [(one.action, one.target) for one in seen.requests] == [(Action.RELEASE_CONTROL, DRIVE)]


def test_what_was_refused_is_not_given_back() -> None:
    seen = Seen(Outcome(Code.NOT_ALLOWED, "not you"))
    viewer = seen.viewer()
    ask(viewer, "take_control", ttl_ms=1000)
    seen.requests.clear()
    viewer.leave()
    assert not seen.requests


def test_what_is_taken_after_the_tab_has_gone_is_given_back() -> None:
    seen = Seen()
    waiting: list[Reply] = []
    seen.submit = lambda request, reply: (seen.requests.append(request), waiting.append(reply))[0]
    viewer = seen.viewer()
    ask(viewer, "take_control", ttl_ms=1000)
    viewer.leave()
    assert [one.action for one in seen.requests] == [Action.TAKE_CONTROL]
    waiting[0](DONE)
    assert [one.action for one in seen.requests] == [Action.TAKE_CONTROL, Action.RELEASE_CONTROL]


def test_an_observer_is_refused_by_the_plant_itself() -> None:
    seen = Seen()
    viewer = seen.viewer(Role.OBSERVER)
    ask(viewer, "take_control", ttl_ms=1000)
    ask(viewer, "stop")
    ask(viewer, "write", values={"setpoint_1": 1})
    outcomes: list[Outcome] = []
    for request in seen.requests:
        seen.plant.submit(request, 0.0, outcomes.append)
    assert [one.code for one in outcomes] == [Code.NOT_ALLOWED] * 3


def test_a_tab_hears_one_bus_at_a_time_until_it_has_heard_enough() -> None:
    viewer = Seen().viewer()
    assert viewer.traffic is None
    say(viewer, {"hear": {"bus": "can0", "view": "identifiers", "kinds": ["pdo"], "nodes": [5]}})
    assert viewer.traffic is not None
    assert (viewer.traffic.bus, viewer.traffic.view, viewer.traffic.kinds) == ("can0", "identifiers", {"pdo"})
    say(viewer, {"hear": None})
    assert viewer.traffic is None
    for wrong in ({"bus": "can9"}, {"bus": "can0", "colour": 1}, {}, 1, {"bus": 1}):
        with pytest.raises(BadMessage):
            say(viewer, {"hear": wrong})
