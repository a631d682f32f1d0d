"""Process data in words for the monitor: of drives of the site, and of a bus that nobody describes."""

from __future__ import annotations

from bridge.bustools.decode import Decoder, FrameKind, FrameMeaning
from bridge.canopen.frame import Frame
from bridge.config import NodeTable
from bridge.mapping import load_family

CONVEYOR = NodeTable.model_validate(
    {
        "name": "conveyor",
        "id": 5,
        "mapping": "nord/sk-tu4-cao",
        "drive": [{"slot": "fu1", "parameters": {"P105": 50.0}}, {"slot": "fu2"}],
    }
)


def site() -> Decoder:
    return Decoder([CONVEYOR], {"nord/sk-tu4-cao": load_family("nord/sk-tu4-cao")})


def heard(decoder: Decoder, *frames: tuple[int, str]) -> FrameMeaning:
    """The meaning of the last of these frames."""
    return [decoder.decode(Frame(can_id, bytes.fromhex(data))) for can_id, data in frames][-1]


def test_the_example_of_the_nord_manual() -> None:
    """BU 2500 §6.8: 047F, 2000 runs at 25 Hz; the drive answers xx37, 2000."""
    sent = heard(site(), (0x205, "7F04002000000000"))
    assert sent.kind is FrameKind.PDO
    assert sent.label == "RPDO1 conveyor/fu1"
    assert "control_word 047Fh" in sent.text
    assert "setpoint_1 2000h (frequency 25 Hz)" in sent.text
    answered = heard(site(), (0x185, "370B002000000000"))
    assert "status_word 0B37h operation enabled" in answered.text
    assert dict(answered.values) | {"frequency": 25.0, "state": "operation_enabled"} == dict(answered.values)


def test_a_drive_whose_scale_is_not_known_shows_its_words() -> None:
    assert heard(site(), (0x285, "310B002000000000")).text.endswith(
        "value_1 2000h, value_2 0000h, value_3 0000h"
    )


def test_without_a_site_a_pdo_is_its_bytes() -> None:
    meaning = heard(Decoder(), (0x205, "7F04"))
    assert (meaning.label, meaning.text, meaning.node) == ("RPDO1 node 5", "7F 04", 5)
