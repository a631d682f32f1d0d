"""Simulated nodes look at what they send only where something may have changed. Nobody can tell them from
nodes that look at everything, with each frame."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from random import Random
from typing import Any, NamedTuple

import pytest

from bridge.canopen.frame import REMOTE, Frame
from bridge.sim.cia402.cia402_drive import Cia402Drive
from bridge.sim.cia402.cia402_settings import Cia402Mode, Cia402Settings
from bridge.sim.lenze.lenze_motec import LenzeMotec
from bridge.sim.lenze.lenze_settings import LenzeCodes
from bridge.sim.nord.nord_single import NordSingle
from bridge.sim.nord.nord_single_settings import RJ45_5XX, TU3, Variant
from bridge.sim.nord.nord_tu4 import NordTu4
from bridge.sim.stoeber.stoeber_5000 import Stoeber5000
from tests.support.nightly import by_night_of

TURNS = 250
RPDOS: tuple[int, ...] = (0x205, 0x305, 0x405, 0x505)
INDICES = [0x1005, 0x1006, 0x100C, 0x100D, 0x1014, 0x1015, 0x1016, 0x1017, 0x1400, 0x1600, 0x1800, 0x1801]
INDICES += [0x1A00, 0x2066, 0x2097, 0x20A8, 0x2201, 0x221F, 0x2222, 0x2401, 0x3000, 0x3002, 0x6042]
INDICES += [0x6046] * 5
INDICES += [0x5FFF - code for code in (2, 11, 12, 352, 353, 356, 357, 369, 381, 385, 386, 389, 592, 593)]
VALUES = [0, 1, 1, 2, 3, 4, 10, 100, 254, 255, 0x185, 0x8000_0185, 0x205, 0x7F_0064, 0x4000_0080, 0x3003_0110]


class Family(NamedTuple):
    """``commands`` lead through the states; ``others`` come now and then, and so does ``fail``."""

    make: Callable[[], Any]
    commands: Sequence[bytes]
    others: Sequence[bytes]
    fail: Callable[[Any], None]


def words(*commands: tuple[int, int]) -> list[bytes]:
    return [struct.pack("<HhHH", control, value, 0, 0) for control, value in commands]


def targets(layout: str, *commands: tuple[int, int]) -> list[bytes]:
    return [struct.pack(layout, control, value) for control, value in commands]


RUN = [(0x047E, 0), (0x047F, 0), (0x047F, 0x2000), (0x047F, 0x1000), (0x047F, -0x1000), (0x047E, 0)]
STOP = [(0x04FE, 0), (0x047B, 0), (0x007F, 0), (0x007F, 5), (0x046F, 0x2000), (0x0477, 0)]


def mapped(node: Any, *tpdo: int, rpdo: Sequence[int] = ()) -> Any:
    """The node with these objects in its first TPDO and RPDO."""
    settings = node._communication.current
    for pdo, entries in ((settings.tpdo[0], tpdo), (settings.rpdo[0], rpdo)):
        if entries:
            pdo.entries[: len(entries)], pdo.count = entries, len(entries)
    node._communication.save()
    return node


def nord(make: Callable[[], NordTu4]) -> Family:
    return Family(make, words(*RUN), words(*STOP), lambda node: node.fail_drive("fu1", 30))


def single(variant: Variant, tpdo: Sequence[int]) -> Family:
    def make() -> NordSingle:
        return mapped(NordSingle(5, variant, p513_s=0.1), *tpdo)

    return Family(make, words(*RUN), words(*STOP), lambda node: node.fail_drive(30))


def profile() -> Family:
    def make() -> NordTu4:
        return mapped(NordTu4(5, profile=True), 0x6041_0010, 0x6042_0010, rpdo=(0x6040_0010, 0x6042_0010))

    run, stop = targets("<Hh", *RUN), targets("<Hh", *STOP)
    return Family(make, run, stop, lambda node: node.fail_drive("fu1", 30))


def without_ramps() -> NordTu4:
    node = NordTu4(5, p151_ms=100)
    for drive in node.drives:
        drive.parameters.commission(102, 0)
        drive.parameters.commission(543, 10)
    return mapped(node, 0x3001_0110, 0x3003_0110, 0x3000_0110, 0x3002_0210)


def servo(mode: Cia402Mode, layout: str, *settings: tuple[int, int]) -> Family:
    def make() -> Cia402Drive:
        node = Cia402Drive(5, Cia402Settings(mode=mode, heartbeat_consumer=0x7F07D0))
        return mapped(node, 0x6041_0010, 0x6064_0020, rpdo=(0x6040_0010, TARGETS[mode]))

    run = targets(layout, (0x06, 0), (0x07, 0), (0x0F, 0), *settings, (0x06, 0))
    others = targets(layout, (0x80, 0), (0x02, 0), (0x0B, 0), (0x10F, 100))
    return Family(make, run, others, lambda node: node.fail(0x4310))


def stoeber(axes: int) -> Family:
    run = targets("<Bh", (0, 0), (1, 0), (1, 500), (1, 1000), (5, 1000), (0, 0))
    others = targets("<Bh", (2, 0), (0x81, -300), (4, 0))
    return Family(lambda: Stoeber5000(5, axes=axes), run, others, lambda node: node.fail(31))


def motec(codes: Callable[[], LenzeCodes | None]) -> Family:
    run = words((0x01, 0), (0x09, 0), (0x09, 0x2000), (0x09, -0x1000), (0x0D, 0x2000), (0, 0))
    others = [*words((0x81, 0), (0x03, 0)), bytes(6)]
    return Family(lambda: LenzeMotec(5, codes=codes()), run, others, lambda node: node.fail(77))


def master() -> LenzeCodes:
    return LenzeCodes(5, master=1, times_ms=[100, 50, 0, 0, 20], sync_ms=15, sync_producer=True)


TARGETS = {
    Cia402Mode.VELOCITY: 0x6042_0010,
    Cia402Mode.PROFILE_POSITION: 0x607A_0020,
    Cia402Mode.CYCLIC_VELOCITY: 0x60FF_0020,
}
FAMILIES = {
    "tu4": nord(lambda: NordTu4(5, p151_ms=100)),
    "tu4, without ramps": nord(without_ramps),
    "tu4, ripple": nord(lambda: NordTu4(5, ripple=0.01)),
    "tu4, profile": profile(),
    "tu3": single(TU3, (0x3001_0010, 0x3000_0010, 0x3002_0110)),
    "rj45": single(RJ45_5XX, (0x3001_0010, 0x3003_0110, 0x3006_0020)),
    "motec": motec(lambda: None),
    "motec, master": motec(master),
    "stoeber": stoeber(1),
    "stoeber, four axes": stoeber(4),
    "velocity": servo(Cia402Mode.VELOCITY, "<Hh", (0x7F, 500), (0x7F, 900), (0x3F, 900)),
    "position": servo(Cia402Mode.PROFILE_POSITION, "<Hi", (0x1F, 90_000), (0x0F, 0), (0x3F, -20_000)),
    "cyclic": servo(Cia402Mode.CYCLIC_VELOCITY, "<Hi", (0x0F, 20_000), (0x0F, -9_000)),
}


class Pair:
    """A node as it is, and one that is made to look at everything with each frame."""

    def __init__(self, make: Callable[[], Any]) -> None:
        self.now = 10.0
        self.quick, self.thorough = self.both = make(), make()
        for node in self.both:
            node.start(self.now)
        self.compare("the start")

    def serve(self, until: float) -> None:
        """Serve each node exactly when it asks for it, as a shell does."""
        while (due := self.quick.next_deadline()) is not None and due <= until:
            self.now = max(self.now, due)
            self.on_time()
        self.now = until

    def on_time(self) -> None:
        for node in self.both:
            node.on_time(self.now)
        self.compare("time")

    def put(self, frame: Frame) -> None:
        self.thorough.slave.touch()
        self.thorough._is_steady = False
        for node in self.both:
            node.on_frame(frame, self.now)
        self.compare(frame)

    def compare(self, cause: object) -> None:
        quick, thorough = ((node.take_frames(), node.next_deadline(), node.heard) for node in self.both)
        assert quick == thorough, f"after {cause} at {self.now}"


class Traffic:
    """Frames that a master repeats, and others in between."""

    def __init__(self, family: Family, random: Random) -> None:
        self._family = family
        self._random = random
        self._place = dict.fromkeys(RPDOS, 0)
        self._said = dict.fromkeys(RPDOS, family.commands[0])

    def bunch(self) -> list[Frame]:
        """The frames of one moment."""
        random, dice = self._random, self._random.random()
        if dice < 0.30:
            self._command(random.choice(RPDOS[:2]))
        elif dice < 0.37:
            return [self._sdo_request()]
        elif dice < 0.41:
            return [Frame(0, bytes([random.choice((1, 1, 1, 1, 1, 1, 2, 0x80, 0x81, 0x82)), 5]))]
        elif dice < 0.46:
            return [random.choice((Frame(0x705 | REMOTE), Frame(0x77F, b"\x05")))]
        chosen = [can_id for can_id in RPDOS if random.random() < 0.6]
        syncs = [Frame(0x080)] * random.choice((0, 1, 1, 2))
        return [*(Frame(can_id, self._said[can_id]) for can_id in chosen), *syncs]

    def _command(self, can_id: int) -> None:
        random, family = self._random, self._family
        if random.random() < 0.15:
            self._said[can_id] = random.choice(family.others)
            return
        self._place[can_id] = (self._place[can_id] + 1) % len(family.commands)
        self._said[can_id] = family.commands[self._place[can_id]]

    def _sdo_request(self) -> Frame:
        random = self._random
        what = random.choice((0x40, 0x2F, 0x2B, 0x23)), random.choice(INDICES), random.randrange(4)
        return Frame(0x605, struct.pack("<BHBI", *what, random.choice(VALUES)))


@pytest.mark.landing(13)
@pytest.mark.parametrize("seed", by_night_of(range(12), 4))
@pytest.mark.parametrize("family", FAMILIES.values(), ids=FAMILIES)
def test_who_looks_at_everything_sends_the_same_at_the_same_time(family: Family, seed: int) -> None:
    random = Random(seed)
    pair, traffic = Pair(family.make), Traffic(family, random)
    pair.serve(pair.now + 0.3)
    if seed % 2:
        pair.put(Frame(0x605, bytes.fromhex("2B0C100064000000")))  # life guarding, 100 ms by 2
        pair.put(Frame(0x605, bytes.fromhex("2F0D100002000000")))
    pair.put(Frame(0, b"\x01\x05"))
    for _ in range(TURNS):
        until = pair.now + random.choice((0.0, 0.001, 0.004, 0.01, 0.01, 0.01, 0.06, 0.3))
        if random.random() < 0.8:
            pair.serve(until)
        pair.now = until  # else the loop is late: frames come before anything that is due
        for frame in traffic.bunch():
            pair.put(frame)
        dice = random.random()
        for node in pair.both:
            if dice < 0.03:
                family.fail(node)
            elif dice < 0.04:
                node.power_cycle()


def test_a_new_limit_shows_with_the_next_telegram_although_that_says_the_same() -> None:
    pair = Pair(profile().make)
    pair.serve(pair.now + 0.3)
    pair.put(Frame(0, b"\x01\x05"))
    for command in targets("<Hh", (0x047E, 0), (0x047F, 0), (0x047F, 600)):
        pair.put(Frame(0x205, command))
        pair.serve(pair.now + 2.0)
    pair.put(Frame(0x605, bytes.fromhex("2346600264000000")))  # 6046h:02: at most 100 1/min
    pair.serve(pair.now + 0.1)
    pair.put(Frame(0x205, struct.pack("<Hh", 0x047F, 600)))
    assert not pair.quick.drives[0].status_word & 0x0100, "it has left its setpoint"
