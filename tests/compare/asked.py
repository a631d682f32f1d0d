"""One request of a case, the same for every server, and what a server has given that later ones refer to."""

from __future__ import annotations

import secrets
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, is_dataclass, replace
from datetime import UTC, datetime
from enum import Enum
from typing import Any, Final

from asyncua import ua

NO_SESSION: Final = ua.NodeId()
UNKNOWN: Final = 987_654_321
"""An id that no server gives."""
NO_TIME: Final = datetime(1601, 1, 1, tzinfo=UTC)
"""A DateTime of 0, which is one that is not given (Part 6 §5.2.2.5)."""


@dataclass(frozen=True, slots=True)
class Made:
    """What an earlier request of the case has made: ``place`` counts from the first and begins anew behind
    the last. Where there is none it is ``UNKNOWN``."""

    kind: str
    place: int


@dataclass(frozen=True, slots=True)
class Fresh:
    """A client handle that the case has not used yet."""


@dataclass(frozen=True, slots=True)
class HandleOf:
    """The client handle that an item was made with: what it tells is compared by it."""

    item: Made


@dataclass(frozen=True, slots=True)
class Nonce:
    """32 random bytes."""


@dataclass(frozen=True, slots=True)
class Anonymous:
    """An anonymous identity token, with the name that the server has for its policy."""


@dataclass(frozen=True, slots=True)
class Ask:
    """A request by its service and those of its parameters that are not as their type has them. ``makes`` is
    the kind of what it makes, ``session`` the one it is for, without one the case's own, ``channel`` which of
    the client's connections."""

    service: str
    asked: Mapping[str, Any] = field(default_factory=dict[str, Any])
    makes: str = ""
    session: Any = None
    channel: int = 0

    def __repr__(self) -> str:
        whose = "" if self.session is None and not self.channel else f" [{self.channel}: {self.session}]"
        return (
            f"{self.service}({', '.join(f'{name}={told(one)}' for name, one in self.asked.items())}){whose}"
        )


class Memory:
    """What one server has given in this case."""

    def __init__(self) -> None:
        self.made: dict[str, list[Any]] = {}
        self.handles = 0
        self.handles_of: dict[int, int] = {}
        self.policy: str | None = None

    def find(self, wanted: Made) -> Any:
        made = self.made.get(wanted.kind)
        if made:
            return made[wanted.place % len(made)]
        return {
            "point": b"unknown",
            "history point": b"unknown",
            "event": b"unknown",
            "session": ua.NodeId(UNKNOWN, 0),
        }.get(wanted.kind, UNKNOWN)

    def filled(self, asked: Any) -> Any:
        """A copy of ``asked`` with this server's ids in it."""
        if isinstance(asked, Made):
            return self.find(asked)
        if isinstance(asked, Fresh):
            self.handles += 1
            return self.handles
        if isinstance(asked, HandleOf):
            return self.handles_of.get(self.find(asked.item), 0)
        if isinstance(asked, Nonce):
            return secrets.token_bytes(32)
        if isinstance(asked, Anonymous):
            return ua.AnonymousIdentityToken(PolicyId=self.policy)
        if isinstance(asked, list):
            return [self.filled(one) for one in asked]
        if is_dataclass(asked) and not isinstance(asked, type) and not isinstance(asked, ua.NodeId):
            found = {one.name: getattr(asked, one.name) for one in fields(asked) if one.init}
            filled = {name: self.filled(one) for name, one in found.items()}
            changed = {name: one for name, one in filled.items() if one is not found[name]}
            return replace(asked, **changed) if changed else asked
        return asked

    def request(self, step: Ask) -> Any:
        request = getattr(ua, f"{step.service}Request")()
        fields_of = getattr(request, "Parameters", request)
        for name, asked in step.asked.items():
            setattr(fields_of, name, self.filled(asked))
        return request


def told(asked: Any) -> str:
    """As a person reads it: without what is as it is by default."""
    if isinstance(asked, ua.NodeId):
        return asked.to_string()
    if isinstance(asked, Enum):
        return asked.name
    if isinstance(asked, list):
        return f"[{', '.join(map(told, asked))}]"
    if isinstance(asked, Made):
        return f"{asked.kind} {asked.place}"
    if isinstance(asked, ua.Variant):
        return f"{asked.VariantType.name} {asked.Value!r}"
    if not is_dataclass(asked) or isinstance(asked, type | Fresh | HandleOf | Nonce | Anonymous):
        return repr(asked)
    default = type(asked)()
    named = [
        f"{one.name}={told(getattr(asked, one.name))}"
        for one in fields(asked)
        if one.init and getattr(asked, one.name) != getattr(default, one.name)
    ]
    return f"{type(asked).__name__}({', '.join(named)})"
