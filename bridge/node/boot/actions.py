"""Requests of a boot-up to whoever runs it, and its result."""

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
    """Present step of the boot-up, for ``boot_status``; ``letter`` is the error status if it fails.

    ``needed_by`` is the key in the site file, or in ``mapping``, that requires the step. Empty: nothing
    requires it, and a node that answers wrongly or not at all is used all the same.
    """

    what: Text
    letter: str
    needed_by: str = ""

    @property
    def said(self) -> Text:
        """The step, and the key that requires it."""
        if not self.needed_by:
            return self.what
        return Text.of("boot_step.needed", step=self.what, rule=self.needed_by)


class BootSignal(Enum):
    """Steps without arguments."""

    FOUND = "the node is there"
    SEND_STOPPED = "stopped words"
    """To every drive, on every COB-ID on which it may listen: the node may still be operational."""
    WAKE = "enter pre-operational"
    """For a node that does not answer, after a stopped word for every drive: in Stopped it answers no SDO."""
    START_SUPERVISION = "from now on the node is expected to be heard"
    AWAIT_RELEASE = "wait until the network lets the node start"
    """Start order and mandatory nodes decide. No time limit."""


@dataclass(frozen=True, slots=True)
class SendNmt:
    command: NmtCommand


@dataclass(frozen=True, slots=True)
class Pause:
    """Pause before the next step, in seconds."""

    seconds: float


@dataclass(frozen=True, slots=True)
class Await:
    """Wait until the node reports ``state``, or any state if None. Without supervision the node reports none,
    and there is no wait."""

    state: NmtState | None
    timeout_s: float


@dataclass(frozen=True, slots=True)
class DeviceErrors:
    """Errors that the node reports: 1001h, the newest codes of 1003h, and both as a text (empty if there is
    none)."""

    register: int = 0
    codes: tuple[int, ...] = ()
    said: Said = ""

    @property
    def cause(self) -> tuple[int, int]:
        """Key by which an error is recognised: error register and newest code, 0 for none."""
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
    """A TPDO of the node itself, which makes polls unnecessary. ``names`` has the name of each entry's poll,
    "" for an entry that is not shown."""

    pdo: PdoPlan
    names: tuple[str, ...]


@dataclass(slots=True)
class DrivePlan:
    """PDOs of one drive, those with the control and the status word first, or the ``problem`` for which it
    cannot be served. ``unserved`` has the reason for each word that they do not carry, and for each value of
    a word that they carry in part, by leaf, such as ``actual/value_2``."""

    rpdos: list[PdoPlan] = field(default_factory=list[PdoPlan])
    tpdos: list[PdoPlan] = field(default_factory=list[PdoPlan])
    problem: Said = ""
    unserved: dict[str, Text] = field(default_factory=dict[str, Text])

    def leave_out(self, why: Text) -> None:
        """Mark the drive as not served; the first reason counts."""
        self.problem = self.problem or why


@dataclass(slots=True)
class SignalPlan:
    """TPDOs or RPDOs of a device that is no drive; ``unserved`` has the reason for each input or output that
    none of them carries."""

    pdos: list[PdoPlan] = field(default_factory=list[PdoPlan])
    unserved: dict[ObjectRef, Text] = field(default_factory=dict[ObjectRef, Text])


@dataclass(slots=True)
class DevicePlan:
    """PDOs of a device: TPDOs bring its inputs, RPDOs take its outputs."""

    tpdos: SignalPlan
    rpdos: SignalPlan


UNREADABLE: Final = Text.of("meaning.cannot_be_read")


@dataclass(slots=True)
class WordFacts:
    """Facts about a drive's words, as read from it: ``parameters`` that decide what they mean, by name and
    set; ``codes`` by the word's leaf for each set, None for one that it does not tell; ``why_unread``.
    ``told`` are the keys of those for which it has given a value."""

    parameters: dict[Key, float | None] = field(default_factory=dict[Key, float | None])
    codes: dict[str, list[int | None]] = field(default_factory=dict[str, list[int | None]])
    told: set[Key] = field(default_factory=set[Key])
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
    """Present values of the outputs that hold theirs on a stop, as unsigned integers, by output name."""
    bridge_stop: tuple[int, Said] = (0, "")
    """Longest time in ms from a hang of the bridge until the node itself has made its outputs safe; 0, with
    the reason, where it does not."""
    notes: list[Text] = field(default_factory=list[Text])
    silences: int = 0
    """Number of optional objects that were not answered."""
    emcy_id: int | None = None
    """COB-ID of the emergency messages; None where the node sends none."""
    heartbeat_ms: int = 0
    """Heartbeat period in ms that the node keeps; 0 for none."""
    own: dict[str, OwnJudgement] = field(default_factory=dict[str, OwnJudgement])
    """Own supervision of each drive, or of a node with outputs: its reaction when the bridge falls silent."""
    errors: DeviceErrors = field(default_factory=DeviceErrors)
    memory: BootMemory = field(default_factory=BootMemory)


Boot = Generator[Action, bytes | None, BootResult]
Do = Generator[Action, bytes | None, None]


@contextmanager
def told_as(error: Callable[[SdoError], Exception]) -> Generator[None]:
    """Raise ``error`` where the node refuses the steps within, or answers them wrongly. A missing answer
    stays an SdoError."""
    try:
        yield
    except SdoError as refusal:
        if not refusal.was_answered:
            raise
        raise error(refusal) from None


U8: Final = 1
U16: Final = 2
U32: Final = 4
"""Sizes of UNSIGNED8, UNSIGNED16 and UNSIGNED32 in bytes."""
_MOST_SILENCES: Final = 2
"""Number of optional objects that may stay unanswered: a node without segmented transfer may be silent about
its texts, 1008h and 100Ah. One that leaves more unanswered is gone."""


def number(data: bytes | None, default: int = 0, *, size: int = U32) -> int:
    """Unsigned integer of ``size`` bytes in an answer. Raises BootError where the answer is longer than any
    number of CANopen."""
    if data is None:
        return default
    if len(data) > width.LONGEST:
        raise BootError("J", Text.of("boot.no_number", length=len(data)))
    return width.unsigned(data, size)


def same(have: bytes | None, want: bytes) -> bool:
    """Whether the node's answer is the value that it is to hold."""
    return have is not None and width.holds(have, want)


def wish(
    result: BootResult, index: int, sub: int = 0, channel: int = 1, *, may_be_silent: bool = True
) -> Generator[SdoRead, bytes | None, bytes | None]:
    """Read an optional object: None where the node has none, and, with a note, where it answers wrongly or
    not at all. Raises SdoError where it was silent too often to be there, or, without ``may_be_silent``,
    once."""
    try:
        return (yield SdoRead(index, sub, channel))
    except SdoError as error:
        if not (error.was_answered or may_be_silent):
            raise
        if not error.by_server:
            go_on_without(error, result)
        return None


def go_on_without(error: SdoError, result: BootResult) -> None:
    """Note an optional object that cannot be read. Raises ``error`` where the node was silent too often to be
    there."""
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
    """Write ``data`` in a width that the node accepts; ``have`` is its last answer, None if unknown. Raises
    SdoError where it accepts none."""
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
