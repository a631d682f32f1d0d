"""Several SDO servers of one node: opened at boot, used beside each other, each for its own drive."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.base.errors import FileFaults
from bridge.canopen import abort
from bridge.canopen.frame import Frame
from bridge.canopen.nmt import NmtCommand
from bridge.canopen.sdo import Result, SdoError
from bridge.command import Identity, ReadParameter, Request, Source
from bridge.mapping import Family, load_family
from bridge.mapping.model import SdoServer
from bridge.mapping.site_families import load_site_and_families
from bridge.node.boot import BootError, BootResult, BootStep, SdoRead, SdoWrite, SendNmt
from bridge.node.boot.sdo_servers import open_sdo_servers
from tests.support import sites
from tests.support.bench import Bench, write_site

OPENED = 'sdo_channels = [2]\nsupervision = "none"'


def bench_with(folder: Path, node: str) -> Bench:
    bench = Bench(write_site(folder, node=node), present=False)
    bench.node.drives[1].parameters.commission(105, 87.0)
    bench.power_on()
    bench.run(2.0)
    return bench


def full_of(bench: Bench, drive: str) -> float:
    return bench.plant.drives[drive].channel.meanings.scales["command/frequency"].full


def test_the_second_drives_own_maximum_frequency_is_read_over_its_own_channel(tmp_path: Path) -> None:
    """BU 2500 §6.4: SDO2, at 340h and 2C0h + node id, reaches FU2."""
    bench = bench_with(tmp_path, OPENED)
    assert full_of(bench, "conveyor/fu2") == 87.0
    assert full_of(bench, "conveyor/fu1") == 50.0
    status = str(bench.value("conveyor/node/boot_status"))
    assert "SDO channel 2 opened at 345h/2C5h" in status
    assert "fu2: P105 is 87 Hz in the drive, 50 in the site file; the drive's counts" in status


@pytest.mark.landing
def test_without_the_channel_the_site_file_counts(tmp_path: Path) -> None:
    bench = bench_with(tmp_path, 'supervision = "none"')
    assert full_of(bench, "conveyor/fu2") == 50.0
    assert not bench.sent(0x345), "the channel is off at factory, and nobody asked for it"


def test_a_channel_that_is_open_is_not_written_again(tmp_path: Path) -> None:
    bench = bench_with(tmp_path, OPENED)
    writes = [frame for frame in bench.sent(0x605) if frame.data[:3].hex() == "230112"]
    assert [frame.data[3] for frame in writes] == [1, 2]
    bench.receive(Frame(0x705, b"\0"))
    bench.run(2.0)
    again = [frame for frame in bench.sent(0x605) if frame.data[:3].hex() == "230112"]
    assert len(again) == 2
    asked = [frame.data[:4].hex() for frame in bench.sent(0x345)]
    assert asked[0] == asked[len(asked) // 2] == "40012200", "and P513 has been read first a second time"


def test_a_drive_that_is_away_leaves_the_others_in_service(tmp_path: Path) -> None:
    bench = Bench(write_site(tmp_path, node=OPENED), present=False)
    bench.node.drop_drive("fu2")
    bench.power_on()
    bench.run(2.0)
    assert full_of(bench, "conveyor/fu2") == 50.0
    assert str(bench.value("conveyor/node/boot_status")).startswith("ok")
    names = [f"{drive}/supervision/sdo_abort_code" for drive in bench.plant.drives]
    codes = [bench.value(name) for name in names]
    assert codes == [0, 0], "what the bridge itself was refused is nothing that a client asked for"
    reader = Request(Identity(Source.MODBUS, "10.0.0.1"), "conveyor/fu2", ReadParameter("P102"))
    bench.view.submit(reader, lambda outcome: None)
    bench.run(1.0)
    assert [bench.value(name) for name in names] == [0, 0x0606_0000]


def test_both_channels_of_a_node_are_asked_at_the_same_time(tmp_path: Path) -> None:
    bench = bench_with(tmp_path, OPENED)
    core = bench.network.nodes[0]
    results: list[Result] = []
    before = len(bench.log)
    for number in (1, 2):
        core.wire.sdo[number].read(0x2069, 1, bench.now, results.append)
    bench.network.touched(core)
    bench.master.pump()
    assert [frame.can_id for frame in bench.log[before : before + 2]] == [0x605, 0x345]
    bench.run(0.01)
    assert results == [(500).to_bytes(2, "little"), (870).to_bytes(2, "little")]


def test_a_node_that_is_lost_ends_the_transfers_of_all_its_channels(tmp_path: Path) -> None:
    bench = bench_with(tmp_path, OPENED)
    core = bench.network.nodes[0]
    results: list[Result] = []
    bench.cut = True
    for number in (1, 2):
        core.wire.sdo[number].read(0x2069, 1, bench.now, results.append)
    core.bus_is_gone(bench.now)
    assert [type(result) for result in results] == [SdoError, SdoError]


def same_as_first() -> Family:
    """The NORD family as if its SDO2 reached what SDO1 reaches, as Lenze's does."""
    family = load_family("nord/sk-tu4-cao")
    servers = [server.model_copy(update={"slot": None}) for server in family.sdo]
    return family.model_copy(update={"sdo": servers})


