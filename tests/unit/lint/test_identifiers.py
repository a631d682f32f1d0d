"""Identifiers of a bus: one sender each (CiA 301 §7.3.3); a collision is named where it was made."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.config.download import Download
from bridge.lint import Severity
from bridge.mapping import Family
from bridge.mapping.model import Pdo, SdoServer
from tests.support.lint_site import FAMILY, NORD, OTHER, TIMEOUT, findings, judge, only


def foreign(pdo: int = 2, sdo: tuple[tuple[int, int, int], ...] = ()) -> Family:
    """A family at any address, with one drive on PDOs of this number and with further SDO channels."""
    slot = FAMILY.slot[0]
    rpdo = Pdo(number=pdo, cob_id=0x100 + 0x100 * pdo, objects=slot.rpdo[0].objects)
    tpdo = Pdo(number=pdo, cob_id=0x080 + 0x100 * pdo, objects=slot.tpdo[0].objects)
    names = ("number", "request", "reply")
    servers = [SdoServer.model_validate(dict(zip(names, one, strict=True))) for one in sdo]
    return FAMILY.model_copy(
        update={
            "family": FAMILY.family.model_copy(update={"node_id_high": 127}),
            "slot": [slot.model_copy(update={"rpdo": [rpdo], "tpdo": [tpdo]})],
            "sdo": servers,
        }
    )


LENZE_LIKE = foreign(sdo=((2, 0x640, 0x5C0),))
STOEBER_LIKE = foreign(sdo=((2, 0x620, 0x5A0), (3, 0x640, 0x5C0), (4, 0x660, 0x5E0)))


def test_nodes_of_one_family_do_not_collide(tmp_path: Path) -> None:
    more = "".join(OTHER.format(id=n, family=NORD).replace("pump", f"pump{n}") for n in (1, 6, 63))
    assert judge(tmp_path, bus="bitrate = 1000000", more=more).findings == ()


@pytest.mark.parametrize(
    ("value", "collides"), [(0x86, True), (0x8000_0086, False), (0x40, False), (0xC5, False)]
)
def test_emergency_messages_count_where_1014h_sends_them(tmp_path: Path, value: int, collides: bool) -> None:
    moved = Download(0x1014, 0, value.to_bytes(4, "little"))
    verdict = judge(tmp_path, more=OTHER.format(id=6, family=NORD), downloads=(moved,))
    found = findings(verdict, Severity.ERROR)
    assert [text for text in found if "EMCY of pump has COB-ID 86h, which is EMCY of conveyor's" in text] == (
        found if collides else []
    )
    assert bool(found) == collides


def test_a_foreign_node_above_63_sits_on_nords_closed_channels(tmp_path: Path) -> None:
    """BU 2500 §6.4: 300h + 69 is 340h + 5, the request of NORD's SDO2, which is off at factory."""
    more = OTHER.format(id=69, family="acme")
    found = only(judge(tmp_path, more=more, families={"acme": foreign()}), Severity.WARNING)
    assert "RPDO2 of pump has COB-ID 345h, which is SDO2 request of conveyor's, too, and 1 more" in found
    assert "as long as SDO2 request of conveyor is off" in found
    assert ".node[1].id" in found


def test_with_that_channel_open_it_is_an_error(tmp_path: Path) -> None:
    more = OTHER.format(id=69, family="acme")
    verdict = judge(tmp_path, node="sdo_channels = [2]", more=more, families={"acme": foreign()})
    assert "RPDO2 of pump has COB-ID 345h" in only(verdict, Severity.ERROR)


def test_nords_pdo5_counts_too(tmp_path: Path) -> None:
    """It is in no mapping file, but in the EDS: 200h + 69 is 240h + 5."""
    more = OTHER.format(id=69, family="acme")
    verdict = judge(tmp_path, more=more, families={"acme": foreign(1)})
    assert "RPDO1 of pump has COB-ID 245h, which is RPDO5 of conveyor's" in only(verdict, Severity.WARNING)


@pytest.mark.parametrize(
    ("family", "first", "second"), [(LENZE_LIKE, 1, 65), (STOEBER_LIKE, 1, 33), (STOEBER_LIKE, 3, 99)]
)
def test_an_open_sdo2_takes_the_first_channel_of_another_node(
    tmp_path: Path, family: Family, first: int, second: int
) -> None:
    """Lenze: 640h/5C0h, hence addresses up to 63. STÖBER: 620h/5A0h …, hence up to 31."""
    numbers = [server.number for server in family.sdo]
    text = OTHER.format(id=first, family="acme").replace("id =", f"sdo_channels = {numbers}\nid =")
    more = text + OTHER.replace("pump", "fan").format(id=second, family="acme")
    verdict = judge(tmp_path, more=more, families={"acme": family})
    [found] = findings(verdict, Severity.ERROR)
    assert "SDO" in found
    assert "which is SDO" in found


def test_a_pdo_moved_onto_another_is_named_where_it_was_moved(tmp_path: Path) -> None:
    drive = f"{TIMEOUT}\ntpdo = {{ cob_id = 0x285 }}"
    found = only(judge(tmp_path, drive=drive), Severity.ERROR)
    assert "TPDO2 of conveyor has COB-ID 285h, which is TPDO1 of conveyor's" in found


def test_a_pdo_moved_onto_the_sdo_of_another_node(tmp_path: Path) -> None:
    drive = f"{TIMEOUT}\nrpdo = {{ cob_id = 0x586 }}"
    verdict = judge(tmp_path, drive=drive, more=OTHER.format(id=6, family=NORD))
    collision, identifier = sorted(findings(verdict, Severity.ERROR))
    assert "RPDO1 cannot have COB-ID 586h" in collision
    assert "SDO1 reply of pump has COB-ID 586h" in identifier
