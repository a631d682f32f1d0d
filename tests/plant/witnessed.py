"""What the witness says against what it has heard: a drive that runs beyond its bound is told, and so are
frames that are not the bridge's; nothing else is.

Written from the docs (dead-man-chain.md, "The witness"; command-line.md has the names of the alarms) and the
manuals' tables. The witness is not told who sends a frame; this judge is.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf
from typing import Final

from tests.plant.oracle import Oracle
from tests.proof.block import BLOCK
from tests.proof.drives import DRIVES, TPDO_MS, Drive
from tests.proof.families import CIA402
from tests.proof.settings import PLANT

_NMT: Final = 0x000
_START, _RESET_COMMUNICATION = 0x01, 0x82
_TAKES_OUT: Final = (0x02, 0x80, 0x81, _RESET_COMMUNICATION)
_BOOT_UP, _STOPPED, _OPERATIONAL = 0x00, 0x04, 0x05
_SDO: Final = 0x600
_DOWNLOAD: Final = 0x20
_HEARD: Final = (
    range(0x1005, 0x1008),
    range(0x1014, 0x1018),
    range(0x1200, 0x1C00),
    range(0x6040, 0x6041),
)
"""What a drive hears and watches."""
_OWN_S: Final = 3.0
"""From the last RPDO, where the drive's own time-out is not in the site file."""
_FRESH_S: Final = 0.5
_FOLLOW_S: Final = (3 * TPDO_MS + 5000) / 1000
_LOST_S: Final = 1.0
"""By so much a node may be silent for longer than its supervision time."""
_SAYS_S: Final = 0.3
"""What has to be said is said so soon: it looks each 50 ms."""
_CLEAR_S: Final = 0.4
"""What exceeds a bound by less need not be said, for what comes next may end it: a TPDO, say."""
_LASTS_S: Final = 0.1
"""Who comes back enabled after a long silence, and stops at once, does not run on."""
_WINDOW_S: Final = 2.0
_STRANGE_S: Final = 3.0
"""So long after a frame of somebody else the witness may still speak of it: it counts for two seconds."""
_REPEATED: Final = 2.0 * _WINDOW_S * 1000 / PLANT.rpdo_period_ms + 6
"""As many of the same frame, beside those of the bridge, are too many for anybody."""
_TURNS: Final = 5
_TURNING_S: Final = 0.6
"""An RPDO that turns so often between run and stop is told, whoever's it is."""
_ONCE: Final = 2
"""What lasts is told once by each of the two ways to find it."""
_JUST_S: Final = 0.05
"""A TPDO may have waited for the wire when its node was taken out of operation."""


@dataclass(slots=True)
class _Heard:
    """What the witness has heard of one drive. An RPDO of ``stopped_at`` is the first of those that stop, if
    the last one does."""

    drive: Drive
    rpdo_at: float = inf
    is_told: bool = False
    """The last RPDO enables it."""
    stopped_at: float = inf
    tpdo_at: float = -inf
    node_at: float = -inf
    is_enabled: bool = False
    enabled_since: float = inf
    beyond: tuple[float, float] = (inf, inf)
    """Since when its bound runs that is exceeded, and when it has first said that it is enabled beyond it."""
    out_at: float = inf
    """When its node was taken out of operation, if it has not been heard since."""
    rpdo: bytes = b""
    is_strangers: bool = False
    """The last RPDO was somebody else's."""
    repeats: deque[float] = field(default_factory=deque[float])
    """Times of somebody else's RPDOs that say what the one before has said."""
    turns: deque[float] = field(default_factory=lambda: deque[float](maxlen=_TURNS))
    """Times at which its RPDO turned between run and stop."""
    deaf_until: float = -inf

    def is_told_at(self, at: float) -> bool:
        """It is kept running: the bridge has not been silent for so long that it may have been restarted."""
        return self.is_told and at - self.rpdo_at < _FRESH_S

    @property
    def stop_at(self) -> float:
        """From when on it has been told to stop and is enabled; infinite where it has not."""
        return inf if self.stopped_at == inf else max(self.stopped_at, self.enabled_since)

    @property
    def lost_s(self) -> float:
        return self.drive.family.lost_after_ms / 1000 + _LOST_S


