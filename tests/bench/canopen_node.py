"""canopen's side of the figures: a node whose TPDO has four words, read as a program reads them."""

from __future__ import annotations

from collections.abc import Callable

import canopen
from canopen.objectdictionary import UNSIGNED16

from tests.peers.foreign_slave import variable

TPDO_ID = 0x185


def with_four_words(network: canopen.Network, received: Callable[[], None]) -> None:
    """Add node 5; ``received`` is called for each TPDO once its values have been read."""
    dictionary = canopen.ObjectDictionary()
    dictionary.add_object(variable("status word", 0x3001, 0, UNSIGNED16, 0))
    for n in (1, 2, 3):
        dictionary.add_object(variable(f"value {n}", 0x3010 + n, 0, UNSIGNED16, 0))
    node = network.add_node(5, dictionary)
    mapping = canopen.pdo.base.PdoMap(node.tpdo, None, None)
    mapping.cob_id = TPDO_ID
    for index in (0x3001, 0x3011, 0x3012, 0x3013):
        mapping.add_variable(index)

    def on_pdo(changed: canopen.pdo.base.PdoMap) -> None:
        for entry in changed:
            entry.raw  # noqa: B018 - reading is what is measured
        received()

    mapping.add_callback(on_pdo)
    network.subscribe(TPDO_ID, mapping.on_message)
