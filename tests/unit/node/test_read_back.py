"""Whether the outputs of a node follow their stop: read back by SDO, or told by a TPDO of the node."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Final

import pytest

from bridge.command import Action
from bridge.command.audit import AuditEntry
from bridge.command.stop_check.state import LastStop
from bridge.condition.point_troubles import ImageReader, Rank, Trouble, of_node
from bridge.image import Quality
from bridge.project import load_project
from bridge.sim.catalogue import simulate_description
from tests.support import sites
from tests.support.bench import Bench
from tests.support.devices import DEVICES, IO_BLOCK, description_of, device_bench
from tests.support.output_block import (
    OTHER,
    Block,
    asked,
    block_bench,
    block_of,
    go,
    last_stop,
    nmt_stops,
    stop,
    told,
    why,
)

NONE, FORWARDED, FOLLOWED, IGNORED = LastStop
STOPPED: Final = "; NMT stop of shaft; it stays stopped until an operator starts or resets it"


def test_outputs_that_have_got_their_safe_values_have_followed(tmp_path: Path) -> None:
    bench = go(block_bench(tmp_path))
    assert last_stop(bench) is NONE
    entries: list[AuditEntry] = []
    bench.plant.audit.tell_to(entries.append)
    stop(bench, 0.05)
    assert (last_stop(bench), why(bench)) == (FOLLOWED, "")
    assert bench.value("shaft/supervision/follows") is True
    assert asked(bench) == ["6200:01", "6411:01", "6411:02"], "each once"
    ended = [entry for entry in entries if entry.action == "stop_ended"]
    assert [(one.target, one.ending.code) for one in ended] == [("shaft", "ok")]
    assert ended[0].ending.message == "after 0.010 s"
    assert told(bench) == []


def test_a_deaf_output_is_an_event_and_its_node_gets_nmt_stop(tmp_path: Path) -> None:
    bench = go(block_bench(tmp_path))
    block_of(bench).stuck["6200:01"] = 1, 0x81
    stop(bench, 0.2)
    assert (last_stop(bench), nmt_stops(bench)) == (FORWARDED, 0)
    assert why(bench) == "6200h:01 (valves) holds 81h instead of 00h"
    bench.run(0.1)
    message = (
        "ignores its stop: safe values are sent since 0.26 s, 6200h:01 (valves) holds 81h instead of 00h"
    )
    assert told(bench) == [(1000, message + STOPPED)]
    assert (last_stop(bench), bench.value("shaft/supervision/follows"), nmt_stops(bench)) == (
        IGNORED,
        False,
        1,
    )
    bench.run(5.0)
    assert (len(told(bench)), nmt_stops(bench)) == (1, 1)


def test_an_rpdo_that_is_switched_off_is_found(tmp_path: Path) -> None:
    """Whether the cause is a deaf RPDO, another master or a broken node does not matter."""
    bench = go(block_bench(tmp_path))
    block_of(bench).put("1401:01", 4, 1 << 31 | 0x314)
    stop(bench, 0.5)
    assert told(bench)[-1][1].startswith("ignores its stop: safe values are sent since 0.26 s, 6411h:0")


def test_a_silent_owner_leaves_what_holds_out_of_the_comparison(tmp_path: Path) -> None:
    """``hold`` speaks of silence (shared design, watchdog): the lamp may have any value then."""
    bench = go(block_bench(tmp_path))
    block_of(bench).stuck["6411:02"] = 2, 99
    bench.run(0.5)
    assert (last_stop(bench), asked(bench)) == (FOLLOWED, ["6200:01", "6411:01"])


def test_a_stop_by_somebody_gives_what_holds_a_value_too(tmp_path: Path) -> None:
    bench = go(block_bench(tmp_path))
    block_of(bench).stuck["6411:02"] = 2, 99
    stop(bench, 0.5)
    assert "6411h:02 (lamp) holds 0063h instead of 0000h" in told(bench)[-1][1]
    assert last_stop(bench) is IGNORED


def test_a_stop_after_the_owner_fell_silent_is_judged_by_itself(tmp_path: Path) -> None:
    bench = go(block_bench(tmp_path))
    block_of(bench).stuck["6411:02"] = 2, 3
    bench.run(0.5)
    assert last_stop(bench) is FOLLOWED
    stop(bench, 0.5)
    assert "6411h:02 (lamp) holds 0003h" in told(bench)[-1][1]


@pytest.mark.landing(3)
@pytest.mark.parametrize(
    ("prepare", "reason"),
    [
        (
            lambda block: block.refuses_reading.add(0x6200),
            "the node does not let 6200h:01 be read: attempt to read a write-only object (06010001h)",
        ),
        (lambda block: block.mute.add(0x6200), "6200h:01 cannot be read: no valid answer"),
        (
            lambda block: block.stuck.update({"6200:01": (2, 0)}),
            "6200h:01 cannot be read: 2 bytes where 8 bits belong",
        ),
    ],
)
def test_what_cannot_be_read_leaves_the_stop_forwarded_with_the_reason(
    tmp_path: Path, prepare: Callable[[Block], None], reason: str
) -> None:
    bench = block_bench(tmp_path)
    prepare(block_of(bench))
    stop(go(bench), 8.0)
    assert (last_stop(bench), why(bench)) == (FORWARDED, reason)
    assert bench.value("shaft/supervision/follows") is True
    assert (told(bench), nmt_stops(bench)) == ([], 0)


def test_four_bytes_without_a_size_are_the_value_and_zeros(tmp_path: Path) -> None:
    """An expedited upload without a size (CiA 301 §7.2.4.3.6)."""
    bench = go(block_bench(tmp_path))
    block_of(bench).stuck["6200:01"] = 4, 0
    assert last_stop(stop(bench, 0.1)) is FOLLOWED
    go(bench)
    block_of(bench).stuck["6200:01"] = 4, 0x100
    assert last_stop(stop(bench, 0.5)) is FORWARDED, "no valve has nine bits"


def test_nothing_is_asked_while_no_stop_is_owed(tmp_path: Path) -> None:
    bench = go(block_bench(tmp_path))
    for _ in range(40):
        bench.ask(Action.WRITE, "shaft", values={"valves": 0x81})
        bench.run(0.05)
    assert asked(bench) == []
    stop(bench, 0.1)
    bench.log.clear()
    bench.run(10.0)
    assert asked(bench) == []


def test_outputs_that_are_active_when_the_bridge_starts_are_found(tmp_path: Path) -> None:
    """What is there may have been set by another master, and stays where the node does not take our frame."""
    bench = block_bench(tmp_path, prepare=lambda block: block.stuck.update({"6200:01": (1, 0x40)}))
    assert last_stop(bench) is IGNORED
    assert "6200h:01 (valves) holds 40h instead of 00h" in told(bench)[-1][1]
    assert bench.value("shaft/node/state") == 4, "stopped"


def test_with_report_nothing_is_done_and_it_may_follow_after_all(tmp_path: Path) -> None:
    bench = go(block_bench(tmp_path, outputs='on_ignored_stop = "report"'))
    block = block_of(bench)
    block.stuck["6200:01"] = 1, 0x81
    stop(bench, 1.0)
    assert told(bench)[-1][1].endswith("holds 81h instead of 00h; reported only (on_ignored_stop)")
    assert (nmt_stops(bench), bench.value("shaft/node/state")) == (0, 2)
    del block.stuck["6200:01"]
    bench.run(3.0)
    assert (last_stop(bench), bench.value("shaft/supervision/follows")) == (FOLLOWED, True)
    assert told(bench)[-1] == (300, "follows its stop after all: its outputs are as they are sent")


def test_with_reset_node_it_is_reset_once_and_stopped_if_it_does_not_help(tmp_path: Path) -> None:
    bench = go(block_bench(tmp_path, outputs='on_ignored_stop = "reset_node"'))
    block_of(bench).stuck["6200:01"] = 1, 0x81
    stop(bench, 0.5)
    assert told(bench)[-1][1].endswith("instead of 00h; NMT reset node of shaft")
    bench.run(5.0)
    assert told(bench)[-1][1].endswith(f"instead of 00h{STOPPED}")
    assert len(told(bench)) == 2


def test_outputs_that_nobody_commands_are_only_reported(tmp_path: Path) -> None:
    block = Block()
    block.stuck["6200:01"] = 1, 1
    bench = device_bench(tmp_path, block, IO_BLOCK)
    bench.run(3.0)
    assert told(bench)[-1][1].endswith("reported only (on_ignored_stop)")


def test_the_site_file_gives_the_bound(tmp_path: Path) -> None:
    bench = go(block_bench(tmp_path, outputs="ignored_stop_ms = 900"))
    block_of(bench).stuck["6200:01"] = 1, 0x81
    assert last_stop(stop(bench, 0.85)) is FORWARDED
    bench.run(0.1)
    assert last_stop(bench) is IGNORED


@pytest.mark.landing(2)
@pytest.mark.parametrize("more", ["", "sync_period_ms = 10"])
def test_the_simulated_block_of_an_eds_follows(tmp_path: Path, more: str) -> None:
    shutil.copy(DEVICES / "io16.eds", tmp_path)
    keys = '[bus.node.outputs]\ncontrol = "modbus"\nfieldbus_timeout_ms = 200'
    block = sites.node(name="io", node_id=21, mapping="eds:io16.eds", more=keys)
    project = load_project(sites.write(tmp_path, sites.bus(block, more=more), sites.modbus()))
    node = simulate_description(description_of("io16.eds"), 21)
    families = project.families
    bench = Bench(project.site, family=families["eds:io16.eds"], mapping="eds:io16.eds", node=node)
    bench.run(5.0)
    for value in (0, 3):
        assert bench.ask(Action.WRITE, "io", values={"digital_outputs_1_to_8": value}).forwarded
        bench.run(0.05)
    assert bench.value("io/supervision/last_stop") == NONE
    bench.run(0.5)
    assert bench.value("io/supervision/last_stop") == FOLLOWED
    assert [event.message for event in bench.events if event.severity == 1000] == []


# by a TPDO


def with_tpdo(event_ms: int) -> Callable[[Block], None]:
    return lambda block: block.pdo("tpdo", 2, 0x280, ["6200:01/8", "6411:01/16"], event_ms=event_ms)


def test_a_tpdo_that_brings_the_outputs_counts_and_they_are_not_asked_for(tmp_path: Path) -> None:
    bench = go(block_bench(tmp_path, prepare=with_tpdo(50)))
    stop(bench, 0.2)
    assert (last_stop(bench), asked(bench)) == (FOLLOWED, ["6411:02"]), "no TPDO has the lamp"


def test_a_deaf_output_is_found_by_its_tpdo(tmp_path: Path) -> None:
    """The bound is that of a drive: three deadlines of the TPDO (75 ms each), and 260 ms."""
    bench = go(block_bench(tmp_path, prepare=with_tpdo(50)))
    block_of(bench).stuck["6411:01"] = 2, -25 & 0xFFFF
    stop(bench, 0.4)
    assert last_stop(bench) is FORWARDED
    bench.run(0.3)
    assert "6411h:01 (speed) holds FFE7h instead of 0032h" in told(bench)[-1][1]
    assert "6411:01" not in asked(bench)


def test_outputs_that_change_by_themselves_are_found_by_their_tpdo(tmp_path: Path) -> None:
    bench = go(block_bench(tmp_path, prepare=with_tpdo(50)))
    stop(bench, 2.0)
    assert last_stop(bench) is FOLLOWED
    block_of(bench).stuck["6200:01"] = 1, 2
    bench.run(0.5)
    (_, message) = told(bench)[-1]
    assert message.startswith("has other outputs than it is sent: safe values are sent for ")
    assert "6200h:01 (valves) holds 02h instead of 00h" in message


def test_a_tpdo_on_change_alone_may_say_nothing_and_so_they_are_asked_for(tmp_path: Path) -> None:
    bench = go(block_bench(tmp_path, prepare=with_tpdo(0)))
    block_of(bench).stuck["6200:01"] = 1, 0x81
    stop(bench, 0.5)
    assert last_stop(bench) is IGNORED
    assert "6200:01" in asked(bench)


def test_a_tpdo_that_brings_outputs_alone_needs_no_input(tmp_path: Path) -> None:
    bench = block_bench(tmp_path, prepare=with_tpdo(50))
    assert bench.value("shaft/node/boot_status") == "ok; 1017h was 0, is 66 now"
    assert bench.plant.image.read("shaft/input/inputs").quality is Quality.GOOD
    block_of(bench).put("1801:01", 4, 1 << 31 | 0x294)
    bench.ask(Action.RESET_COMMUNICATION, "shaft", OTHER)
    bench.run(3.0)
    assert str(bench.value("shaft/node/boot_status")).startswith("ok")


# what rests on it


def test_deaf_outputs_are_a_danger_of_their_node(tmp_path: Path) -> None:
    bench = go(block_bench(tmp_path, outputs='on_ignored_stop = "report"'))
    assert not list(of_node(ImageReader(bench.plant.image), "shaft"))
    block_of(bench).stuck["6200:01"] = 1, 0x81
    stop(bench, 0.5)
    assert list(of_node(ImageReader(bench.plant.image), "shaft")) == [
        Trouble(Rank.DANGER, "outputs_ignore_stop", "shaft")
    ]


def test_a_stop_that_has_been_seen_is_owed_no_more(tmp_path: Path) -> None:
    bench = go(block_bench(tmp_path))
    (node,) = bench.network.nodes
    assert node.leaving.owed.is_open
    stop(bench, 0.2)
    assert not node.leaving.owed.is_open


def test_a_stop_that_cannot_be_read_stays_owed(tmp_path: Path) -> None:
    bench = block_bench(tmp_path)
    block_of(bench).refuses_reading.add(0x6200)
    stop(go(bench), 5.0)
    (node,) = bench.network.nodes
    assert node.leaving.owed.is_open
