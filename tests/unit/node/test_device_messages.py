"""What a node that is no drive says by itself, and whom its parameters are asked of."""

from __future__ import annotations

from pathlib import Path

from bridge.command import EventKind
from bridge.northbound.gateway.nets import net_of
from tests.support.devices import device_bench, encoder


def test_its_emergencies_are_events(tmp_path: Path) -> None:
    node = encoder()
    bench = device_bench(tmp_path, node)
    bench.run(1.0)
    for code in ("30 81", "00 00"):
        node.emcy(bytes.fromhex(f"{code} 11 00 00 00 00 00"))
        bench.run(0.1)
    told = [one for one in bench.events if one.kind is EventKind.EMERGENCY]
    assert [(one.source, one.severity) for one in told] == [("shaft", 700), ("shaft", 100)]
    assert told[0].message.startswith("emergency 8130h: ")
    assert told[1].message == "emergency 0000h: no fault"


def test_the_gateway_asks_the_node_itself(tmp_path: Path) -> None:
    bench = device_bench(tmp_path, encoder())
    (node,) = bench.plant.nodes.values()
    assert net_of(node.bus, 1, [node.spec], Path("tap")).nodes == {20: ("shaft", "shaft")}
