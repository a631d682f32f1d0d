"""What the boot-up asks of the one who runs it, and what it finds."""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass, field
from enum import Enum
from typing import Final

from bridge.base.sdo_texts import text_of
from bridge.canopen import width
from bridge.canopen.dialogue import SdoRead, SdoWrite
from bridge.canopen.nmt import NmtCommand, NmtState
from bridge.canopen.sdo import SdoError
from bridge.command import Identification
from bridge.drive import Key, OwnJudgement
from bridge.mapping.entry_types import ObjectRef
from bridge.node.boot.error_status import BootError
from bridge.node.boot.memory import BootMemory
from bridge.node.boot.pdo_plan import PdoPlan
from bridge.text import Said, Text


@dataclass(frozen=True, slots=True)
class BootStep:
    """What the boot-up is doing now, for ``boot_status``; ``letter`` is the error status if it fails.

    ``needed_by`` is the key in the site file, or in ``mapping``, that asks for it; empty: nothing does, and
    a node that answers it wrongly or not at all is used all the same.
    """

    what: Text
    letter: str
    needed_by: str = ""

    @property
    def said(self) -> Text:
        """What it does, and who needs that."""
        if not self.needed_by:
            return self.what
        return Text.of("boot_step.needed", step=self.what, rule=self.needed_by)


class BootSignal(Enum):
    """Steps that need no more words."""

    FOUND = "the node is there"
    SEND_STOPPED = "stopped words"
    """To every drive, by every identifier under which it may listen: the node may still be operational."""
    WAKE = "enter pre-operational"
    """For a node that does not answer, after a stopped word for every drive: it may be stopped, and does not
    answer SDO then."""
    START_SUPERVISION = "from now on the node is expected to be heard"
    AWAIT_RELEASE = "wait until the network lets the node start"
    """Start order and mandatory nodes decide. No time limit."""


@dataclass(frozen=True, slots=True)
class SendNmt:
    command: NmtCommand


@dataclass(frozen=True, slots=True)
class Pause:
    """Go on after this time, in seconds."""

    seconds: float


@dataclass(frozen=True, slots=True)
class Await:
    """Wait until the node reports this state, or any with None. Without supervision there is nothing
    to wait for."""

    state: NmtState | None
    timeout_s: float


@dataclass(frozen=True, slots=True)
class DeviceErrors:
    """What the node says of its errors: 1001h, the newest codes of 1003h, and both in words (empty where it
    has none)."""

    register: int = 0
    codes: tuple[int, ...] = ()
    said: Said = ""

    @property
    def cause(self) -> tuple[int, int]:
        """By which an error is known again."""
        return self.register, self.codes[0] if self.codes else 0


@dataclass(frozen=True, slots=True)
class ResetCommunication:
    """NMT reset communication, because of ``why``, after a stopped word for every drive."""

    why: Text


Action = (
    BootStep | BootSignal | SdoRead | SdoWrite | SendNmt | Pause | DeviceErrors | ResetCommunication | Await
)


@dataclass(frozen=True, slots=True)
class NodePdoPlan:
    """A TPDO of the node itself: which polls it saves. ``names`` has one for each entry, "" for what
    nobody shows."""

    pdo: PdoPlan
    names: tuple[str, ...]


@dataclass(slots=True)
class DrivePlan:
    """The PDOs of one drive, those with control and status word first, or the reason why it cannot be
    served. ``unserved`` has the reason for each word that they do not carry, and for each value of a word
    that they carry in part, by its leaf such as ``actual/value_2``."""

    rpdos: list[PdoPlan] = field(default_factory=list[PdoPlan])
    tpdos: list[PdoPlan] = field(default_factory=list[PdoPlan])
    problem: Said = ""
    unserved: dict[str, Text] = field(default_factory=dict[str, Text])

    def leave_out(self, why: Text) -> None:
        """It cannot be served; the first reason counts."""
        self.problem = self.problem or why


@dataclass(slots=True)
class SignalPlan:
    """The TPDOs or the RPDOs of a device that is no drive; ``unserved`` has the reason for each input or
    output that none of them carries."""

    pdos: list[PdoPlan] = field(default_factory=list[PdoPlan])
    unserved: dict[ObjectRef, Text] = field(default_factory=dict[ObjectRef, Text])


@dataclass(slots=True)
class DevicePlan:
    """The PDOs of a device: TPDOs bring its inputs, RPDOs take its outputs."""

    tpdos: SignalPlan
    rpdos: SignalPlan


UNREADABLE: Final = Text.of("meaning.cannot_be_read")


