"""What one node sends and is sent: whether it carries what is commanded, and why not."""

from __future__ import annotations

from pathlib import Path

from bridge.canopen.frame import Frame
from bridge.drive.own_judgement import judge
from bridge.master.network import Network
from bridge.node.boot.actions import BootResult, DrivePlan, WordFacts
from bridge.node.error_control import Sign
from bridge.node.node_core import NodeCore
from bridge.text import Text, render
from tests.support.devices import IO_BLOCK, OUTPUTS, device_bench, io_block
from tests.support.nodes import device_plant
from tests.support.quick import Quick, quick_site

SERVICES = (
    (0x701, b"\0"),
    (0x701, b"\x05"),
    (0x701, b""),
    (0x081, bytes(8)),
    (0x581, bytes(8)),
)
"""Error control messages, an emergency message and an SDO answer of node 1."""


def why_not_carried(core: NodeCore) -> str:
    (one,) = core.node.commanded
    assert not core.wire.carries(one)
    return render(core.wire.why_left_out(one))


def test_outputs_without_an_rpdo_are_left_out(tmp_path: Path) -> None:
    plant = device_plant(tmp_path, IO_BLOCK, OUTPUTS)
    (core,) = Network(plant.site.bus[0], plant.side_of(plant.site.bus[0])).nodes
    assert why_not_carried(core) == "no RPDO of the node carries its outputs"


def test_outputs_that_the_boot_up_has_found_are_carried(tmp_path: Path) -> None:
    bench = device_bench(tmp_path, io_block(), IO_BLOCK, OUTPUTS)
    bench.run(2.0)
    (core,) = bench.network.nodes
    (outputs,) = core.node.commanded
    assert core.wire.carries(outputs)


def test_a_drive_that_has_not_been_found_is_left_out(tmp_path: Path) -> None:
    core = Quick(quick_site(tmp_path, 1)).core(1)
    assert why_not_carried(core) == "no PDOs of the drive can be used"


def test_the_reason_is_that_of_the_last_boot_up(tmp_path: Path) -> None:
    core = Quick(quick_site(tmp_path, 1)).core(1)
    (drive,) = core.node.drives
    told: list[str] = []
    for problem in (Text.of("boot.id_taken"), ""):
        plans = {drive.name: DrivePlan(problem=problem)}
        own = {drive.name: judge(drive.family, {}, core.node.bus, core.node.table)}
        words = {drive.name: WordFacts()}
        core.wire.connect(BootResult(drives=plans, own=own, words=words), 1.0)
        told.append(why_not_carried(core))
    assert told[0].startswith("no PDOs of the drive can be used: ")
    assert told[1] == "no PDOs of the drive can be used"


def test_an_emergency_message_that_is_too_short_is_rejected_with_the_reason(tmp_path: Path) -> None:
    quick = Quick(quick_site(tmp_path, 1))
    wire = quick.core(1).wire
    wire.services[0x081](Frame(0x081, b"\x10\x23", 1.0))
    assert wire.unfit.count == 1
    (event,) = quick.plant.events.take()
    assert event.message.endswith(": an emergency message has 8 bytes")


def test_what_an_error_control_message_says_is_given_back_and_of_others_nothing(tmp_path: Path) -> None:
    wire = Quick(quick_site(tmp_path, 1)).core(1).wire
    given = [wire.services[can_id](Frame(can_id, data, 1.0)) for can_id, data in SERVICES]
    assert given == [Sign.BOOT_UP, Sign.CHANGED, Sign.MALFORMED, None, None]


def test_a_node_uses_what_it_receives_and_sends_whatever_it_is(tmp_path: Path) -> None:
    wire = Quick(quick_site(tmp_path, 1)).core(1).wire
    assert all(wire.uses(can_id) for can_id in (0x601, 0x581, 0x701, 0x081))
    assert not wire.uses(0x602)
