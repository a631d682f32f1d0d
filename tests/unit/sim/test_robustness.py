"""Simulated nodes under any input at any time: none raises, grows or spins."""

from __future__ import annotations

import gc
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.canopen.frame import ERROR, EXTENDED, REMOTE, Frame
from bridge.sim.cia402.cia402_drive import Cia402Drive
from bridge.sim.cia402.cia402_settings import Cia402Mode, Cia402Settings
from bridge.sim.lenze.lenze_drive import Reaction
from bridge.sim.lenze.lenze_motec import LenzeMotec
from bridge.sim.lenze.lenze_settings import LenzeCodes
from bridge.sim.nord.nord_single import NordSingle
from bridge.sim.nord.nord_single_settings import RJ45_5XX, RJ45_54X, TU3
from bridge.sim.nord.nord_tu4 import NordTu4
from bridge.sim.stoeber.stoeber_5000 import Stoeber5000
from tests.support.nightly import examples

Deed = Callable[[Any, float], object]
"""Done to a node at a time."""

START: Final = Frame(0, b"\x01\x05")
EXAMPLES: Final = examples(100)


def sdo(*words: int) -> list[bytes]:
    return [word.to_bytes(4, "little") for word in words]


def words(cob_ids: Sequence[int], sent: Sequence[bytes], least: int, most: int) -> st.SearchStrategy[Frame]:
    """RPDOs that begin with one of the commands ``sent``."""
    rest = st.binary(min_size=least, max_size=most)
    return st.builds(
        lambda cob_id, head, tail: Frame(cob_id, head + tail),
        st.sampled_from(cob_ids),
        st.sampled_from(sent),
        rest,
    )


POWER: Final[Mapping[str, Deed]] = {
    "silence": lambda node, now: node.silence(),
    "speak": lambda node, now: node.speak(),
    "cycle": lambda node, now: node.power_cycle(),
    "off": lambda node, now: node.power_off(),
    "on": lambda node, now: node.start(now),
}
WITHOUT_SWITCH: Final = {name: POWER[name] for name in ("silence", "speak", "cycle")}


@dataclass(frozen=True, kw_only=True)
class Kind:
    """``objects`` are those that SDO requests are about, ``data`` what they write, ``rpdos`` its commands.
    With ``catches_up`` it may have something to do at a time that has been before."""

    make: Callable[[], Any]
    objects: Sequence[int]
    data: Sequence[bytes]
    rpdos: st.SearchStrategy[Frame]
    deeds: Mapping[str, Deed]
    ids: Sequence[int] = (0x000, 0x080, 0x205, 0x305, 0x405, 0x505, 0x605, 0x705 | REMOTE, 0x205 | REMOTE)
    channels: Sequence[int] = (0x605,)
    most_sub: int = 9
    longest_s: float = 3.0
    catches_up: bool = False
    first: Sequence[Frame] = ()
    check: Callable[[Any], bool] = lambda node: True
    most_frames: int = 256

    def steps(self) -> st.SearchStrategy[list[tuple[float, Frame | str]]]:
        requests = st.builds(
            lambda command, index, sub, data: (
                bytes([command]) + index.to_bytes(2, "little") + bytes([sub]) + data
            ),
            st.sampled_from((*b"\x40\x2f\x2b\x23\x22\x20\x21\x60\x70\x00\x10\x01\x80\xa0\xa3\xa4\xc0\xc2",)),
            st.sampled_from(self.objects),
            st.integers(0, self.most_sub),
            st.one_of(st.binary(min_size=4, max_size=4), st.sampled_from([bytes(4), *self.data])),
        )
        nmt = st.sampled_from([bytes([command, 5]) for command in (1, 1, 1, 2, 0x80, 0x81, 0x82)])
        foreign = st.integers(0, 0x7FF).map(lambda cob_id: cob_id | ERROR | EXTENDED)
        frames = st.one_of(
            st.builds(Frame, st.sampled_from(self.ids), st.binary(max_size=8)),
            st.builds(Frame, st.sampled_from(self.channels), requests),
            st.builds(Frame, st.just(0), nmt),
            self.rpdos,
            st.builds(Frame, foreign, st.binary(max_size=8)),
        )
        deeds = st.sampled_from(sorted(self.deeds))
        waits = st.floats(-0.1, self.longest_s, allow_nan=False)
        return st.lists(st.tuples(waits, st.one_of(frames, frames, frames, deeds)), max_size=60)


