"""Outputs are commanded by their owner alone: what every way in says of every kind of object.

An I/O block without its vendor's file. Only some of its outputs are in an RPDO (CiA 401: 6200h:01, 6411h:01);
the others could be switched by an SDO.
"""

from __future__ import annotations

import ast
import itertools
from collections.abc import Callable
from pathlib import Path
from typing import Final

import pytest

from bridge.bustools.bystander import Standstill
from bridge.canopen.sdo import SdoChannel
from bridge.command import Action, Identity, Outcome, Request, Role, Source, WriteParameter
from bridge.node.parameters.run import run
from bridge.northbound.gateway.gateway_session import GatewaySession
from bridge.northbound.gateway.nets import net_of
from bridge.parameter import DriveParameters, Ledger, ParameterError, ParameterWritten
from bridge.parameter.write_effect import Effect, WriteVerdict, judge
from tests.support.bench import Bench
from tests.support.devices import IO_BLOCK, device_bench, io_block
from tests.support.process import REPOSITORY

MORE = '[[parameter]]\nname = "6423"\ntitle = "interrupt"\ndata_type = "uint8"\n'
SITE = """\
own_timeout_ms = 300
[bus.node.outputs]
control = "zenoh"
fieldbus_timeout_ms = 0
on_expiry = { lamp = 0 }
[zenoh]
"""
OBJECTS: Final = {
    # outputs that no RPDO carries, digital and analogue, and one that one carries
    "6200:02": Effect.COMMANDS,
    "6411:03": Effect.COMMANDS,
    "6200:01": Effect.COMMANDS,
    "A480:01": Effect.COMMANDS,
    # change polarity output: what was off is on
    "6202:01": Effect.SHAPES,
    "6446:01": Effect.SHAPES,
    # error mode, error value and filter mask
    "6206:01": Effect.MAKES_SAFE,
    "6207:01": Effect.MAKES_SAFE,
    "6208:01": Effect.MAKES_SAFE,
    "6443:01": Effect.MAKES_SAFE,
    "6444:01": Effect.MAKES_SAFE,
    # the maker's, of which nobody knows what it does
    "2110:01": Effect.MAY_MOVE,
    # heartbeat consumer, program control, store parameters
    "1016:01": Effect.BUS,
    "1F51:01": Effect.BUS,
    "1010:01": Effect.BUS,
    # analogue input global interrupt enable
    "6423:00": Effect.SETTING,
}
ANYBODY: Final = Identity(Source.ZENOH, "anonymous", sets_parameters=True)
OPERATORS: Final = {
    "zenoh": ANYBODY,
    "modbus": Identity(Source.MODBUS, "10.0.0.7", Role.OPERATOR, sets_parameters=True),
    "opc ua operator": Identity(Source.OPCUA, "ann", Role.OPERATOR),
    "page operator": Identity(Source.LOCAL, "ann#1", Role.OPERATOR),
}
ENGINEERS: Final = {
    "opc ua": Identity(Source.OPCUA, "eve", Role.ENGINEER),
    "page": Identity(Source.LOCAL, "eve#1", Role.ENGINEER),
}


class Block:
    """The node with its bridge; ``writes`` is how often an object was written."""

    def __init__(self, folder: Path, *, moving: bool) -> None:
        self.node = node = io_block()
        for name in OBJECTS:
            if name[:4] not in ("1016", "1010", "1F51"):
                node.put(name, 1, 0)
        self.bench: Bench = device_bench(folder, node, IO_BLOCK + MORE, SITE)
        self.bench.run(2.0)
        if moving:
            assert self.bench.ask(Action.WRITE, "shaft", ANYBODY, values={"valves": 0, "speed": 5}).ok
            assert self.bench.ask(Action.WRITE, "shaft", ANYBODY, values={"valves": 3}).ok
            self.bench.run(0.1)

    def downloads(self, name: str) -> int:
        index, sub = int(name[:4], 16), int(name[5:], 16)
        place = bytes((index & 0xFF, index >> 8, sub))
        frames = self.bench.sent(0x600 + 20)
        return sum(frame.data[0] & 0xE0 == 0x20 and frame.data[1:4] == place for frame in frames)


Way = Callable[[Block, str], None]


def by_request(identity: Identity) -> Way:
    """Zenoh, Modbus, OPC UA and the page submit this request to ``PlantView``."""

    def write(block: Block, name: str) -> None:
        outcomes: list[Outcome] = []
        request = Request(identity, "shaft", WriteParameter(name, "01", raw=True))
        block.bench.view.submit(request, outcomes.append)
        block.bench.run(0.3)
        assert len(outcomes) == 1

    return write


