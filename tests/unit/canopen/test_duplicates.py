"""A node id that is used twice: told where it is so, and not where somebody only asks or is late."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.canopen.duplicate import DuplicateCheck
from bridge.canopen.frame import Frame
from tests.support.quick import Quick, quick_site

READ_1000 = bytes.fromhex("4000100000000000")
ANSWER_1000 = bytes.fromhex("4300100000000000")


def started(tmp_path: Path, *nodes: str, bus: str = "") -> Quick:
    quick = Quick(quick_site(tmp_path, nodes or [""], bus=bus))
    quick.run(3.0)
    quick.events.clear()
    return quick


def ask(quick: Quick) -> None:
    node = quick.core(1)
    node.wire.sdo[1].read(0x1000, 0, quick.now, lambda result: None)
    quick.network.touched(node)


# SDO answers


@pytest.mark.landing(12)
@pytest.mark.parametrize("retries", [0, 1, 3])
@pytest.mark.parametrize("delay_s", [0.3, 0.6, 0.99, 1.2])
def test_a_slow_node_is_no_duplicate(tmp_path: Path, retries: int, delay_s: float) -> None:
    quick = started(tmp_path, f"sdo_retries = {retries}")
    quick.nodes[1].delay_s = delay_s
    for _ in range(30):
        ask(quick)
        quick.run(1.7)
    assert not quick.told("twice")


@pytest.mark.parametrize("pause_s", [0.004, 0.5])
def test_another_client_is_no_duplicate(tmp_path: Path, pause_s: float) -> None:
    """A tool on the same bus reads what the bridge has just read."""
    quick = started(tmp_path)
    for _ in range(20):
        ask(quick)
        quick.run(pause_s)
        quick.receive(Frame(0x601, READ_1000))
        quick.receive(Frame(0x581, ANSWER_1000))
        quick.run(0.5)
    assert not quick.told("twice")


def test_a_twin_is_told_all_the_same(tmp_path: Path) -> None:
    quick = started(tmp_path)
    for _ in range(5):
        ask(quick)
        quick.run(0.003)
        quick.receive(Frame(0x581, ANSWER_1000))
        quick.run(0.5)
    assert quick.told("SDO requests were answered twice")


def test_the_period_that_the_node_keeps_is_the_one_that_counts() -> None:
    check = DuplicateCheck()
    check.period_s = 0.06
    assert not any(check.on_heartbeat(5, 0.06 * n) for n in range(200))


# the bridge's own id


@pytest.mark.parametrize(
    ("octet", "said"), [(0x00, "that it starts"), (0x7F, "pre-operational"), (0x05, "operational")]
)
def test_a_device_with_the_bridges_own_id_is_told_whatever_it_says(
    tmp_path: Path, octet: int, said: str
) -> None:
    quick = started(tmp_path)
    quick.receive(Frame(0x77F, bytes((octet,))))
    quick.run(0.2)
    [event] = quick.told("node 127, the bridge's own")
    assert f"used twice: another device said {said}" in event.message
    assert quick.value("bus/can0/duplicate_ids") == "127"


def test_a_bridge_without_a_heartbeat_has_no_id_of_its_own(tmp_path: Path) -> None:
    quick = started(tmp_path, bus="heartbeat_ms = 0")
    quick.receive(Frame(0x77F, b"\x7f"))
    quick.run(0.2)
    assert quick.value("bus/can0/unexpected_nodes") == "127"