@pytest.mark.landing
def test_polls_take_a_channel_of_their_own_where_one_reaches_the_same(tmp_path: Path) -> None:
    bench = Bench(write_site(tmp_path, node=OPENED), family=same_as_first())
    bench.run(2.0)
    polled = {poll.object.index.to_bytes(2, "little") for poll in same_as_first().poll}
    assert polled <= {frame.data[1:3] for frame in bench.sent(0x345)}
    assert polled.isdisjoint({frame.data[1:3] for frame in bench.sent(0x605)})


def test_polls_stay_on_the_first_channel_where_the_others_reach_a_drive_only(tmp_path: Path) -> None:
    bench = bench_with(tmp_path, OPENED)
    before = len(bench.sent(0x605))
    bench.run(3.0)
    assert len(bench.sent(0x605)) > before
    polled = {poll.object.index.to_bytes(2, "little") for poll in load_family("nord/sk-tu4-cao").poll}
    assert polled.isdisjoint({frame.data[1:3] for frame in bench.sent(0x345)})


def test_retries_are_those_of_the_site_file(tmp_path: Path) -> None:
    bench = bench_with(tmp_path, 'supervision = "none"\nsdo_retries = 2\nsdo_timeout_ms = 50')
    results: list[Result] = []
    bench.cut = True
    before = len(bench.sent(0x605))
    core = bench.network.nodes[0]
    core.wire.sdo[1].read(0x2069, 1, bench.now, results.append)
    bench.network.touched(core)
    bench.run(0.2)
    asked = [frame for frame in bench.sent(0x605)[before:] if frame.data[:4].hex() == "40692001"]
    assert len(asked) == 3
    assert isinstance(results[0], SdoError)
    assert results[0].code == abort.TIMED_OUT


def test_answers_to_what_nobody_asked_are_counted_where_the_user_sees_it(tmp_path: Path) -> None:
    bench = bench_with(tmp_path, OPENED)
    before = bench.number("conveyor/node/rejected_frames")
    bench.receive(Frame(0x585, bytes.fromhex("60662001 00000000")), Frame(0x2C5, bytes(3)))
    bench.run(0.2)
    assert bench.number("conveyor/node/rejected_frames") == before + 2


def test_a_channel_that_the_family_does_not_have_is_a_fault(tmp_path: Path) -> None:
    node = sites.node(sites.drive("fu1", "none", 0), more="sdo_channels = [2, 5, 2]")
    path = sites.write(tmp_path, sites.bus(node))
    with pytest.raises(FileFaults) as caught:
        load_site_and_families(path)
    messages = [fault.message for fault in caught.value.faults]
    assert messages == ["SK TU4-CAO has no SDO channel 5", "SDO channel 2 is there twice"]
    assert caught.value.faults[0].hint == "it has 2, 3, 4"