# Objects that every node has, and of each family.
COMMON: Final = (0x1000, 0x1003, 0x1005, 0x1014, 0x1017, 0x1018, 0x1200, 0x1400, 0x1600, 0x1800, 0x1A00)
CIA402: Final = (0x100C, 0x100D, 0x1010, 0x1011, 0x1015, 0x1016, 0x1403, 0x1601, 0x603F, 0x6007)
CIA402_AXIS: Final = (*range(0x6040, 0x6049), *range(0x605A, 0x6069), 0x606C, 0x607A, 0x607C, 0x607D, 0x607F)
CIA402_MOTION: Final = (*range(0x6080, 0x6086), 0x608F, 0x6098, 0x6099, 0x60C2, 0x60FF)
LENZE: Final = (0x1006, 0x1016, 0x1201, 0x1401, 0x1801, 0x5FFD, 0x5FF4, 0x5FF3, 0x5F9C, 0x5F57)
LENZE_CODES: Final = (*range(0x5E7A, 0x5EBF), 0x5DAE, 0x5DAF)
NORD: Final = (0x1008, 0x100C, 0x100D, 0x1010, 0x1015, 0x1201, 0x1604, 0x1804, 0x2066, 0x2069, 0x2097, 0x2098)
NORD_PARAMETERS: Final = (
    0x2201,
    0x2230,
    *range(0x20A0, 0x20B5),
    0x221F,
    0x2222,
    0x22BC,
    *range(0x3000, 0x3005),
)
NORD_VARIANTS: Final = (
    0x1011,
    0x1601,
    0x1801,
    0x1A01,
    0x1A04,
    0x20A5,
    0x20A8,
    0x20A8,
    0x21FD,
    0x22EA,
    0x3006,
)
NORD_PROFILE: Final = (0x6040, 0x6042, 0x6046, 0x6048, 0x6849, 0x60FE)
STOEBER: Final = (
    0x1006,
    0x1008,
    0x100C,
    0x100D,
    0x1010,
    0x1015,
    0x1020,
    0x1201,
    0x1403,
    0x1603,
    0x1803,
    0x1A03,
)
STOEBER_PARAMETERS: Final = (0x2000, 0x200B, 0x20B4, 0x20E1, 0x20ED, 0x20F1, 0x2401, 0x26E6, 0x2808, 0x2830)

NORD_WORDS: Final = [bytes([low, 0x04]) for low in (0x7E, 0x7F, 0x7F, 0x77, 0x7B, 0x7D, 0xFF, 0x00)]
MAPPED: Final = sdo(
    0x3000_0010, 0x3002_0110, 0x3003_0110, 0x3006_0020, 0x6040_0010, 0x6042_0010, 0x6044_0010, 0x6841_0010
)
ENABLING: Final = [Frame(0x605, bytes([0x2B, 0x40, 0x60, 0, word, 0, 0, 0])) for word in (6, 7, 15)]
CONTROL_WORDS: Final = (0x00, 0x02, 0x06, 0x07, 0x0F, 0x1F, 0x3F, 0x5F, 0x7F, 0x80, 0x10F)


def cia402(mode: Cia402Mode) -> Kind:
    def make() -> Cia402Drive:
        return Cia402Drive(5, Cia402Settings(mode=mode, heartbeat_consumer=0x7F00C8))

    def check(node: Cia402Drive) -> bool:
        return -0x8000_0000 <= round(node.axis.motor.position) <= 0x7FFF_FFFF

    heads = [word.to_bytes(2, "little") for word in CONTROL_WORDS]
    by_sdo = [Frame(0x605, b"\x2b\x40\x60\0" + word.to_bytes(4, "little")) for word in CONTROL_WORDS]
    return Kind(
        make=make,
        objects=(*COMMON, *CIA402, *CIA402_AXIS, *CIA402_MOTION),
        data=[b"\1\0\0\0", b"\xc8\0\x7f\0", b"save"],
        rpdos=words([0x205, 0x405, 0x505], heads, 4, 6) | st.sampled_from(by_sdo),
        deeds={
            **POWER,
            "fail": lambda node, now: node.fail(0x2310),
            "lasting": lambda node, now: node.fail(0x4310, lasting=True),
            "mend": lambda node, now: node.mend(),
        },
        ids=(0x000, 0x080, 0x205, 0x305, 0x405, 0x505, 0x605, 0x77F, 0x705 | REMOTE, 0x185 | REMOTE),
        catches_up=True,
        first=ENABLING,
        check=check,
    )


