"""A plant with its Modbus units, on a virtual clock: no bus, no socket, no waiting."""

from __future__ import annotations

import struct
from collections.abc import Sequence

from bridge.command import Drive, Identity, Plant, Source
from bridge.command.drive_link import NodeState
from bridge.config import WordOrder
from tests.support import sites
from tests.support.node_states import node_goes, run_timers
from tests.support.views import dispatcher_of, view_of

_OF_FU3 = "fieldbus_timeout_writable = true\nstop_by_anyone = false"
SITE = sites.site(
    sites.bus(
        sites.node(
            sites.drive("fu1", "modbus", 200, "unit_id = 1\nparameters = { P105 = 50.0 }"),
            sites.drive("fu2", "opcua", 200, f"unit_id = 2\n{sites.SCALED}"),
            sites.drive("fu3", "modbus", 200, "unit_id = 9\n" + _OF_FU3),
            more="hold_ms = 2000",
        )
    ),
    sites.modbus(0),
)

PLC = Identity(Source.MODBUS, "10.0.0.5", address="10.0.0.5:40001")
OTHER_PLC = Identity(Source.MODBUS, "10.0.0.6", address="10.0.0.6:40001")

SWITCH_ON_INHIBITED, READY, ENABLED = 0x0240, 0x0231, 0x0237


def make_plant() -> Plant:
    return sites.plant_of(SITE)


class Rig:
    """``fu1`` (unit 1) is ours; ``fu2`` (2) belongs to OPC UA; ``fu3`` (9) has no scale, takes a time
    and is stopped by its owner alone."""

    def __init__(self, word_order: WordOrder = "ABCD") -> None:
        self.plant = make_plant()
        self.now = 100.0
        self.view = view_of(self.plant, lambda: self.now)
        self.dispatcher = dispatcher_of(self.plant, lambda: self.now, word_order, self.view)
        self.fu1 = self.plant.drives["conveyor/fu1"]

    def node(self, state: NodeState) -> None:
        node_goes(self.plant, self.plant.nodes["conveyor"], state, self.now)

    def runs(self, *words: int, drive: str = "fu1") -> None:
        """The node is operational and the drive sends these words, the status word first."""
        self.node(NodeState.OPERATIONAL)
        self.drive(drive).on_process_data([*words, 0, 0, 0, 0][:4], self.now)

    def drive(self, name: str) -> Drive:
        return self.plant.drives[f"conveyor/{name}"]

    def pass_time(self, seconds: float) -> None:
        self.now += seconds
        run_timers(self.plant, self.now)

    def ask(self, pdu: bytes | str, unit: int = 1, caller: Identity = PLC) -> bytes:
        """The answer to one request PDU, which may be given in hexadecimal."""
        raw = bytes.fromhex(pdu) if isinstance(pdu, str) else pdu
        answers: list[bytes] = []
        self.dispatcher.handle(unit, raw, caller, answers.append)
        assert len(answers) == 1
        return answers[0]

    def read(self, function: int, start: int, count: int, unit: int = 1, caller: Identity = PLC) -> list[int]:
        """The registers, or -code where the read was refused."""
        answer = self.ask(struct.pack(">BHH", function, start, count), unit, caller)
        if answer[0] & 0x80:
            assert answer[0] == function | 0x80
            return [-answer[1]]
        assert answer[:2] == bytes((function, 2 * count))
        return list(struct.unpack(f">{count}H", answer[2:]))

    def read_bits(self, function: int, start: int, count: int, unit: int = 1) -> list[int]:
        answer = self.ask(struct.pack(">BHH", function, start, count), unit)
        if answer[0] & 0x80:
            return [-answer[1]]
        packed = int.from_bytes(answer[2:], "little")
        return [packed >> i & 1 for i in range(count)]

    def write(self, start: int, *words: int, unit: int = 1, caller: Identity = PLC) -> int:
        """FC16; 0 or the exception code."""
        count = len(words)
        answer = self.ask(struct.pack(f">BHHB{count}H", 16, start, count, 2 * count, *words), unit, caller)
        if answer[0] == 0x90:
            return answer[1]
        assert answer == struct.pack(">BHH", 16, start, count)
        return 0

    @property
    def sent(self) -> Sequence[int]:
        """Process data that the bus gets for fu1."""
        return self.fu1.channel.output.words


def float_words(value: float) -> tuple[int, int]:
    return struct.unpack(">HH", struct.pack(">f", value))
