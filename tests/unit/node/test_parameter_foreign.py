"""Backups of a device that is not ours: canopen's local node with the EDS of a CiA 402 drive."""

from __future__ import annotations

from collections.abc import Callable

import canopen

from bridge.bustools.parameter import ParameterTask
from bridge.canopen.frame import Frame
from bridge.config import NodeTable
from bridge.image import Value
from bridge.mapping import load_family
from bridge.mapping.loader import mappings_dir
from bridge.parameter import DriveParameters, Ledger, Names, ParameterError, backups
from bridge.parameter.factory import described, factory
from tests.support.gates import ENGINEER_AT_REST

FAMILY = load_family("cia402/velocity")
EDS = mappings_dir() / "cia402" / "cia402.eds"
NODE = NodeTable.model_validate(
    {"name": "fan", "id": 8, "mapping": "cia402/velocity", "drive": [{"slot": FAMILY.slot[0].name}]}
)


class ForeignNode(canopen.Network):
    """Answers what is asked of it at once, without a bus."""

    def __init__(self) -> None:
        super().__init__()
        self.sent: list[tuple[int, bytes]] = []
        self.node = canopen.LocalNode(NODE.id, str(EDS))
        self.add_node(self.node)

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        del remote
        self.sent.append((can_id, bytes(data)))

    def carry_out(self, make: Callable[[float], backups.Steps]) -> ParameterError | None:
        task = ParameterTask(NODE, FAMILY, FAMILY.slot[0], make, 1.0)
        while not task.is_finished(1.0):
            frames = task.take_frames()
            assert frames, "it waits for an answer that does not come"
            for frame in frames:
                self.notify(frame.can_id, bytearray(frame.data), 0.0)
            sent, self.sent = self.sent, []
            for can_id, data in sent:
                task.on_frame(Frame(can_id, data, 1.0))
        return task.result


def test_a_foreign_drive_is_backed_up_compared_with_its_factory_settings_and_restored() -> None:
    device = ForeignNode()
    device.node.set_data(0x1018, 4, (4711).to_bytes(4, "little"))
    access = DriveParameters("fan/drive", "fan", FAMILY, Names(FAMILY), Ledger())
    found = backups.Backup()

    def read(now: float) -> backups.Steps:
        yield from backups.identify(found.identity)
        yield from backups.back_up(access, found, now)
        yield from backups.read_objects(access, described(EDS, access.names), found, now)

    assert device.carry_out(read) is None
    assert found.identity["serial"] == 4711
    values: dict[str, Value] = {**found.values, **found.objects}
    defaults = factory(EDS, access.names, NODE.id)
    compared = backups.Comparison()
    backups.compare_sets(
        access.names, values, {name: defaults[name] for name in defaults if name in values}, compared
    )
    assert compared.same
    assert not compared.differences

    place = access.names.resolve("6048:01").address
    name = access.names.at(place).name
    assert name in values
    access.forget()
    done = backups.Restored()
    changed = {**values, name: 1234}
    assert device.carry_out(lambda now: backups.restore(access, changed, done, now, ENGINEER_AT_REST)) is None
    assert done.error is None, done.error
    assert [one.reading.entry.name for one in done.written] == [name]
    assert device.node.get_data(place.index, place.sub)[:2] == (1234).to_bytes(2, "little")