def by_gateway(identity: Identity) -> Way:
    """CiA 309-3: the line as a client sends it."""

    def write(block: Block, name: str) -> None:
        bench = block.bench
        net = net_of(bench.network.bus, 1, bench.plant.catalogue.nodes.values(), Path("tap"))
        session = GatewaySession(net, identity, bench.view.submit)
        line = f"[1] 1 20 w 0x{name[:4]} 0x{name[5:]} u8 1\r\n"
        session.receive(line.encode(), bench.now)
        bench.run(0.3)
        assert session.take_lines().startswith(b"[1] ")

    return write


def by_command_line(block: Block, name: str) -> None:
    """``drivebridge parameters write --force``, which asks the node itself whether an output is active."""
    node = block.bench.plant.nodes["shaft"]
    access = DriveParameters("shaft", "shaft", node.family, node.names, Ledger())
    (device,) = node.devices
    (outputs,) = device.commanded
    guard = Standstill(node.names, node.family, None, None, force=True, outputs=outputs.words)
    channel = SdoChannel(0x600 + 20, 0x580 + 20, 0.2)
    results: list[ParameterWritten | ParameterError] = []
    entry = node.names.resolve(name).as_bytes
    steps = access.write(entry, "01", block.bench.now, guard.gate)
    run(steps, lambda _: channel, lambda: block.bench.now, results.append)
    while frames := channel.take_frames():
        for frame in frames:
            block.bench.log.append(frame)
            block.bench.node.on_frame(frame, block.bench.now)
        for answer in block.bench.node.take_frames():
            if answer.can_id == channel.reply_id:
                channel.on_frame(answer)
    assert len(results) == 1


WAYS: Final[dict[str, tuple[Way, bool]]] = {
    **{name: (by_request(identity), False) for name, identity in OPERATORS.items()},
    **{name: (by_request(identity), True) for name, identity in ENGINEERS.items()},
    "gateway by tcp": (by_gateway(Identity(Source.LOCAL, "gateway-tcp", Role.OPERATOR)), False),
    "gateway": (by_gateway(Identity(Source.LOCAL, "gateway", Role.ENGINEER)), True),
    "command line": (by_command_line, True),
}


@pytest.mark.landing(5)
@pytest.mark.parametrize(("way", "moving"), list(itertools.product(WAYS, (False, True))))
def test_an_output_is_reached_by_no_way_but_its_owners(tmp_path: Path, way: str, *, moving: bool) -> None:
    write, is_engineer = WAYS[way]
    block = Block(tmp_path, moving=moving)
    for name, effect in OBJECTS.items():
        before = block.downloads(name)
        write(block, name)
        written = block.downloads(name) - before
        verdict = judge(effect, is_engineer=is_engineer, is_moving=moving)
        if verdict is not WriteVerdict.WRITTEN:
            assert not written, f"{name} is written by {way}: {verdict}"
        elif is_engineer or way == "zenoh":
            assert written == 1, f"{name} is not written by {way}"
    assert block.node.number("6200:02") == 0
    assert block.node.number("6411:03") == 0


def test_who_has_made_outputs_safe_another_way_has_their_stop_time_read_again(tmp_path: Path) -> None:
    block = Block(tmp_path, moving=False)
    by_request(ENGINEERS["page"])(block, "6207:01")
    point = block.bench.plant.image.read("shaft/supervision/worst_case_bridge_ms")
    assert point.reason.startswith("6207:01 was changed since boot")


WRITES: Final = {
    "bridge/node/parameters/run.py": "transfers of DriveParameters, which has the gate",
    "bridge/bustools/single.py": "`sdo write`, which asks Protection.why_forced",
    "bridge/bustools/open_channels.py": "1201h and up: the SDO servers of a node",
    "bridge/node/boot": "the boot-up: the site file, judged by check_moving",
}
"""The modules that write objects of nodes, each with what keeps it from moving anything."""
_ARGUMENTS: Final = 5
"""Of ``SdoChannel.write``."""


def _writes(tree: ast.AST) -> bool:
    """Whether a module calls ``SdoChannel.write``, or makes an ``SdoWrite`` for a dialogue."""
    for node in ast.walk(tree):
        match node:
            case ast.ImportFrom(module="bridge.canopen.dialogue"):
                if any(one.name == "SdoWrite" for one in node.names):
                    return True
            case ast.Call(func=ast.Attribute(attr="write")):
                if len(node.args) + len(node.keywords) >= _ARGUMENTS:
                    return True
            case _:
                pass
    return False


def test_no_module_writes_objects_of_nodes_past_the_gate() -> None:
    """A new way in comes through ``DriveParameters``, or gets its reason in ``WRITES``."""
    found: set[str] = set()
    for file in (REPOSITORY / "bridge").rglob("*.py"):
        path = file.relative_to(REPOSITORY).as_posix()
        if not path.startswith(("bridge/sim/", "bridge/canopen/")) and _writes(ast.parse(file.read_text())):
            found.add(next((one for one in WRITES if path.startswith(one)), path))
    assert found == set(WRITES)
