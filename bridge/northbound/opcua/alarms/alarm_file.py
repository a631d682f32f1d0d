"""File of what people and time have made of the alarms: it outlives a restart of front and service."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from pathlib import Path
from threading import Lock
from typing import Final

import msgspec

from bridge.trust.files import write_whole
from bridge.uaserver.conditions.calls import LONGEST_COMMENT
from bridge.uaserver.conditions.condition import (
    MAX_TIME_SHELVED_MS,
    MOST_EVENT_IDS,
    NORMAL,
    Comment,
    ConditionState,
    Shelving,
)

FILE: Final = "alarms.json"
_MOST_BYTES: Final = 64 * 1024 * 1024
_LONGEST: Final = 1_000

_log = logging.getLogger(__name__)


class KeptAlarm(msgspec.Struct, frozen=True, omit_defaults=True):
    """State of one alarm."""

    enabled: bool = True
    active: bool = False
    acked: bool = True
    confirmed: bool = True
    shelving: Shelving = Shelving.UNSHELVED
    unshelve_at_ms: float = 0.0
    severity: int = 1
    last_severity: int = 1
    comment: str = ""
    locale: str = ""
    user: str = ""
    commented_ms: float = 0.0
    event_ids: tuple[bytes, ...] = ()
    enabled_ms: float = 0.0
    active_ms: float = 0.0
    acked_ms: float = 0.0
    confirmed_ms: float = 0.0
    severity_ms: float = 0.0
    trouble: msgspec.Raw = msgspec.Raw(b"null")
    """The trouble that it speaks of, as the points told it."""


class _Kept(msgspec.Struct, frozen=True):
    version: int
    alarms: dict[str, KeptAlarm]


_decode = msgspec.json.Decoder(_Kept).decode
_encode = msgspec.json.Encoder().encode
_VERSION: Final = 1


def kept_alarm(state: ConditionState, trouble: bytes) -> KeptAlarm:
    comment = state.comment
    return KeptAlarm(
        enabled=state.enabled,
        active=state.active,
        acked=state.acked,
        confirmed=state.confirmed,
        shelving=state.shelving,
        unshelve_at_ms=state.unshelve_at_ms,
        severity=state.severity,
        last_severity=state.last_severity,
        comment=comment.text,
        locale=comment.locale,
        user=comment.user,
        commented_ms=comment.time_ms,
        event_ids=state.event_ids,
        enabled_ms=state.enabled_ms,
        active_ms=state.active_ms,
        acked_ms=state.acked_ms,
        confirmed_ms=state.confirmed_ms,
        severity_ms=state.severity_ms,
        trouble=msgspec.Raw(trouble),
    )


def state_of(kept: KeptAlarm, now_ms: float) -> ConditionState:
    """The state that was kept, within what Part 9 allows, whoever has written the file."""
    shelving = kept.shelving if kept.unshelve_at_ms > now_ms else Shelving.UNSHELVED
    until = min(kept.unshelve_at_ms, now_ms + MAX_TIME_SHELVED_MS)
    return ConditionState(
        enabled=kept.enabled,
        active=kept.active,
        acked=kept.acked,
        confirmed=kept.confirmed or not kept.acked,
        shelving=shelving,
        unshelve_at_ms=0.0 if shelving is Shelving.UNSHELVED else until,
        severity=min(max(kept.severity, 1), 1000),
        last_severity=min(max(kept.last_severity, 1), 1000),
        comment=Comment(
            kept.comment[:LONGEST_COMMENT], kept.locale[:_LONGEST], kept.user[:_LONGEST], kept.commented_ms
        ),
        event_ids=kept.event_ids[-MOST_EVENT_IDS:],
        enabled_ms=kept.enabled_ms,
        active_ms=kept.active_ms,
        acked_ms=kept.acked_ms,
        confirmed_ms=kept.confirmed_ms,
        severity_ms=kept.severity_ms,
    )


def is_worth_keeping(state: ConditionState) -> bool:
    return state != NORMAL


class AlarmFile:
    """``alarms.json`` in ``folder``, the server's own in the site's state folder."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / FILE
        self._writing = Lock()

    def load(self) -> Mapping[str, KeptAlarm]:
        """Alarms by their ids; none where there is no file, or where it cannot be used, which is logged."""
        try:
            if self.path.stat().st_size > _MOST_BYTES:
                return self._refused(f"is larger than {_MOST_BYTES} bytes")
            kept = _decode(self.path.read_bytes())
        except FileNotFoundError:
            return {}
        except OSError as error:
            return self._refused(error.strerror or str(error))
        except msgspec.MsgspecError as error:
            return self._refused(str(error))
        if kept.version != _VERSION:
            return self._refused(f"is of version {kept.version}, and this program reads {_VERSION}")
        return kept.alarms

    def _refused(self, why: str) -> Mapping[str, KeptAlarm]:
        _log.warning("%s: %s: alarms begin anew, not acknowledged and not shelved", self.path, why)
        return {}

    def save(self, alarms: Mapping[str, KeptAlarm]) -> None:
        """Write it whole or not at all, in whatever thread. Raises OSError."""
        with self._writing:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            write_whole(self.path, _encode(_Kept(_VERSION, dict(alarms))))
