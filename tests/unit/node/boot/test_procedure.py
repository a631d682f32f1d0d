"""Boot-up after CiA 302-2, step by step, on a virtual clock with a simulated SK TU4-CAO."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.canopen import abort
from bridge.canopen.frame import Frame
from bridge.command.drive_link import NodeState
from bridge.image import Quality
from bridge.node.boot.error_status import HINTS
from bridge.text import render
from tests.support.bench import BEGIN_S, Bench, write_site

START = Frame(0, b"\x01\x05")


def booted(tmp_path: Path, *, node: str = "", drive: str = "", bus: str = "") -> Bench:
    bench = Bench(write_site(tmp_path, node=node, drive=drive, bus=bus))
    bench.run(1.5)
    return bench


def status(bench: Bench) -> str:
    return str(bench.value("conveyor/node/boot_status"))


def was_started(bench: Bench) -> bool:
    return START in [frame._replace(time=0.0) for frame in bench.log]


@pytest.mark.landing(5)
@pytest.mark.parametrize(
    ("rule", "letter", "where"),
    [
        ("device_type = 0x00020192", "C", "1000h:00"),
        ("vendor_id = 0xB9", "D", "1018h:01"),
        ("product_code = 0x0BADBEEF", "M", "1018h:02"),
        ("revision = 0x0BADBEEF", "N", "1018h:03"),
        ("serial = 0x0BADBEEF", "O", "1018h:04"),
    ],
)
def test_another_device_is_named_with_letter_object_expected_and_read(
    tmp_path: Path, rule: str, letter: str, where: str
) -> None:
    bench = booted(tmp_path, node=f"[bus.node.identity]\n{rule}")
    assert status(bench).startswith(f"{letter}: {where} is ")
    assert "expected" in status(bench)
    assert render(HINTS[letter]) in status(bench)
    assert bench.plant.drives["conveyor/fu1"].quality is Quality.CONFIG_ERROR
    assert not was_started(bench)


def test_a_mask_leaves_out_what_may_differ(tmp_path: Path) -> None:
    """STÖBER's product code is the rated power: only some of its bits say which device it is."""
    rule = "[bus.node.identity]\nproduct_code = 0x0BADBE00\nproduct_code_mask = 0"
    assert status(booted(tmp_path, node=rule)).startswith("ok")


def test_name_and_software_version_are_shown(tmp_path: Path) -> None:
    bench = booted(tmp_path)
    assert bench.value("conveyor/fu1/identity/device_name") == "SK TU4-CAO"
    assert bench.value("conveyor/node/software_version") != ""


def test_a_node_that_does_not_answer_is_b_and_says_what_to_look_at(tmp_path: Path) -> None:
    bench = Bench(write_site(tmp_path), present=False)
    bench.run(3.0)
    assert status(bench).startswith("B: 1000h:00: no valid answer")
    assert render(HINTS["B"]) in status(bench)


def test_the_node_is_heard_before_it_is_started(tmp_path: Path) -> None:
    bench = booted(tmp_path)
    start = next(place for place, frame in enumerate(bench.log) if frame._replace(time=0.0) == START)
    assert any(frame.can_id == 0x705 and frame.data == b"\x7f" for frame in bench.log[:start])


def test_a_node_whose_heartbeat_does_not_come_is_k(tmp_path: Path) -> None:
    bench = Bench(write_site(tmp_path))
    bench.deaf_to = frozenset((0x705,))
    bench.run(2.5)
    assert status(bench).startswith("K: nothing was heard while waiting for heartbeat")
    assert not was_started(bench)


@pytest.mark.landing(8)
@pytest.mark.parametrize("answers", range(1, 30, 4))
def test_a_time_out_has_the_letter_of_its_step_and_the_node_is_lost(tmp_path: Path, answers: int) -> None:
    bench = Bench(write_site(tmp_path))
    receive, left = bench.receive, answers

    def receive_some(*frames: Frame) -> None:
        nonlocal left
        for frame in frames:
            left -= frame.can_id == 0x585
            if left >= 0:
                receive(frame)

    bench.receive = receive_some
    while not bench.network.nodes[0].has_concluded:
        bench.run(0.1)
    assert bench.now < BEGIN_S + 5.0, "not every object that nothing needs is waited for"
    assert status(bench)[:3] in ("D: ", "M: ", "N: ", "O: ", "J: ")
    assert abort.text(abort.TIMED_OUT) in status(bench)
    assert bench.network.nodes[0].state is NodeState.LOST
    assert not was_started(bench)
