"""Question to nodes, beside a running bridge: what their drives would do if it fell silent. Sans-IO."""

from __future__ import annotations

from collections.abc import Generator, Mapping, Sequence

from bridge.bustools.task import SdoTasks
from bridge.canopen import dialogue
from bridge.canopen.dialogue import Dialogue, SdoRead
from bridge.canopen.sdo import SdoError
from bridge.catalogue import MemberSpec, NodeSpec
from bridge.command.output_words import OutputWords
from bridge.drive import OwnJudgement
from bridge.drive.own_judgement import judge
from bridge.node.boot import BootError
from bridge.node.boot.device_watch import keeps_outputs, read_why_not_safe
from bridge.node.boot.own_supervision_setup import read_places
from bridge.node.places.sdo_channels import SdoChannels

Judgements = dict[str, OwnJudgement]


def ask(node: NodeSpec) -> Generator[SdoRead, bytes | None, Judgements]:
    """Judgement of each drive of the node, by the drive's name, or of the node itself with its outputs."""
    of_node = yield from read_places(node, None, link=True)
    found: Judgements = {}
    for one in node.commanded:
        found[one.name] = yield from _judged(node, one, of_node)
    return found


def _judged(
    node: NodeSpec, one: MemberSpec, of_node: Mapping[tuple[int, int], int]
) -> Generator[SdoRead, bytes | None, OwnJudgement]:
    of_one = yield from read_places(node, one, link=True)
    own = judge(one.family, {**of_node, **of_one}, node.bus, node.table, one.table.accepts.runs_on or "")
    for place in OutputWords.of(node.table, one.family).places.values():
        if place.safe is not None and (why := (yield from read_why_not_safe(place, place.safe))):
            return keeps_outputs(own, why)
    return own


class OwnCheck(SdoTasks):
    """Task that asks all nodes side by side. ``found`` has the judgements by drive, ``failed`` the reasons
    why nodes could not be asked, by node."""

    def __init__(self, nodes: Sequence[NodeSpec], now: float) -> None:
        of_nodes = [SdoChannels(node) for node in nodes]
        super().__init__((channel for sdo in of_nodes for channel in sdo), now)
        self.found: Judgements = {}
        self.failed: dict[str, str] = {}
        self._left = len(nodes)
        for node, sdo in zip(nodes, of_nodes, strict=True):
            self._begin(node, sdo)

    def _begin(self, node: NodeSpec, sdo: SdoChannels) -> None:
        def do(step: SdoRead, now: float) -> bool:
            dialogue.ask(step, sdo[step.channel], now, lambda answer: asking.go_on(answer, self._now))
            return True

        def done(end: Judgements | SdoError | BootError, now: float) -> None:
            self._left -= 1
            if isinstance(end, dict):
                self.found |= end
            else:
                self.failed[node.name] = str(end)

        asking = Dialogue[SdoRead, bytes | None, Judgements, SdoError | BootError](
            ask(node), do, done, (SdoError, BootError)
        )
        asking.go_on(None, self._now)

    def is_finished(self, now: float) -> bool:
        return not self._left
