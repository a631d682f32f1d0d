"""Steps of the Session service set: which session a request is for, and on which connection it comes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from asyncua import ua

from tests.compare.asked import NO_SESSION, UNKNOWN, Anonymous, Ask, Made
from tests.compare.play import EndOfCaseError, Play, anonymous_policy, session_terms

_STATE = ua.NodeId(ua.ObjectIds.Server_ServerStatus_State)
_USUAL_MS = 60_000.0
Place = int | str


def _session(place: Place) -> Any:
    if place == "no":
        return NO_SESSION
    return ua.NodeId(UNKNOWN, 0) if place == "unknown" else Made("session", int(place))


def _ask(play: Play, step: Ask) -> None:
    """Ends the case at a difference: from there on the sessions are not in the same state."""
    before = len(play.seen)
    play.ask(step)
    if len(play.seen) > before:
        raise EndOfCaseError


@dataclass(frozen=True, slots=True)
class Create:
    """With an odd time-out it ends at once on some servers, so nothing is asked of it."""

    channel: int
    timeout_ms: float = _USUAL_MS
    service: str = "CreateSession"

    def play(self, play: Play) -> None:
        asked = session_terms() | {"RequestedSessionTimeout": self.timeout_ms}
        kind = "odd session" if self.timeout_ms != _USUAL_MS else "session"
        step = Ask("CreateSession", asked, makes=kind, session=NO_SESSION, channel=self.channel)
        for party, answer in zip(play.parties, play.ask(step), strict=True):
            if not isinstance(answer, ua.ServiceFault):
                party.policy = anonymous_policy(answer)


@dataclass(frozen=True, slots=True)
class Activate:
    """``token`` is anonymous, or one that the endpoint does not have."""

    place: Place
    channel: int
    token: str
    service: str = "ActivateSession"

    def play(self, play: Play) -> None:
        tokens: dict[str, Any] = {
            "none": None,
            "another policy": ua.AnonymousIdentityToken(PolicyId="nothing"),
            "a name": ua.UserNameIdentityToken(PolicyId="nothing", UserName="nobody", Password=b"x"),
        }
        token = tokens.get(self.token, Anonymous())
        asked = {"UserIdentityToken": token}
        _ask(play, Ask("ActivateSession", asked, session=_session(self.place), channel=self.channel))


@dataclass(frozen=True, slots=True)
class Use:
    place: Place
    channel: int
    service: str = "Read"

    def play(self, play: Play) -> None:
        asked = {"NodesToRead": [ua.ReadValueId(_STATE, ua.AttributeIds.Value)]}
        _ask(play, Ask("Read", asked, session=_session(self.place), channel=self.channel))


@dataclass(frozen=True, slots=True)
class Close:
    place: Place
    channel: int
    service: str = "CloseSession"

    def play(self, play: Play) -> None:
        asked = {"DeleteSubscriptions": True}
        _ask(play, Ask("CloseSession", asked, session=_session(self.place), channel=self.channel))
