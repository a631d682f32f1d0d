"""Asks nodes what their drives would do if the bridge fell silent, beside a running bridge. Sans-IO."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, field

from bridge.canopen.frame import Frame
from bridge.canopen.sdo import Result, SdoError
from bridge.command.plant import Node
from bridge.drive import OwnJudgement
from bridge.drive.own_supervision import judge
from bridge.node.boot import Action, BootError, Read
from bridge.node.boot.own_supervision import read_places
from bridge.node.sdo_channels import SdoChannels

Asking = Generator[Action, bytes | None, dict[str, OwnJudgement]]


def ask(node: Node) -> Asking:
    """What each drive of the node would do, by the drive's name."""
    of_node = yield from read_places(node, None, link=True)
    found: dict[str, OwnJudgement] = {}
    for drive in node.drives:
        of_drive = yield from read_places(node, drive, link=True)
        accepted = drive.table.accepts.runs_on or ""
        found[drive.name] = judge(node.family, {**of_node, **of_drive}, node.bus, node.table, accepted)
    return found


@dataclass(slots=True)
class _Asked:
    node: Node
    sdo: SdoChannels
    asking: Asking
    answers: list[Result] = field(default_factory=list[Result])
    is_done: bool = False


class AuditErrand:
    """All nodes side by side. ``found`` has what was read, by drive; ``failed`` why a node could not be
    asked, by node."""

    def __init__(self, nodes: Sequence[Node], now: float) -> None:
        self.found: dict[str, OwnJudgement] = {}
        self.failed: dict[str, str] = {}
        self._now = now
        self._nodes = [_Asked(node, SdoChannels(node), ask(node)) for node in nodes]
        self._channels = {channel.reply_id: channel for one in self._nodes for channel in one.sdo}
        for one in self._nodes:
            self._go_on(one, None)
            self._pump(one)

    def _pump(self, one: _Asked) -> None:
        while one.answers:
            self._go_on(one, one.answers.pop(0))

    def _go_on(self, one: _Asked, answer: Result | None) -> None:
        try:
            is_error = isinstance(answer, SdoError)
            action = one.asking.throw(answer) if is_error else one.asking.send(answer)
        except StopIteration as end:
            self.found |= end.value
            one.is_done = True
        except (SdoError, BootError) as error:
            self.failed[one.node.name] = str(error)
            one.is_done = True
        else:
            if isinstance(action, Read):
                channel = one.sdo[action.channel]
                channel.read(action.index, action.sub, self._now, one.answers.append)

    def is_finished(self, now: float) -> bool:
        return all(one.is_done for one in self._nodes)

    def on_frame(self, frame: Frame) -> None:
        self._now = max(self._now, frame.time)
        channel = self._channels.get(frame.can_id)
        if channel is not None:
            channel.on_frame(frame)
            for one in self._nodes:
                self._pump(one)

    def on_time(self, now: float) -> None:
        self._now = max(self._now, now)
        for one in self._nodes:
            one.sdo.on_time(now)
            self._pump(one)

    def next_deadline(self) -> float | None:
        times = (one.sdo.next_deadline() for one in self._nodes if not one.is_done)
        return min((time for time in times if time is not None), default=None)

    def take_frames(self) -> list[Frame]:
        return [frame for one in self._nodes for frame in one.sdo.take_frames()]
