"""Names made of what people of other tongues call their devices."""

from __future__ import annotations

import pytest

from bridge.derive import derive_family
from bridge.derive.proposed_site import ProposedBus, ProposedNode, propose_site
from bridge.derive.toml import file_name
from bridge.eds import read_device
from tests.support.invented_eds import eds


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("Müller GmbH & Co. KG", "mueller-gmbh-co-kg"),
        ("MÜLLER", "mueller"),
        ("Mu\u0308ller", "mueller"),
        ("Ölkühler Größe 2", "oelkuehler-groesse-2"),
        ("STÖBER", "stoeber"),
        ("Łódź Søndergård", "lodz-soendergaard"),
        ("Télémécanique", "telemecanique"),
        ("m/s² 5 µm", "m-s-5-m"),
        ("電動機 7", "7"),
        ("電動機", ""),
    ],
)
def test_letters_of_other_tongues_are_kept_as_near_as_ascii_has_them(text: str, name: str) -> None:
    assert file_name(text) == name


def test_a_mapping_is_named_by_its_maker() -> None:
    content = eds().decode().replace("Acme GmbH", "Müller").replace("Spin 3000", "Gerät 5").encode()
    assert derive_family(read_device(content, "spin.eds"), "spin.eds").name == "mueller/geraet-5"


def test_a_node_is_named_by_its_device() -> None:
    nodes = [ProposedNode(5, "Förderband Süd", "node 5", "cia402/velocity")]
    text = propose_site("hall", ProposedBus("virtual", None, 500_000), nodes, {})
    assert '\n# name = "foerderband_sued"\n' in text