def lenze(master: int) -> Kind:
    def make() -> LenzeMotec:
        reactions = {"rpdo_reactions": [1, 2], "bus_reactions": [4, 1, 4, 2, 1]}
        codes = LenzeCodes(5, master=master, watched_node=127, watched_ms=200, **reactions)
        return LenzeMotec(5, codes=codes)

    return Kind(
        make=make,
        objects=(*COMMON, *LENZE, *LENZE_CODES),
        data=[b"\1\0\0\0", b"\5\2\0\x40"],
        rpdos=words([0x205], [bytes([low]) for low in (0x01, 0x09, 0x0D, 0x02, 0x81, 0x89)], 7, 7),
        deeds={
            **POWER,
            "fail": lambda node, now: node.fail(7, Reaction.TROUBLE),
            "mend": lambda node, now: node.mend(7),
            "bus": lambda node, now: node.bus_error(3),
            "well": lambda node, now: node.bus_error(0),
            "supply": lambda node, now: node.supply(there=False),
        },
        ids=(0x000, 0x080, 0x205, 0x305, 0x605, 0x645, 0x705, 0x77F, 0x185 | REMOTE, 0x705 | REMOTE),
        channels=(0x605, 0x645),
        most_sub=13,
        # A command of C00002 is done after its answer.
        catches_up=True,
        most_frames=2 * 256,
    )


def nord(make: Callable[[], Any], deeds: Mapping[str, Deed]) -> Kind:
    """One of those that bring a single drive, or the interface with other drives behind it."""
    return Kind(
        make=make,
        objects=(*COMMON, *NORD, *NORD_PARAMETERS, *NORD_VARIANTS, *NORD_PROFILE),
        data=[b"save", b"load", b"\1\0\0\0", b"\2\0\0\0", *MAPPED],
        rpdos=words([0x205, 0x305, 0x405, 0x505], NORD_WORDS, 0, 6),
        deeds={**WITHOUT_SWITCH, **deeds},
        most_sub=6,
        longest_s=1.0,
    )


def tu4() -> Kind:
    long_words = words([0x205, 0x305], NORD_WORDS, 6, 6)
    wrong_end = st.builds(
        lambda cob_id, data: Frame(cob_id, data + b"\0"),
        st.sampled_from([0x205, 0x305]),
        st.binary(min_size=7, max_size=7),
    )
    return Kind(
        make=lambda: NordTu4(5, p151_ms=500, ripple=0.01),
        objects=(*COMMON, *NORD, *NORD_PARAMETERS),
        data=[b"save", b"load", b"\1\0\0\0"],
        rpdos=long_words | wrong_end,
        deeds={**POWER, **BEHIND_INTERFACE},
        ids=(*Kind.ids, 0x245, 0x345, 0x705),
        most_sub=20,
    )


BEHIND_INTERFACE: Final[Mapping[str, Deed]] = {
    "fail": lambda node, now: node.fail_drive(1, 30),
    "drop": lambda node, now: node.drop_drive(1),
    "restore": lambda node, now: node.restore_drive(1),
}
ALONE: Final[Mapping[str, Deed]] = {"fail": lambda node, now: node.fail_drive(30)}
BOXED: Final[Mapping[str, Deed]] = {
    **ALONE,
    "drop": lambda node, now: node.drop_drive(),
    "restore": lambda node, now: node.restore_drive(),
}


def stoeber(axes: int) -> Kind:
    return Kind(
        make=lambda: Stoeber5000(5, axes=axes),
        objects=(*COMMON, *STOEBER, *STOEBER_PARAMETERS, 0x4000, 0x4001),
        data=[b"save", b"\1\0\0\0", b"\0\0\xb4\x20", b"\0\0\x08\x28", b"\x20\6\0\0"],
        rpdos=words([0x205, 0x305, 0x405, 0x505], [bytes([n]) for n in (0, 1, 1, 2, 3, 4, 5)], 0, 7),
        deeds={
            **POWER,
            "fail": lambda node, now: node.fail(31),
            "last": lambda node, now: node.fail(41, lasting=True),
            "gone": lambda node, now: node.cause_gone(),
        },
        ids=(*Kind.ids, 0x625, 0x705),
        channels=(0x605, 0x605, 0x625),
        most_sub=7,
        check=lambda node: sum(axis.blocks_others for axis in node.axes) <= 1,
    )


