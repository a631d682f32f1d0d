"""Identifiers that a slave hears, and PDOs that are on."""

from __future__ import annotations

from bridge.sim.core.communication_settings import CobId, CommunicationSettings, PdoSettings, SdoSettings
from bridge.sim.core.dictionary import Cell, Dictionary, IntegerType, Number
from bridge.sim.core.pdo_timing import Tpdo
from bridge.sim.core.sdo_server import SimulatedSdoServer
from bridge.sim.core.slave_plan import SlavePlan


def plan() -> tuple[SlavePlan, list[SimulatedSdoServer]]:
    objects, cell = Dictionary(), Cell(0x1234)
    objects.add(0x6041, 0, Number(IntegerType.UNSIGNED16, cell.get, cell.set))
    word = [0x6041_0010]
    channels = [SdoSettings.at(0x605, 0x585), SdoSettings.at(0x625, 0x5A5, enabled=False)]
    settings = CommunicationSettings(
        emcy=CobId(0x85),
        sdo=channels,
        rpdo=[PdoSettings(0x205, entries=word, count=1), PdoSettings(0x305, enabled=False)],
        tpdo=[
            PdoSettings(0x185, entries=word, count=1),
            PdoSettings(0x285, enabled=False, entries=word, count=1),
            PdoSettings(0x385),
        ],
    )
    servers = [SimulatedSdoServer(objects), SimulatedSdoServer(objects)]
    tpdos = [Tpdo() for _ in settings.tpdo]
    return SlavePlan(settings, (0, 0x705), servers, channels, tpdos, lambda number: objects), servers


def test_it_hears_its_own_also_where_they_are_off() -> None:
    made, _ = plan()
    assert made.hears == {0, 0x705, 0x80, 0x605, 0x625, 0x205, 0x305}


def test_only_what_is_on_does_anything() -> None:
    made, servers = plan()
    assert list(made.channels) == [0x605]
    assert made.channels[0x605][0] is servers[0]
    assert [rpdo.number for rpdo in made.rpdos] == [0, 1]
    assert list(made.rpdos_by_cob_id) == [0x205]
    (tpdo,) = made.tpdos
    assert tpdo.payload() == b"\x34\x12"
