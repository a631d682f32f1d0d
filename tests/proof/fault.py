"""A fault: how it is brought about and undone, from when its time counts, and its bound or its demand."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Literal

from tests.proof import acts
from tests.proof.block import BLOCK, Block
from tests.proof.bounds import Bound
from tests.proof.drives import DRIVES, PROTOCOLS, Drive
from tests.proof.examine import Examine
from tests.proof.rig import Rig

_SELDOM: Final = 3

Reference = Literal["telegram", "moment", "send", "sign of life", "boot-up"]


@dataclass(frozen=True, slots=True)
class Fault:
    """Drives of other protocols than ``protocols`` are to go on, and of other nodes than ``nodes`` where
    there are any. ``steady``: what of the fault is to stop no drive comes first. ``at_once``: to how many
    owners, connections or nodes a round does it; each of them counts. ``leaves_silence``: the bridge does not
    answer it with a stop: it is not there, or its bus is not. ``new_process``: a process is started anew for
    it, which takes its time; ``is_long``: it takes as much without one. ``others_may_stop``: drives that it
    does not concern. Without a ``bus_bound`` somebody else speaks there; without a ``drive_bound`` the drive
    says nothing. ``examine``: in place of times, what is done and judged by yes or no; ``demand`` says what
    has to hold then. ``brings_back``: somebody enables the drive again and again, so that its time is the
    longest that it turned without a stop. ``speaks_on``: somebody goes on enabling a drive whose node is
    stopped, so that its time is to the end of its last turn. ``lacks``: what a drive was not told that it has
    to be, besides the times; empty where it was. ``ends_soon``: it is undone as soon as its last bound has
    passed, and not only when all are measured. ``hands_over``: its end gives the drives to new owners, which
    ends what holds. ``of_outputs``: it is about the outputs beside the drives."""

    name: str
    reference: Reference
    inject: acts.Inject
    undo: Callable[[Rig], None]
    bus_bound: Bound | None = None
    drive_bound: Bound | None = None
    protocols: tuple[str, ...] = PROTOCOLS
    nodes: tuple[str, ...] = ()
    steady: Callable[[Rig], None] | None = None
    possible: Callable[[], bool] = lambda: True
    at_once: int = 1
    leaves_silence: bool = False
    new_process: bool = False
    is_long: bool = False
    others_may_stop: bool = False
    brings_back: bool = False
    speaks_on: bool = False
    hands_over: bool = False
    ends_soon: bool = False
    examine: Examine | None = None
    demand: str = ""
    of_outputs: bool = False
    lacks: Callable[[Rig, Drive, float], str] = lambda rig, drive, moment: ""

    @property
    def per_round(self) -> int:
        """What a round is worth: what takes its time is injected less often."""
        return self.at_once * (_SELDOM if self.new_process or self.is_long else 1)

    def rounds(self, times: int) -> int:
        """How many rounds are needed for what is asked for as ``times``."""
        return -(-times // self.per_round)

    def is_due(self, cycle: int, cycles: int) -> bool:
        """Whether it has a round in this one of ``cycles``, over which its rounds are spread evenly."""
        rounds = self.rounds(cycles)
        return (cycle + 1) * rounds // cycles > cycle * rounds // cycles

    @property
    def of_controller(self) -> bool:
        return self.reference in ("telegram", "send")

    def concerns(self, drive: Drive) -> bool:
        if self.of_outputs:
            return False
        return drive.protocol in self.protocols and (not self.nodes or drive.node in self.nodes)

    @property
    def subjects(self) -> list[Drive | Block]:
        """Each of them is judged in every round."""
        return [BLOCK] if self.of_outputs else [drive for drive in DRIVES if self.concerns(drive)]

    @property
    def is_here(self) -> bool:
        """This plant has what it is about, and the machine what it takes."""
        return bool(self.subjects) and self.possible()

    def goes_on(self, drive: Drive) -> bool:
        """The drive is to move on all the time: the fault is not its own, or is only reported."""
        return not self.concerns(drive) or (self.of_controller and drive.reaction == "hold")

    def falls_silent(self, drive: Drive) -> bool:
        """What stops the drive is that its RPDOs end."""
        return self.leaves_silence or (self.of_controller and drive.reaction == "silence")