KINDS: Final[Mapping[str, Kind]] = {
    **{f"cia402 {mode.name.lower()}": cia402(mode) for mode in Cia402Mode},
    "8400 motec": lenze(0),
    "8400 motec as a master": lenze(1),
    "tu4": tu4(),
    "tu3": nord(lambda: NordSingle(5, TU3, p513_s=0.5, ripple=0.01), BOXED),
    "rj45 5xx": nord(lambda: NordSingle(5, RJ45_5XX, p513_s=0.5), ALONE),
    "rj45 54x": nord(lambda: NordSingle(5, RJ45_54X, p513_s=0.5), ALONE),
    "cu4": nord(lambda: NordTu4(5, kind="SK CU4-CAO", p151_ms=500), BEHIND_INTERFACE),
    "profile": nord(lambda: NordTu4(5, profile=True, p151_ms=500), BEHIND_INTERFACE),
    "stoeber, one axis": stoeber(1),
    "stoeber, four axes": stoeber(4),
}


@pytest.mark.landing(5)
@pytest.mark.parametrize("name", KINDS)
@settings(max_examples=EXAMPLES, deadline=None)
@given(data=st.data())
def test_random_frames_and_times_do_no_harm(name: str, data: st.DataObject) -> None:
    kind = KINDS[name]
    node, fetch = kind.make(), data.draw(st.booleans())
    node.start(1000.0)
    if isinstance(node, Cia402Drive):
        for pdo in node.slave._store.current.rpdo:  # all of them, with control word and targets
            pdo.enabled = True
    now = newest = 1000.0
    first = [(0.3, START), *((0.01, frame) for frame in kind.first)]
    for wait, event in [*first, *data.draw(kind.steps())]:
        now = max(0.0, now + wait)
        newest = max(newest, now)
        if isinstance(event, str):
            kind.deeds[event](node, newest)
        else:
            node.on_frame(event, now)
        node.on_time(now)
        if kind.catches_up:
            node.on_time(newest)
        deadline = node.next_deadline()
        assert deadline is None or deadline > newest, "nothing may be left to do at once"
        assert kind.check(node)
        if fetch:
            sent = node.take_frames()
            assert all(0 <= frame.can_id <= 0x7FF and len(frame.data) <= 8 for frame in sent)
    assert len(node.take_frames()) <= kind.most_frames


@dataclass(frozen=True)
class LongRun:
    """Course of each second, by its parts."""

    make: Callable[[], Any]
    second: Mapping[float, str | Frame | None] = field(default_factory=dict[float, "str | Frame | None"])


def frame(cob_id: int, data: str) -> Frame:
    return Frame(cob_id, bytes.fromhex(data))


LONG_RUNS: Final = {
    "tu4": LongRun(
        lambda: NordTu4(5, p151_ms=50),
        {
            0.0: frame(0x205, "7F04002000000000"),
            0.1: frame(0x605, "4008100000000000"),
            0.2: None,  # P151 has run out
            0.3: frame(0x205, "FF04002000000000"),
            0.5: None,
        },
    ),
    "stoeber": LongRun(
        lambda: Stoeber5000(5),
        {
            0.0: frame(0x205, "01F401"),
            0.1: frame(0x605, "4008100000000000"),
            0.15: "fail",
            0.2: None,
            0.4: None,
            0.5: frame(0x205, "020000"),
            0.6: frame(0x205, "000000"),
        },
    ),
}


@pytest.mark.landing
@pytest.mark.parametrize("name", LONG_RUNS)
def test_a_node_that_runs_for_long_needs_no_more_memory(name: str) -> None:
    run = LONG_RUNS[name]
    node = run.make()
    node.start(0.0)
    node.on_frame(START, 0.3)

    def minutes(first: int, last: int) -> int:
        for second in range(60 * first, 60 * last):
            for part, event in run.second.items():
                if event is None:
                    node.on_time(second + part)
                elif isinstance(event, str):
                    node.fail(41)
                else:
                    node.on_frame(event, second + part)
        gc.collect()
        return sys.getallocatedblocks()

    first = minutes(1, 3)
    assert minutes(3, 20) - first < 500
