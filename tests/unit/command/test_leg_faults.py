"""The exploration finds what is wrong: a leg with a fault in its table or in its deeds fails the oracle."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final
from unittest.mock import patch

import pytest

from bridge.command.leg import deeds, due, order, owners, reports, start, step, word_table
from bridge.command.leg.draft import Draft
from bridge.command.leg.effect import Heard
from bridge.command.leg.event import BridgeGap, Connection, Event
from bridge.command.leg.state import RpdoWords, Stage
from bridge.command.leg.table import TABLE, Cell, Deed, Stimulus
from bridge.command.leg.word_table import WordChoice
from bridge.command.messages.request import Identity
from tests.support import leg_space
from tests.support.leg_profiles import CYCLIC, MOST, space
from tests.support.leg_words import POSITION
from tools.state_table import PAGE

_TELEGRAMS: Final = {
    "owner writes a stop",
    "owner enables",
    "owner resets the fault",
    "owner releases",
    "rival enables",
    "stranger stops the drive",
    "drive follows",
    "everything is due",
}
_TWINS: Final = {
    "owner writes a stop",
    "owner enables",
    "twin writes a stop",
    "twin enables",
    "owner's connection ends, not its twin",
    "drive follows",
    "everything is due",
}
_WAY: Final = _TELEGRAMS | {"node lost", "node operational", "bus back", "bridge gap"}
_EDGES: Final = _TELEGRAMS | {"owner acknowledges by an edge"}
_LATE: Final = _TELEGRAMS | {"owner's stop comes late", "owner's enable comes late"}
_STARTS: Final = {
    "owner starts the drive",
    "owner writes a stop",
    "drive follows",
    "drive says: fault",
    "drive repeats",
    "everything is due",
}
_POSITIONS: Final = {
    "owner writes a stop",
    "owner enables",
    "drive follows",
    "drive takes the setpoint",
    "stranger stops the drive",
}
_MOVED: Final = {
    "owner writes a stop",
    "owner enables",
    "drive follows",
    "drive is moved",
    "stranger stops the drive",
}
PROFILES: Final[dict[str, dict[str, Any]]] = {
    "telegrams": {"names": _TELEGRAMS},
    "quick_stop": {"names": _TELEGRAMS, "on_expiry": "quick_stop"},
    "silence": {"names": _TELEGRAMS, "on_expiry": "silence"},
    "stop, then silence": {"names": _TELEGRAMS, "on_expiry": "stop", "then_silence_ms": 300},
    "hold": {"names": _TELEGRAMS, "on_expiry": "hold"},
    "lease": {"names": _TELEGRAMS | {"owner takes control"}, "control": "lease"},
    "off": {"names": _TELEGRAMS, "fieldbus_timeout_ms": 0},
    "twins": {"names": _TWINS},
    "twins, off": {"names": _TWINS, "fieldbus_timeout_ms": 0},
    "twins' registers": {
        "names": _TWINS | {f"{who} resets the fault by a register" for who in ("owner", "twin")}
    },
    "way": {"names": _WAY},
    "hold, way": {"names": _WAY - {"rival enables", "bus back"}, "on_expiry": "hold"},
    "edges": {"names": _EDGES},
    "late": {"names": _LATE},
    "late, stop": {"names": _LATE, "on_expiry": "stop"},
    "starts": {"names": _STARTS},
    "positions": {"names": _POSITIONS, "words": POSITION},
    "moved": {"names": _MOVED, "words": CYCLIC},
    "states": {"names": _STARTS | {"drive says: fault reaction", "drive says: ready"}},
}
"""As few events as each fault needs to show."""

_S, _E, _D = Stage, Stimulus, Deed
CELLS: Final[dict[str, tuple[str, Stage, Stimulus, Cell]]] = {
    "an enabling word passes a trip": ("telegrams", _S.TRIPPED, _E.ENABLING_WORD, (_S.ENABLED, _D.FORWARD)),
    "and the interlock": ("telegrams", _S.INTERLOCKED, _E.ENABLING_WORD, (_S.ENABLED, _D.FORWARD)),
    "nothing is enabled": ("telegrams", _S.READY, _E.ENABLING_WORD, (_S.INTERLOCKED, _D.TAKE)),
    "the timer does nothing": ("telegrams", _S.ENABLED, _E.EXPIRED_STOP, (_S.ENABLED, _D.NOTHING)),
    "an acknowledge does nothing": ("telegrams", _S.TRIPPED, _E.ACKNOWLEDGE, (_S.TRIPPED, _D.CLEAR_STOP)),
    "it ends the interlock, too": ("telegrams", _S.TRIPPED, _E.ACKNOWLEDGE, (_S.READY, _D.CLEAR_STOP)),
    "a stop needs no stop word after it": ("telegrams", _S.ENABLED, _E.STOP, (_S.READY, _D.STOP_AS_ASKED)),
    "nor does a change of owners": ("telegrams", _S.ENABLED, _E.LEFT, (_S.READY, _D.STOP)),
    "nor a late stop": ("late", _S.ENABLED, _E.LATE_STOP, (_S.READY, _D.FORWARD)),
    "and is told as sent while tripped": ("late, stop", _S.TRIPPED, _E.LATE_STOP, (_S.TRIPPED, _D.FORWARD)),
    "nor a bus that was gone": ("way", _S.ENABLED, _E.ANEW, (_S.READY, _D.STOP)),
    "nor a node that was gone": ("way", _S.CLOSED, _E.WAY_OPEN, (_S.READY, _D.NOTHING)),
    "a lost node does nothing": ("way", _S.ENABLED, _E.WAY_CLOSED, (_S.ENABLED, _D.NOTHING)),
    "a stop does not break the silence": ("silence", _S.SILENCED, _E.STOP, (_S.SILENCED, _D.STOP_AS_ASKED)),
    "and one that does has no end": ("silence", _S.BURST, _E.BURST_OVER, (_S.BURST, _D.NOTHING)),
    "silence does not come": (
        "stop, then silence",
        _S.TRIPPED,
        _E.SILENCE_DUE,
        (_S.TRIPPED, _D.NOTHING),
    ),
    "what is held outlasts its node": ("hold, way", _S.HELD, _E.WAY_CLOSED, (_S.HELD, _D.NOTHING)),
    "and a stop word": ("hold", _S.HELD, _E.STOP_WORD, (_S.HELD, _D.TAKE)),
    "nothing is held": ("hold", _S.ENABLED, _E.EXPIRED_HOLD, (_S.LET_GO, _D.REACT)),
    "a start does not end": ("starts", _S.LEADING, _E.SAYS_ENABLED, (_S.LEADING, _D.NOTHING)),
    "a start outlasts a fault": ("starts", _S.LEADING, _E.SAYS_FAULT, (_S.LEADING, _D.NOTHING)),
    "and its time": ("starts", _S.LEADING, _E.START_OVERDUE, (_S.LEADING, _D.NOTHING)),
    "another deed than what is done": ("telegrams", _S.ENABLED, _E.STOP, (_S.INTERLOCKED, _D.FORWARD)),
    "a trip is shown as a wait": ("telegrams", _S.ENABLED, _E.EXPIRED_STOP, (_S.TRIPPED, _D.WAIT)),
    "a start that is done as one that failed": (
        "starts",
        _S.LEADING,
        _E.SAYS_ENABLED,
        (_S.ENABLED, _D.GIVE_UP),
    ),
    "a start outlasts a stop word": ("starts", _S.LEADING, _E.STOP_WORD, (_S.LEADING, _D.FORWARD)),
}


@pytest.mark.landing(7)
@pytest.mark.parametrize("profile", PROFILES)
def test_without_a_fault_nothing_is_found(profile: str) -> None:
    space(**PROFILES[profile]).explore(MOST)


@pytest.mark.parametrize("fault", CELLS)
def test_a_wrong_cell_is_found(fault: str) -> None:
    profile, stage, stimulus, cell = CELLS[fault]
    assert TABLE[stage, stimulus] != cell
    with pytest.raises(AssertionError, match="\nafter "):
        space(**PROFILES[profile]).explore(MOST, {**TABLE, (stage, stimulus): cell})


def _before(function: Callable[..., Any], first: Callable[..., Any]) -> Callable[..., Any]:
    def both(*given: Any, **more: Any) -> Any:
        first(*given)
        return function(*given, **more)

    return both


def _loses_its_lease(leg: Draft) -> None:
    leg.owner = leg.owner._replace(lease_until=None)


def _edge(leg: Draft, *_: Any) -> None:
    leg.edges = leg.edges._replace(bit=False)


def _presses(leg: Draft, identity: Identity, of: Callable[..., None] = owners._hand_over) -> None:
    """What one connection has pressed counts for the other, too."""
    of(leg, identity)
    if identity.is_same(leg.edges.pressed_by):
        leg.edges = leg.edges._replace(pressed_by=identity)


def _counts(leg: Draft, *_: Any) -> None:
    if leg.timer.deadline is not None:
        leg.timer = leg.timer._replace(deadline=leg.now + 2.0)
        leg.effects.append(Heard())


def _speaks(
    leg: Draft, may_hold: bool, of: Callable[[Draft, bool], RpdoWords] = word_table._silence
) -> RpdoWords:
    return RpdoWords(of(leg, may_hold).words)


def _moves(
    leg: Draft, may_hold: bool, of: Callable[[Draft, bool], RpdoWords] = word_table._reaction
) -> RpdoWords:
    word, *_ = of(leg, may_hold).words
    return RpdoWords((word, 1, *leg.rest[1:]))


def _weak(leg: Draft, may_hold: bool) -> int:
    return leg.settings.words.stop(leg.sent.words[0])


DEEDS: Final[dict[str, tuple[str, object, str, object]]] = {
    "a stranger's telegram counts": ("telegrams", owners, "refusal", lambda *_, **__: ""),
    "a refused telegram counts": (
        "telegrams",
        owners,
        "check_authority",
        _before(owners.check_authority, _counts),
    ),
    "the owner is refused": ("telegrams", owners, "refusal", lambda *_, **__: "no"),
    "a word lifts the interlock": ("telegrams", word_table, "at_rest", lambda words, word: words.run),
    "a quick stop is a ramp": ("quick_stop", word_table, "_reaction_word", _weak),
    "a quick stop has no end": ("quick_stop", deeds, "_RAMP_LIMIT_S", 20.0),
    "what is asked is told as sent": ("moved", step, "judged", lambda *given: given[-1]),
    "who asks again breaks the silence again": (
        "silence",
        step,
        "_has_been_sent",
        lambda leg, word: False,
    ),
    "a lease has no end": ("lease", step, "judge", _before(due.judge, _loses_its_lease)),
    "connections of one address are one owner": ("twins", Identity, "goes_on_as", Identity.is_same),
    "an owner's next connection is somebody else": (
        "twins",
        Identity,
        "goes_on_as",
        lambda identity, other: identity is other,
    ),
    "a half-open connection keeps its user out": (
        "twins, off",
        owners,
        "_is_quiet_beside",
        lambda leg, identity: False,
    ),
    "two connections press one register": ("twins' registers", owners, "_hand_over", _presses),
    "an owner is never gone": ("off", owners, "GONE_S", 20.0),
    "every acknowledge bit is an edge": ("edges", step, "_write", _before(step._write, _edge)),
    "a late telegram counts": ("late", step, "_is_stale", lambda leg, request: False),
    "the kernel goes on": ("telegrams", leg_space, "until", lambda settings, leg: None),
    "nobody wakes the leg": ("telegrams", leg_space, "next_deadline", lambda leg: None),
    "a start does not wait for a stop": ("starts", start, "_may_be_old", lambda *_, **__: False),
    "a start takes longer": ("starts", start, "_LIMIT_S", 5.0),
    "a fault is no reason": ("starts", start, "FAULTED", frozenset[Any]()),
    "a position is handed over twice": (
        "positions",
        order,
        "ordered",
        lambda order, words: order._replace(is_waiting=True),
    ),
    "a stop forgets no position": ("positions", order, "dropped", lambda order: order),
    "an axis jumps when it is enabled": ("moved", Draft, "keep_at_rest", lambda leg: None),
    "a fault reaction follows an enable": ("states", reports, "MAY_FOLLOW_LATE", frozenset[Any]()),
}


WORDS: Final[dict[str, tuple[str, WordChoice, Callable[[Draft, bool], RpdoWords]]]] = {
    "silence speaks": ("silence", WordChoice.SILENCE, _speaks),
    "a reaction keeps setpoints": ("telegrams", WordChoice.REACTION, _moves),
}
EVENTS: Final[dict[str, tuple[str, type[Event]]]] = {
    "a gap is not noticed": ("way", BridgeGap),
    "an owner's connection does not end": ("twins", Connection),
}


@pytest.mark.parametrize("fault", WORDS)
def test_wrong_words_are_found(fault: str) -> None:
    profile, word, wrong = WORDS[fault]
    with patch.dict(word_table._MADE, {word: wrong}), pytest.raises(AssertionError, match="\nafter "):
        space(**PROFILES[profile]).explore(MOST)


@pytest.mark.parametrize("fault", EVENTS)
def test_an_event_that_does_nothing_is_found(fault: str) -> None:
    profile, event = EVENTS[fault]
    with patch.dict(step._ON, {event: lambda *_: None}), pytest.raises(AssertionError, match="\nafter "):
        space(**PROFILES[profile]).explore(MOST)


@pytest.mark.landing(25)
@pytest.mark.parametrize("fault", DEEDS)
def test_a_wrong_deed_is_found(fault: str, monkeypatch: pytest.MonkeyPatch) -> None:
    profile, where, name, wrong = DEEDS[fault]
    monkeypatch.setattr(where, name, wrong)
    with pytest.raises(AssertionError, match="\nafter "):
        space(**PROFILES[profile]).explore(MOST)


def test_the_page_counts_the_faults() -> None:
    faults = len(CELLS) + len(DEEDS) + len(WORDS) + len(EVENTS)
    assert f"with {faults} faults," in PAGE.read_text(encoding="utf-8")
