"""Users of each COB-ID: two senders of one identifier destroy each other's frames (CiA 301 §7.3.3)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from bridge.canopen import cobid
from bridge.lint.checked_bus import CheckedBus, CheckedNode
from bridge.lint.report import LintReport
from bridge.text import Text, Words
from bridge.tomlfile import Key

_LSS: Final = (0x7E4, 0x7E5)


@dataclass(frozen=True, slots=True)
class _Use:
    """One use of a COB-ID. ``active``: in use as configured; else only reserved, off at factory or not
    opened. ``moved``: the site gives it this COB-ID, with ``key``."""

    cob_id: int
    what: Words
    owner: str
    """Name of the node; empty for the bridge."""
    key: Key
    active: bool = True
    moved: bool = False

    @property
    def text(self) -> Text:
        if not self.owner:
            return Text.of("use.of_bridge", what=self.what)
        return Text.of("use.of_node", what=self.what, node=self.owner)


def check_identifiers(bus: CheckedBus, report: LintReport) -> None:
    """Report collisions: an error if two uses collide, a warning if one of them is off at present. One
    finding for each pair of nodes: where one identifier collides, many do."""
    first: dict[int, list[_Use]] = {}
    collisions: dict[tuple[str, str], list[tuple[_Use, _Use]]] = {}
    for use in _uses(bus):
        for other in first.setdefault(use.cob_id, []):
            if use.active or other.active:
                collisions.setdefault((other.owner, use.owner), []).append((other, use))
        first[use.cob_id].append(use)
    for pairs in collisions.values():
        pairs.sort(key=lambda pair: not (pair[0].active and pair[1].active))
        other, use = pairs[0]
        key = other.key if other.moved and not use.moved else use.key
        said = _collision(use, other, len(pairs) - 1)
        if use.active and other.active:
            report.error(key, said, Text.of("check.same_cob_id_advice"))
        else:
            off = use if not use.active else other
            report.warning(key, said, Text.of("check.same_cob_id_off_advice", use=off.text))


def _collision(use: _Use, other: _Use, more: int) -> Text:
    name, cob_id, whose = use.text, use.cob_id, other.text
    if more:
        return Text.of("check.same_cob_ids", use=name, cob_id=cob_id, other=whose, more=more)
    return Text.of("check.same_cob_id", use=name, cob_id=cob_id, other=whose)


def _uses(bus: CheckedBus) -> Iterator[_Use]:
    table = bus.table
    bridge = ""
    yield _Use(cobid.NMT, "NMT", bridge, bus.key)
    yield _Use(cobid.SYNC, "SYNC", bridge, bus.key, active=bool(table.sync_period_ms))
    yield _Use(cobid.TIME, "TIME", bridge, bus.key, active=bool(table.time_period_s))
    for cob_id in _LSS:
        yield _Use(cob_id, "LSS", bridge, bus.key, active=False)
    yield _Use(
        cobid.ERROR_CONTROL + table.master_node_id,
        Text.of("use.heartbeat"),
        bridge,
        (*bus.key, "master_node_id"),
        active=bool(table.heartbeat_ms),
    )
    for node in bus.nodes:
        yield from _node_uses(node)


def _node_uses(node: CheckedNode) -> Iterator[_Use]:
    node_id, name, key = node.table.id, node.table.name, (*node.key, "id")
    if node.emcy_id is not None:
        yield _Use(node.emcy_id, "EMCY", name, key)
    yield _Use(cobid.SDO_REQUEST + node_id, Text.of("use.sdo_request", number=1), name, key)
    yield _Use(cobid.SDO_REPLY + node_id, Text.of("use.sdo_reply", number=1), name, key)
    yield _Use(cobid.ERROR_CONTROL + node_id, Text.of("use.error_control"), name, key)
    for server in node.family.sdo:
        is_open = server.number in node.table.sdo_channels
        request = Text.of("use.sdo_request", number=server.number)
        reply = Text.of("use.sdo_reply", number=server.number)
        yield _Use(server.request + node_id, request, name, key, active=is_open)
        yield _Use(server.reply + node_id, reply, name, key, active=is_open)
    for pdo in node.pdos:
        moved = pdo.cob_id_key
        yield _Use(pdo.cob_id, pdo.name, name, moved or key, active=pdo.enabled, moved=moved is not None)
