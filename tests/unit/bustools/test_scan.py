"""Nodes that a scan finds, and others that it does not take for nodes."""

from __future__ import annotations

from collections.abc import Sequence

from hypothesis import given
from hypothesis import strategies as st

from bridge.bustools.scan import FoundNode, Scanner
from bridge.canopen.frame import REMOTE, Frame
from bridge.canopen.nmt import NmtState
from bridge.mapping import Family, load_family
from bridge.mapping.match import Found, best_match
from bridge.mapping.model import IdentityRule
from bridge.sim.nord.nord_tu4 import NordTu4
from tests.support.sdo_device import SdoDevice, u32

LENZE = {
    (0x1000, 0): u32(0),
    (0x1018, 1): u32(0x3B),
    (0x1018, 2): u32(8400),
    (0x1018, 3): u32(1),
    (0x1018, 4): u32(0),
    (0x1008, 0): b"8400",
}
SDO2 = {0x645: 0x5C5}
"""Lenze §12: the second server of node 5 is asked on 640h + 5 and answers on 5C0h + 5."""


class Air:
    """Everything between the scanner and the devices arrives at once."""

    def __init__(
        self,
        *devices: SdoDevice,
        passive: bool = False,
        bitrate: int = 250_000,
        own_id: int | None = None,
    ) -> None:
        self.now = 100.0
        self.devices = devices
        self.scanner = Scanner(self.now, bitrate, passive=passive, own_id=own_id)
        self.sent: list[Frame] = []

    def hear(self, *frames: Frame) -> None:
        for frame in frames:
            self.scanner.on_frame(frame._replace(time=self.now))

    def run(self) -> list[int]:
        while not self.scanner.is_finished(self.now):
            self.scanner.on_time(self.now)
            while frames := self.scanner.take_frames():
                self.sent += frames
                for frame in frames:
                    for device in self.devices:
                        self.hear(*device.on_frame(frame))
                self.scanner.on_time(self.now)
            if not self.scanner.is_finished(self.now):
                self.now = max(self.now, self.scanner.next_deadline())
        return [node.id for node in self.scanner.nodes()]

    def node(self, node_id: int) -> FoundNode:
        return next(node for node in self.scanner.nodes() if node.id == node_id)


def test_a_node_is_found_by_sdo_and_says_who_it_is() -> None:
    air = Air(SdoDevice(5, LENZE, state=0x7F))
    assert air.run() == [5]
    node = air.node(5)
    assert (node.device_type, node.vendor, node.product, node.name) == (0, 0x3B, 8400, "8400")
    assert node.nmt_state is NmtState.PRE_OPERATIONAL


def test_an_empty_bus_is_scanned_within_two_seconds() -> None:
    air = Air()
    assert air.run() == []
    assert air.now - 100.0 < 1.0
    assert {frame.can_id - 0x600 for frame in air.sent if frame.data[:1] == b"\x40"} == set(range(1, 128))


def test_a_stopped_node_is_found_by_guarding() -> None:
    class Stopped(SdoDevice):
        def on_frame(self, frame: Frame) -> list[Frame]:
            return super().on_frame(frame) if frame.can_id & REMOTE else []

    air = Air(Stopped(9, {}, state=0x84))
    assert air.run() == [9]
    assert air.node(9).nmt_state is NmtState.STOPPED


def test_a_node_is_found_by_its_heartbeat_or_its_boot_up_alone() -> None:
    air = Air()
    air.hear(Frame(0x711, b"\x05"), Frame(0x712, b"\x00"))
    assert air.run() == [0x11, 0x12]
    assert air.node(0x11).nmt_state is NmtState.OPERATIONAL
    assert air.node(0x12).nmt_state is NmtState.PRE_OPERATIONAL


def test_the_bridges_own_heartbeat_is_no_node() -> None:
    air = Air(own_id=127)
    air.hear(Frame(0x77F, b"\x05"))
    assert air.run() == []


def test_a_device_on_the_bridges_own_id_is_found() -> None:
    air = Air(SdoDevice(127, LENZE, state=0x7F), own_id=127)
    air.hear(Frame(0x77F, b"\x05"))
    assert air.run() == [127]


def test_a_second_sdo_channel_that_answers_for_the_bridges_own_id_is_no_node() -> None:
    air = Air(SdoDevice(63, LENZE, {0x67F: 0x5FF}, state=0x7F), own_id=127)
    air.hear(Frame(0x77F, b"\x05"))
    assert air.run() == [63]


def test_passive_sends_nothing() -> None:
    air = Air(SdoDevice(5, LENZE, state=5), passive=True)
    air.hear(Frame(0x706, b"\x05"))
    assert air.run() == [6]
    assert air.sent == []


def test_node_guarding_is_not_started_where_the_node_would_watch_us() -> None:
    """CiA 301 §7.2.8.3.2.1: life guarding begins with the first remote frame."""
    device = SdoDevice(5, LENZE | {(0x100C, 0): b"\xc8\0", (0x100D, 0): b"\x03"}, state=5)
    air = Air(device)
    assert air.run() == [5]
    assert [frame for frame in device.asked if frame.can_id & REMOTE] == []


# answers that are no node


def test_the_second_sdo_channel_of_a_lenze_is_no_node() -> None:
    """It reads 1200h:1 of its own node, 600h + 5."""
    channels = {(0x1200, 1): u32(0x605), (0x1201, 1): u32(0x645)}
    air = Air(SdoDevice(5, LENZE | channels, SDO2))
    assert air.run() == [5]
    assert air.scanner.phantoms() == {69: 5}


