"""What the boot-up asks of the one who runs it, and what it finds."""

from __future__ import annotations

from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass, field
from enum import Enum
from typing import Final

from bridge.canopen.dialogue import Read, Write
from bridge.canopen.nmt import NmtCommand, NmtState
from bridge.canopen.sdo import SdoError
from bridge.command import Identification
from bridge.drive import Key, OwnJudgement
from bridge.mapping.fields import ObjectRef
from bridge.node.boot.memory import BootMemory
from bridge.node.boot.pdo_plan import PdoPlan
from bridge.node.boot.status import BootError


@dataclass(frozen=True, slots=True)
class Step:
    """What the boot-up is doing now, for ``boot_status``; ``letter`` is the error status if it fails."""

    text: str
    letter: str


class Signal(Enum):
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
class Nmt:
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
    text: str = ""

    @property
    def cause(self) -> tuple[int, int]:
        """By which an error is known again."""
        return self.register, self.codes[0] if self.codes else 0


@dataclass(frozen=True, slots=True)
class ResetCommunication:
    """NMT reset communication, because of ``why``, after a stopped word for every drive."""

    why: str


Action = Step | Signal | Read | Write | Nmt | Pause | DeviceErrors | ResetCommunication | Await


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
    problem: str = ""
    unserved: dict[str, str] = field(default_factory=dict[str, str])

    def leave_out(self, why: str) -> None:
        """It cannot be served; the first reason counts."""
        self.problem = self.problem or why


@dataclass(slots=True)
class SignalPlan:
    """The TPDOs or the RPDOs of a device that is no drive; ``unserved`` has the reason for each input or
    output that none of them carries."""

    pdos: list[PdoPlan] = field(default_factory=list[PdoPlan])
    unserved: dict[ObjectRef, str] = field(default_factory=dict[ObjectRef, str])


@dataclass(slots=True)
class WordFacts:
    """What a drive has told of its words: ``parameters`` that decide what they mean, by name and set,
    ``codes`` by the word's leaf for each set, None for what it does not tell, and ``why_unread``."""

    parameters: dict[Key, float | None] = field(default_factory=dict[Key, float | None])
    codes: dict[str, list[int | None]] = field(default_factory=dict[str, list[int | None]])
    why_unread: str = "cannot be read"


@dataclass(slots=True)
class BootResult:
    identification: Identification = field(default_factory=Identification)
    software_version: str = ""
    drives: dict[str, DrivePlan] = field(default_factory=dict[str, DrivePlan])
    words: dict[str, WordFacts] = field(default_factory=dict[str, WordFacts])
    node_tpdos: list[NodePdoPlan] = field(default_factory=list[NodePdoPlan])
    inputs: SignalPlan | None = None
    outputs: SignalPlan | None = None
    held: dict[str, int] = field(default_factory=dict[str, int])
    """What outputs hold that are to hold it, as integers without sign, by their names."""
    bridge_stop: tuple[int, str] = (0, "")
    """Longest time in ms from the bridge's hang to outputs that the node itself has made safe; 0 with the
    reason where there is none."""
    notes: list[str] = field(default_factory=list[str])
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
    """Around steps that the node must not refuse: raises ``error`` where it does. Silence remains silence."""
    try:
        yield
    except SdoError as refusal:
        if not refusal.by_server:
            raise
        raise error(refusal) from None


_LONGEST_NUMBER: Final = 8


def number(data: bytes | None, default: int = 0) -> int:
    """The number in an answer. Raises BootError where it is longer than any number of CANopen."""
    if data is None:
        return default
    if len(data) > _LONGEST_NUMBER:
        raise BootError("J", f"the node answers with {len(data)} bytes where a number belongs")
    return int.from_bytes(data, "little")


def same(have: bytes | None, want: bytes) -> bool:
    """Whether the node's bytes are ours. An expedited answer without a size always has four."""
    if have is None:
        return False
    padded = len(have) == 4 > len(want) and not any(have[len(want) :])
    return have == want or (padded and have[: len(want)] == want)