# opening, object by object


class Opening:
    """The steps of opening one server of node 4, answered from ``objects``."""

    def __init__(self, folder: Path, server: SdoServer, objects: dict[tuple[int, int], int]) -> None:
        site = write_site(folder, node=f"sdo_channels = [{server.number}]")
        bench = Bench(site, present=False)
        node = bench.plant.nodes["conveyor"]
        node.family = load_family("nord/sk-tu4-cao").model_copy(update={"sdo": [server]})
        self.objects = objects
        self.writes: list[str] = []
        self.nmt: list[NmtCommand] = []
        self.result = BootResult()
        steps = open_sdo_servers(node, self.result)
        answer: bytes | None = None
        while True:
            try:
                action = steps.send(answer)
            except StopIteration:
                return
            answer = None
            match action:
                case SdoRead(index, sub):
                    answer = self.objects[index, sub].to_bytes(4, "little")
                case SdoWrite(index, sub, data):
                    self.writes.append(f"{index:04X}:{sub} {data[::-1].hex().upper()}")
                    if (index, sub) in self.objects and self.objects[index, sub] >= 0:
                        self.keep(index, sub, int.from_bytes(data, "little"))
                case SendNmt(command):
                    self.nmt.append(command)
                case BootStep():
                    pass
                case _:
                    raise AssertionError(action)

    def keep(self, index: int, sub: int, value: int) -> None:
        self.objects[index, sub] = value


LENZE_SDO2 = SdoServer(number=2, request=0x640, reply=0x5C0)


def test_lenze_sdo2_is_opened_by_clearing_bit_31(tmp_path: Path) -> None:
    """EDS84DMOTCAN §9.1: 1201h:1 and :2, 640h and 5C0h + node id."""
    opening = Opening(tmp_path, LENZE_SDO2, {(0x1201, 1): 0x8000_0645, (0x1201, 2): 0x8000_05C5})
    assert opening.writes == ["1201:1 00000645", "1201:2 000005C5"]
    assert opening.nmt == []


def test_a_channel_in_use_elsewhere_is_switched_off_before_it_moves(tmp_path: Path) -> None:
    """EDS84DMOTCAN §8.3: disable, change, enable."""
    opening = Opening(tmp_path, LENZE_SDO2, {(0x1201, 1): 0x0000_0611, (0x1201, 2): 0x0000_05C5})
    assert opening.writes == ["1201:1 80000611", "1201:1 00000645"]


def test_stoeber_takes_new_sdo_channels_after_stopped(tmp_path: Path) -> None:
    """STÖBER CAN 5000 §7.2: SDO channels change after Stopped and Pre-Operational; SDO3 at 640h, 5C0h."""
    sdo3 = SdoServer(number=3, request=0x640, reply=0x5C0, slot="fu3", after_stop=True)
    objects = {(0x1202, 1): 0x8000_0640, (0x1202, 2): 0x8000_05C0}
    assert Opening(tmp_path, sdo3, objects).nmt == [NmtCommand.STOP, NmtCommand.ENTER_PRE_OPERATIONAL]
    assert Opening(tmp_path, sdo3, objects).nmt == [], "it is open already"


def test_a_node_that_does_not_keep_the_channel_says_so_by_the_error_letter(tmp_path: Path) -> None:
    class Forgetful(Opening):
        def keep(self, index: int, sub: int, value: int) -> None: ...

    with pytest.raises(BootError, match=r"J: 1201h:01 is 80000645h, expected 00000645h"):
        Forgetful(tmp_path, LENZE_SDO2, {(0x1201, 1): 0x8000_0645, (0x1201, 2): 0x8000_05C5})