def test_nor_is_it_where_only_the_emergency_cob_id_tells() -> None:
    air = Air(SdoDevice(5, LENZE | {(0x1014, 0): u32(0x85)}, SDO2))
    assert air.run() == [5]


def test_nor_where_only_1201h_tells() -> None:
    air = Air(SdoDevice(5, LENZE | {(0x1201, 1): u32(0x645)}, SDO2))
    assert air.run() == [5]


def test_nor_where_nothing_tells_but_that_it_is_the_same_device_and_has_no_error_control() -> None:
    air = Air(SdoDevice(5, LENZE, SDO2, state=5))
    assert air.run() == [5]


def test_three_further_channels_of_a_stoeber_are_no_nodes() -> None:
    """STÖBER §7.2: SDO2 620h/5A0h, SDO3 640h/5C0h, SDO4 660h/5E0h, each + 5."""
    channels = {0x625: 0x5A5, 0x645: 0x5C5, 0x665: 0x5E5}
    air = Air(SdoDevice(5, LENZE | {(0x1018, 4): u32(8_000_001)}, channels))
    assert air.run() == [5]
    assert air.scanner.phantoms() == {37: 5, 69: 5, 101: 5}


def test_two_equal_devices_are_two_nodes() -> None:
    air = Air(SdoDevice(5, LENZE, state=5), SdoDevice(69, LENZE, state=5))
    assert air.run() == [5, 69]


def test_a_bare_function_code_in_1200h_accuses_nobody() -> None:
    """STÖBER §7.2: where a parameter holds the bare function code the drive adds its address."""
    objects = LENZE | {(0x1200, 1): u32(0x600), (0x1014, 0): u32(0x80)}
    assert Air(SdoDevice(5, objects), SdoDevice(6, objects)).run() == [5, 6]


def test_one_stray_answer_is_no_node() -> None:
    class Stray(SdoDevice):
        def on_frame(self, frame: Frame) -> list[Frame]:
            return super().on_frame(frame) if frame.data[1:3] == b"\0\x10" else []

    air = Air(Stray(7, LENZE))
    assert air.run() == []
    assert air.scanner.phantoms() == {7: None}


def test_an_answer_to_somebody_elses_question_is_no_node() -> None:
    air = Air()
    air.scanner.on_time(air.now)
    air.scanner.take_frames()
    air.hear(Frame(0x581, bytes.fromhex("4318100101000000")), Frame(0x5F0, bytes.fromhex("4300100001000000")))
    assert air.run() == []


def nord_scan() -> Sequence[FoundNode]:
    scanner, node, now = Scanner(0.0, 250_000, passive=False), NordTu4(5), 0.0
    node.start(now)
    while not scanner.is_finished(now):
        scanner.on_time(now)
        for frame in scanner.take_frames():
            node.on_frame(frame, now)
        node.on_time(now)
        for frame in node.take_frames():
            scanner.on_frame(frame._replace(time=now))
        now += 0.001
    return scanner.nodes()


def test_the_simulated_nord_is_found_and_its_mapping_by_its_name() -> None:
    [node] = nord_scan()
    assert (node.id, node.name) == (5, "SK TU4-CAO")
    found = Found(node.device_type, node.vendor, node.product, node.revision, node.name)
    match = best_match(found, {"nord": load_family("nord/sk-tu4-cao")})
    assert match and match.mapping == "nord" and "device_name" in match.by


def test_a_mapping_that_does_not_fit_is_not_named() -> None:
    families = {"nord": load_family("nord/sk-tu4-cao")}
    assert best_match(Found(device_name="Fan 3000"), families) is None
    assert best_match(Found(), families) is None


def test_a_mapping_with_more_rules_fits_better_and_masks_count() -> None:
    """STÖBER: the product code is the rated power, so its mask is 0."""
    nord = load_family("nord/sk-tu4-cao")

    def family(**rules: object) -> Family:
        return nord.model_copy(update={"identity": IdentityRule.model_validate(rules)})

    families = {
        "vendor": family(vendor_id=0xB9),
        "drive": family(vendor_id=0xB9, product_code=1, product_code_mask=0),
        "other": family(vendor_id=0xB9, product_code=1),
    }
    match = best_match(Found(0x20192, vendor=0xB9, product=55), families)
    assert match and (match.mapping, match.by) == ("drive", ("vendor_id", "product_code"))


@given(st.lists(st.tuples(st.integers(0x580, 0x7FF), st.binary(max_size=8)), max_size=60))
def test_whatever_is_heard_the_scan_ends(heard: list[tuple[int, bytes]]) -> None:
    air = Air(passive=False)
    air.scanner.on_time(air.now + 1.0)
    air.hear(*(Frame(can_id, data) for can_id, data in heard))
    assert set(air.run()) <= {
        can_id - 0x700 for can_id, data in heard if can_id > 0x700 and len(data) == 1
    } | {can_id - 0x580 for can_id, _ in heard}


def test_a_name_says_more_than_a_profile() -> None:
    names = ("cia402/profile-velocity", "nord/sk-tu4-cao")
    match = best_match(Found(0x10192, device_name="SK TU4-CAO"), {name: load_family(name) for name in names})
    assert match is not None
    assert match.mapping == "nord/sk-tu4-cao"
