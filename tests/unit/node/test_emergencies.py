"""Emergency messages of a node: each to the drive it is about, or an event where there is none."""

from __future__ import annotations

import json

import pytest

from bridge.canopen.frame import Frame
from bridge.command import Event
from bridge.node.emergencies import Emergencies
from tests.support import sites


class Case:
    def __init__(self, *slots: str, mapping: str = sites.FAMILY) -> None:
        drives = [sites.drive(slot, "none", 0, "") for slot in slots]
        text = sites.site(sites.bus(sites.node(*drives, mapping=mapping)))
        self.plant = sites.plant_of(text, mapping)
        self.rejected = 0
        self.about: list[str] = []
        self.emergencies = Emergencies(
            self.plant.nodes["conveyor"], self.plant.side_of(self.plant.site.bus[0])
        )

    def comes(self, data: str, time: float = 10.0) -> None:
        concerned = self.emergencies.on_frame(Frame(0x085, bytes.fromhex(data), time))
        self.rejected += concerned is None
        self.about += [one.drive.name for one in concerned or ()]

    @property
    def events(self) -> list[Event]:
        return self.plant.events.waiting

    def code(self, slot: str) -> object:
        return self.plant.image.read(f"conveyor/{slot}/status/emcy_code").value


def of_drive(number: int, code: str = "1023") -> str:
    """NORD has the number of the drive in one of the manufacturer's bytes (BU 2500 §6.6)."""
    byte = sites.family(sites.FAMILY).emcy.drive_byte
    assert byte is not None
    data = bytearray(bytes.fromhex(code) + bytes(6))
    data[byte] = number
    return data.hex()


def number_of(slot: str) -> int:
    (number,) = (one.emcy_drive for one in sites.family(sites.FAMILY).slot if one.name == slot)
    assert number is not None
    return number


def test_it_goes_to_the_drive_that_it_names_and_to_no_other() -> None:
    case = Case("fu1", "fu2")
    case.comes(of_drive(number_of("fu2")))
    assert case.about == ["conveyor/fu2"]
    assert case.code("fu2") == 0x2310
    assert case.code("fu1") == 0


def test_one_that_is_about_no_drive_of_the_site_is_nobodys() -> None:
    case = Case("fu1")
    case.comes(of_drive(99))
    assert case.about == []
    assert case.code("fu1") == 0


def test_where_a_family_names_none_it_is_the_only_drives() -> None:
    case = Case(sites.family("lenze/8400-motec").slot[0].name, mapping="lenze/8400-motec")
    case.comes("1023000000000000")
    assert len(case.about) == 1


@pytest.mark.parametrize("data", ["", "1023"])
def test_what_is_too_short_is_rejected(data: str) -> None:
    case = Case("fu1")
    case.comes(data)
    assert case.rejected == 1
    assert case.about == []


def test_the_history_is_a_point_with_texts() -> None:
    case = Case("fu1")
    case.comes(of_drive(1))
    case.emergencies.refresh(11.0)
    (entry,) = json.loads(str(case.plant.image.read("conveyor/node/emcy_history").value))
    assert (entry["code"], bool(entry["text"])) == ("2310h", True)
    assert case.plant.image.read("conveyor/node/emcy_suppressed").value == 0


def test_of_a_babbling_node_the_last_is_told_later() -> None:
    case = Case("fu1")
    for number in range(200):
        case.comes(of_drive(number_of("fu1"), "1023" if number % 2 else "1042"), 10.0 + number / 10_000)
    due = case.emergencies.next_deadline()
    assert due is not None
    told = len(case.about)
    assert 0 < told < 200
    case.about += [one.drive.name for one in case.emergencies.on_time(due)]
    assert len(case.about) == told + 1
    assert case.code("fu1") == 0x2310, "the newest"
