"""NMT commands and states as texts: ``canopen`` says them in English."""

from __future__ import annotations

from bridge.canopen import nmt
from bridge.canopen.nmt import NmtCommand, NmtState
from bridge.text import Text

_BYTES = 2
_OCTETS = frozenset(NmtCommand)


def text_of_command(data: bytes) -> Text:
    """An NMT command on the wire, and whom it is for."""
    if len(data) != _BYTES:
        return Text.of("nmt.no_command", data=data.hex().upper() or Text.of("nmt.nothing"))
    command, node_id = _command(data[0]), data[1]
    if node_id:
        return Text.of("nmt.command_for_node", command=command, id=node_id)
    return Text.of("nmt.command_for_all", command=command)


def text_of_state(state: NmtState) -> Text:
    return Text.word("nmt_state", state.words)


def _command(octet: int) -> Text:
    if octet not in _OCTETS:
        return Text.of("nmt.unknown_command", octet=octet)
    return Text.word("nmt_command", nmt.command_name(octet))
