"""The witness of a plant: what ``drivebridge witness --frames-only`` runs, at the drives' end of the wire."""

from __future__ import annotations

from typing import Final

from bridge.canopen.frame import Frame
from bridge.config import Site
from bridge.project import Project
from bridge.witness.bus_judge import BusJudge
from bridge.witness.findings import Alarm
from bridge.witness.plan import plan
from tests.plant.wire import Wire
from tests.plant.witnessed import Witnessed
from tests.plant.world import World

_TURN_S: Final = 0.05
_OWN_MAPPINGS: Final = {"split": "cia402/velocity"}
"""The witness knows no mappings of a site's own: in place of them those that they extend."""


class Witness:
    """One bus, by the bounds of the site. ``judge`` hears what the witness hears, and what it says."""

    def __init__(self, world: World, wire: Wire, project: Project, judge: Witnessed) -> None:
        (bus,) = plan(_known(project.site), project.path.parent)
        self._world = world
        self._core = BusJudge(bus, asks=False)
        self._identifiers = frozenset(self._core.identifiers)
        self._judge = judge
        wire.port("witness", self._take)
        world.after(_TURN_S, self._turn)

    def _take(self, frame: Frame) -> None:
        # A frame with flags is none of its identifiers, as in the filters of its socket.
        if frame.can_id in self._identifiers:
            self._core.on_frame(frame.can_id, frame.data, frame.time)
        self._judge.heard(frame.time, frame.can_id, frame.data)

    def _turn(self) -> None:
        now = self._world.now
        self._world.after(_TURN_S, self._turn)
        self._core.on_time(now)
        for finding in self._core.take_findings():
            if isinstance(finding, Alarm):
                text = f"{finding.kind.value} {finding.source} {finding.message}"
                self._world.tell(f"witness {text}")
                self._judge.told(finding.source, finding.kind.value, now, finding.message)
        self._judge.look(now)


def _known(site: Site) -> Site:
    buses = [
        bus.model_copy(
            update={
                "node": [
                    node.model_copy(update={"mapping": _OWN_MAPPINGS.get(node.mapping, node.mapping)})
                    for node in bus.node
                ]
            }
        )
        for bus in site.bus
    ]
    return site.model_copy(update={"bus": buses})