@dataclass(slots=True)
class WordFacts:
    """What a drive has told of its words: ``parameters`` that decide what they mean, by name and set,
    ``codes`` by the word's leaf for each set, None for what it does not tell, and ``why_unread``."""

    parameters: dict[Key, float | None] = field(default_factory=dict[Key, float | None])
    codes: dict[str, list[int | None]] = field(default_factory=dict[str, list[int | None]])
    why_unread: Text = UNREADABLE


@dataclass(slots=True)
class BootResult:
    identification: Identification = field(default_factory=Identification)
    software_version: str = ""
    drives: dict[str, DrivePlan] = field(default_factory=dict[str, DrivePlan])
    words: dict[str, WordFacts] = field(default_factory=dict[str, WordFacts])
    node_tpdos: list[NodePdoPlan] = field(default_factory=list[NodePdoPlan])
    devices: dict[str, DevicePlan] = field(default_factory=dict[str, DevicePlan])
    held: dict[str, int] = field(default_factory=dict[str, int])
    """What outputs hold that are to hold it, as integers without sign, by their names."""
    bridge_stop: tuple[int, Said] = (0, "")
    """Longest time in ms from the bridge's hang to outputs that the node itself has made safe; 0 with the
    reason where there is none."""
    notes: list[Text] = field(default_factory=list[Text])
    silences: int = 0
    """Objects that nothing needs and that were not answered."""
    emcy_id: int | None = None
    """Where emergency messages come; None where the node sends none."""
    heartbeat_ms: int = 0
    """The heartbeat period that the node keeps; 0 for none."""
    own: dict[str, OwnJudgement] = field(default_factory=dict[str, OwnJudgement])
    """What each drive, or a node with its outputs, does by itself when the bridge falls silent."""
    errors: DeviceErrors = field(default_factory=DeviceErrors)
    memory: BootMemory = field(default_factory=BootMemory)


Boot = Generator[Action, bytes | None, BootResult]
Do = Generator[Action, bytes | None, None]


@contextmanager
def told_as(error: Callable[[SdoError], Exception]) -> Generator[None]:
    """Around steps that the node must not refuse, nor answer wrongly: raises ``error`` where it does. Silence
    remains silence."""
    try:
        yield
    except SdoError as refusal:
        if not refusal.was_answered:
            raise
        raise error(refusal) from None


U8: Final = 1
U16: Final = 2
U32: Final = 4
"""Bytes of UNSIGNED8, UNSIGNED16 and UNSIGNED32."""
_MOST_SILENCES: Final = 2
"""Objects that nothing needs may remain without an answer: a node that has no segmented transfer may be
silent about its texts, 1008h and 100Ah. One that leaves more unanswered is gone."""


def number(data: bytes | None, default: int = 0, *, size: int = U32) -> int:
    """The number of ``size`` bytes in an answer. Raises BootError where that is longer than any number of
    CANopen."""
    if data is None:
        return default
    if len(data) > width.LONGEST:
        raise BootError("J", Text.of("boot.no_number", length=len(data)))
    return width.unsigned(data, size)


def same(have: bytes | None, want: bytes) -> bool:
    """Whether what the node has answered is what it is to hold."""
    return have is not None and width.holds(have, want)


def wish(
    result: BootResult, index: int, sub: int = 0, channel: int = 1, *, may_be_silent: bool = True
) -> Generator[SdoRead, bytes | None, bytes | None]:
    """An object that nothing needs: None where the node has none, and, with a note, where it answers wrongly
    or not at all. Raises SdoError where it is silent too often to be there, or, without ``may_be_silent``,
    at all."""
    try:
        return (yield SdoRead(index, sub, channel))
    except SdoError as error:
        if not (error.was_answered or may_be_silent):
            raise
        if not error.by_server:
            go_on_without(error, result)
        return None


def go_on_without(error: SdoError, result: BootResult) -> None:
    """Note an object that nothing needs and that cannot be read. Raises ``error`` where the node is silent
    too often to be there."""
    if not error.was_answered:
        result.silences += 1
        if result.silences > _MOST_SILENCES:
            raise error
    result.notes.append(Text.of("boot.not_needed", why=text_of(error)))


def write_number(
    index: int,
    sub: int,
    data: bytes,
    have: bytes | None,
    *,
    is_number: bool = True,
    signed: bool = False,
    channel: int = 1,
) -> Do:
    """Write ``data`` in the width in which the node takes it; ``have`` is its last answer, None where it is
    not known. Raises SdoError where it takes it in none."""
    refused: SdoError | None = None
    for form in width.forms(data, have, signed=signed, is_number=is_number):
        try:
            yield SdoWrite(index, sub, form, channel)
        except SdoError as error:
            refused = error
            if not error.by_server or not width.may_mean_width(error.code):
                raise
        else:
            return
    if refused is not None:
        raise refused