@dataclass(slots=True)
class _HeardOutputs:
    """What the witness has heard of the outputs."""

    rpdo_at: float = inf
    active: dict[int, bool] = field(default_factory=dict[int, bool])
    """Of each RPDO, whether the last one has a value that is not safe: what holds its last value does not
    count."""
    state: int = -1
    operational_at: float = -inf
    node_at: float = inf
    out: int = 0
    """NMT command that has taken their node out of operation, if they were active then."""

    @property
    def are_active(self) -> bool:
        return any(self.active.values())


@dataclass(frozen=True, slots=True)
class _Owed:
    """An alarm of this kind about one of ``sources``, from ``since`` to ``due``."""

    kind: str
    sources: tuple[str, ...]
    since: float
    due: float
    text: str


class Witnessed:
    """Judge of the witness. What is wrong goes to the oracle's violations."""

    def __init__(self, oracle: Oracle, bus: str) -> None:
        self._oracle = oracle
        self._bus = bus
        self.sender = ""
        """Name of the port whose frame is heard next."""
        self.is_quiet: Callable[[], bool] = lambda: True
        """Whether frames reach everybody."""
        self._drives = [_Heard(drive) for drive in DRIVES]
        self._of_path = {one.drive.path: one for one in self._drives}
        self._of_rpdo = {one.drive.rpdo: one for one in self._drives}
        self._of_tpdo = {one.drive.tpdo: one for one in self._drives}
        self._of_node: dict[int, list[_Heard]] = {BLOCK.node_id: []}
        for one in self._drives:
            self._of_node.setdefault(one.drive.node_id, []).append(one)
        self._outputs = _HeardOutputs()
        self._output_masks = {BLOCK.rpdo: b"\x00\xff", BLOCK.rpdo + 0x100: b"\xff\xff\xff\xff"}
        """Bits of its RPDOs that are to be 0 when their owner is silent."""
        self._alarms: dict[tuple[str, str], deque[float]] = {}
        self._owed: list[_Owed] = []
        self._seen: set[tuple[str, str, float]] = set()
        """What has been owed for a state that lasts."""
        self._strange_at = -inf
        self._restarted_at = -inf

    def restarted(self, at: float) -> None:
        """The bridge begins. One that was there half a second ago is not known to be another one: what it
        does with a node that its predecessor has commanded or asked is taken for somebody else's."""
        self._restarted_at = at

    def deaf(self, drive: Drive, until: float) -> None:
        """It does not hear its RPDO until then: its owner may jog, and it gets no slower."""
        one = self._of_path[drive.path]
        one.deaf_until = max(one.deaf_until, until)

    # what the witness hears

    def heard(self, at: float, can_id: int, data: bytes) -> None:
        is_foreign = not self.sender.startswith(("bridge one", "node"))
        if is_foreign:
            self._strange_at = at
        if (one := self._of_rpdo.get(can_id)) is not None:
            self._on_rpdo(one, at, data, is_foreign=is_foreign)
        elif (one := self._of_tpdo.get(can_id)) is not None:
            self._on_tpdo(one, at, data)
        elif can_id in self._output_masks:
            self._on_output_rpdo(can_id, at, data)
        elif can_id == _NMT:
            self._on_nmt(at, data, is_foreign=is_foreign)
        elif can_id > 0x700:
            self._on_guard(can_id - 0x700, at, data)
        elif is_foreign and can_id > _SDO:
            self._on_foreign_request(can_id - _SDO, at, data)

    def _on_rpdo(self, one: _Heard, at: float, data: bytes, *, is_foreign: bool) -> None:
        is_same, one.rpdo, one.is_strangers = data == one.rpdo, data, is_foreign
        if is_foreign and is_same:
            one.repeats.append(at)
            while one.repeats[0] < at - _WINDOW_S:
                one.repeats.popleft()
            if len(one.repeats) > _REPEATED:
                one.repeats.clear()
                self._owe("intruder", (one.drive.path, self._bus), at - _WINDOW_S, at, "an RPDO is repeated")
        one.rpdo_at = at
        was_told, one.is_told = one.is_told, one.drive.enabling(data)
        if one.is_told != was_told:
            one.turns.append(at)
        if one.is_told:
            one.stopped_at = inf
        elif one.stopped_at == inf:
            one.stopped_at = at

    def _on_tpdo(self, one: _Heard, at: float, data: bytes) -> None:
        was_enabled, one.is_enabled = one.is_enabled, one.drive.enabled(data)
        one.tpdo_at = at
        if not one.is_enabled or at > one.out_at + _JUST_S:
            one.out_at = inf
        if not one.is_enabled:
            one.enabled_since = inf
        elif not was_enabled:
            one.enabled_since = at
        if one.is_enabled:
            self._on_enabled(one, at)

    def _on_enabled(self, one: _Heard, at: float) -> None:
        """Judge a drive that has just said that it is enabled."""
        is_stopped = one.stopped_at < inf
        kind, since = ("stop ignored", one.stop_at) if is_stopped else ("runs on", one.rpdo_at)
        if at - since <= (_FOLLOW_S if is_stopped else _OWN_S) + _CLEAR_S:
            return
        if one.beyond[0] != since:
            one.beyond = since, at
        elif at - one.beyond[1] > _LASTS_S:
            after = "it was told to stop" if is_stopped else "its last RPDO"
            text = f"{one.drive.path} is enabled {at - since:.2f} s after {after}"
            self._owe_once(kind, one.drive.path, since, at, text)

    def _on_guard(self, node_id: int, at: float, data: bytes) -> None:
        if node_id not in self._of_node or not data:
            return
        state = data[0] & 0x7F
        for one in self._of_node[node_id]:
            one.node_at = at
            if state == _BOOT_UP or (state == _STOPPED and one.drive.family is CIA402):
                one.is_enabled, one.enabled_since, one.out_at = False, inf, inf
        if node_id == BLOCK.node_id:
            self._on_output_state(state, at)

    def _on_output_state(self, state: int, at: float) -> None:
        outputs = self._outputs
        was, outputs.state, outputs.node_at = outputs.state, state, at
        if state == _OPERATIONAL:
            outputs.operational_at = at
            if outputs.are_active and at - outputs.rpdo_at > _OWN_S + _CLEAR_S:
                text = f"active outputs are operational {at - outputs.rpdo_at:.2f} s after their last RPDO"
                self._owe_once("runs on", BLOCK.path, outputs.rpdo_at, at, text)
        elif state == _BOOT_UP:
            if outputs.out != _RESET_COMMUNICATION:
                outputs.active.clear()
            outputs.out = 0
        elif state != was and outputs.out in (0, 0x02):
            # By the files it makes them safe then.
            outputs.active.clear()

    def _on_output_rpdo(self, can_id: int, at: float, data: bytes) -> None:
        mask = self._output_masks[can_id]
        self._outputs.active[can_id] = any(byte & bits for byte, bits in zip(data, mask, strict=True))
        self._outputs.rpdo_at = at

    def _on_nmt(self, at: float, data: bytes, *, is_foreign: bool) -> None:
        command, to = data[0], data[1]
        for node_id, drives in self._of_node.items():
            if to not in (0, node_id):
                continue
            told = [one for one in drives if one.is_told_at(at)]
            if any(one.is_strangers for one in told):
                self._strange_at = at
            if is_foreign and told and command in (*_TAKES_OUT, _START):
                text = f"somebody's NMT command {command:02X}h to a node whose {told[0].drive.path} is to run"
                self._owe("intruder", (self._bus,), at, at, text)
            if command in _TAKES_OUT:
                for one in drives:
                    if one.is_enabled:
                        one.out_at = at
                if node_id == BLOCK.node_id and self._outputs.are_active:
                    self._outputs.out = command
            elif command == _START and node_id == BLOCK.node_id:
                self._outputs.out = 0

    def _on_foreign_request(self, node_id: int, at: float, data: bytes) -> None:
        told = [one for one in self._of_node.get(node_id, []) if one.is_told_at(at)]
        index = int.from_bytes(data[1:3], "little")
        if told and data[0] & 0xE0 == _DOWNLOAD and any(index in part for part in _HEARD):
            text = f"somebody writes {index:04X}h of a node whose {told[0].drive.path} is to run"
            self._owe("intruder", (self._bus,), at, at, text)

    # what it says

    def _owe(self, kind: str, sources: tuple[str, ...], since: float, at: float, text: str) -> None:
        self._owed.append(_Owed(kind, sources, since, at + _SAYS_S, text))

    def _owe_once(self, kind: str, source: str, since: float, at: float, text: str) -> None:
        """As ``_owe``, of a state that has lasted since then."""
        if (kind, source, since) not in self._seen:
            self._seen.add((kind, source, since))
            self._owe(kind, (source,), since, at, text)

    def told(self, source: str, kind: str, at: float, message: str) -> None:
        """The witness raises an alarm."""
        self._oracle.looks += 1
        times = self._alarms.setdefault((kind, source), deque(maxlen=100))
        times.append(at)
        if kind != "intruder" and len(times) > _ONCE and at - times[-1 - _ONCE] < _WINDOW_S:
            self._oracle.wrong(at, f"the witness says {kind!r} of {source} again and again")
        if not self._is_right(source, kind, at):
            self._oracle.wrong(at, f"the witness says {kind!r} of {source} ({message}), which is not so")

    def _is_right(self, source: str, kind: str, at: float) -> bool:
        if kind == "intruder":
            # Who has not heard a stop or an answer takes what follows for somebody else's.
            is_strange = at < self._strange_at + _STRANGE_S or not self.is_quiet()
            is_strange |= at < self._restarted_at + 2 * _FRESH_S
            return is_strange or self._turns(source, at)
        if source == BLOCK.path:
            return self._is_right_of_outputs(kind, at)
        one = self._of_path.get(source)
        if one is None:
            # Of the hoist nothing is known here.
            return True
        if kind == "runs on":
            return one.is_enabled and one.stopped_at == inf and one.tpdo_at - one.rpdo_at > _OWN_S
        if kind == "stop ignored":
            return at < one.deaf_until or (one.is_enabled and one.tpdo_at - one.stop_at > _FOLLOW_S)
        if kind == "unheard":
            is_lost = at - max(one.tpdo_at, one.node_at) > one.lost_s
            return one.is_enabled and (is_lost or at - one.out_at > _FOLLOW_S)
        return kind == "enabled untold" and one.rpdo_at == inf

    def _turns(self, source: str, at: float) -> bool:
        one = self._of_path.get(source)
        return one is not None and len(one.turns) == _TURNS and at - one.turns[0] < _TURNING_S

    def _is_right_of_outputs(self, kind: str, at: float) -> bool:
        outputs = self._outputs
        if kind == "runs on":
            return outputs.are_active and outputs.operational_at - outputs.rpdo_at > _OWN_S
        is_lost = at - outputs.node_at > PLANT.heartbeat_ms / 1000 + _LOST_S
        return kind in ("unheard", "stop ignored") and (is_lost or bool(outputs.out))

    def look(self, now: float) -> None:
        """Judge what is due by ``now``."""
        for one in self._drives:
            if one.is_enabled:
                self._look_at_unheard(one, now)
        outputs = self._outputs
        if outputs.are_active and now - outputs.node_at > PLANT.heartbeat_ms / 1000 + _LOST_S + _CLEAR_S:
            self._owe_once("unheard", BLOCK.path, outputs.node_at, now, "active outputs cannot be heard")
        while self._owed and self._owed[0].due <= now:
            owed = self._owed.pop(0)
            self._oracle.looks += 1
            times = [at for source in owed.sources for at in self._alarms.get((owed.kind, source), ())]
            if not any(owed.since <= at <= owed.due for at in times):
                self._oracle.wrong(owed.due, f"the witness does not say {owed.kind!r}: {owed.text}")

    def _look_at_unheard(self, one: _Heard, now: float) -> None:
        path, heard_at = one.drive.path, max(one.tpdo_at, one.node_at)
        if now - heard_at > one.lost_s + _CLEAR_S:
            text = f"{path} was enabled when it was heard last, {now - heard_at:.2f} s ago"
            self._owe_once("unheard", path, one.tpdo_at, now, text)
        elif now - one.out_at > _FOLLOW_S + _CLEAR_S:
            text = (
                f"{path} was enabled when its node was taken out of operation, {now - one.out_at:.2f} s ago"
            )
            self._owe_once("unheard", path, one.tpdo_at, now, text)
