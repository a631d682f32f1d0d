"""Communication objects of simulated nodes."""

from __future__ import annotations

import pytest

from bridge.sim.core.communication_objects import DeviceIdentity, add_communication
from bridge.sim.core.communication_settings import CobId, CommunicationSettings, SdoSettings, SlaveRules
from bridge.sim.core.dictionary import Dictionary, Number
from bridge.sim.core.emcy_producer import EmcyProducer
from bridge.sim.core.sdo_abort import AbortCode, SdoAbort
from bridge.sim.core.store import Store

IDENTITY = DeviceIdentity(0x0002_0192, 0x38, 7, 1, 4711, "SK", "1.0", "2.1")


class Rig:
    def __init__(self) -> None:
        channels = [SdoSettings.at(0x605, 0x585), SdoSettings.at(0x625, 0x5A5, enabled=False)]
        self.store = Store(lambda: CommunicationSettings(emcy=CobId(0x85), sdo=list(channels)))
        self.other = Store(lambda: [1])
        self.emcy = EmcyProducer(self.store, SlaveRules())
        self.objects = Dictionary()
        add_communication(self.objects, IDENTITY, lambda: 9, self.emcy, self.store, self.other)

    def number(self, index: int, sub: int = 0) -> Number:
        entry = self.objects.find(index, sub)
        assert isinstance(entry, Number)
        return entry

    def read(self, index: int, sub: int = 0) -> int:
        return int.from_bytes(self.objects.find(index, sub).upload(), "little")


def test_it_says_who_it_is() -> None:
    rig = Rig()
    assert [rig.read(0x1018, sub) for sub in range(5)] == [4, 0x38, 7, 1, 4711]
    assert (rig.read(0x1000), rig.read(0x1002)) == (0x0002_0192, 9)
    assert rig.objects.find(0x1008, 0).upload() == b"SK"


def test_the_list_of_errors_is_as_long_as_there_are_and_is_cleared_by_0() -> None:
    rig = Rig()
    rig.emcy.report(0x2310, 1)
    assert (rig.read(0x1003), rig.read(0x1003, 1), rig.read(0x1001)) == (1, 0x2310, 1)
    with pytest.raises(SdoAbort) as missing:
        rig.read(0x1003, 2)
    assert missing.value.code == AbortCode.SUBINDEX_MISSING
    with pytest.raises(SdoAbort):
        rig.number(0x1003).download(b"\1")
    rig.number(0x1003).download(b"\0")
    assert rig.read(0x1003) == 0


def test_save_and_load_need_their_word_and_are_for_all_stores() -> None:
    rig = Rig()
    rig.store.current.heartbeat_ms = 200
    rig.other.current.append(2)
    for index, word in ((0x1010, b"load"), (0x1011, b"save")):
        with pytest.raises(SdoAbort) as refused:
            rig.number(index, 1).download(word)
        assert refused.value.code == AbortCode.CANNOT_STORE
    rig.number(0x1010, 1).download(b"save")
    for store in (rig.store, rig.other):
        store.power_on()
    assert (rig.read(0x1017), rig.other.current) == (200, [1, 2])
    rig.number(0x1011, 1).download(b"load")
    for store in (rig.store, rig.other):
        store.power_on()
    assert (rig.read(0x1017), rig.other.current) == (0, [1])


def test_the_first_channel_is_fixed_and_the_others_are_not() -> None:
    rig = Rig()
    with pytest.raises(SdoAbort):
        rig.number(0x1200, 1).download(b"\x25\6\0\0")
    for sub in (1, 2):
        rig.number(0x1201, sub).download((0x625 if sub == 1 else 0x5A5).to_bytes(4, "little"))
    assert rig.store.current.sdo[1].enabled
