"""A site file for the nodes that were found on a bus."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from bridge.derive.toml import ascii_words, one_line, string, value
from bridge.mapping import Family

_PORT: Final = 1502
_MASTER_ID: Final = 127


@dataclass(frozen=True, slots=True)
class ProposedNode:
    """A node as it was found. ``says`` is its identity in words; without a mapping it becomes a comment.
    ``why`` is a comment, too: why none fits, or none better."""

    id: int
    device_name: str
    says: str
    mapping: str | None
    has_heartbeat: bool | None = None
    """None: it was not asked."""
    has_guarding: bool | None = None
    why: str = ""


@dataclass(frozen=True, slots=True)
class ProposedBus:
    """Bus on which the nodes were found."""

    interface: str
    channel: str | None
    bitrate: int


def propose_site(
    name: str, bus: ProposedBus, nodes: Sequence[ProposedNode], families: Mapping[str, Family]
) -> str:
    """The text of a site file. Nothing in it moves a drive: ``control`` is ``none`` everywhere."""
    return "\n".join(_lines(name, bus, nodes, families)) + "\n"


def _lines(
    name: str, bus: ProposedBus, nodes: Sequence[ProposedNode], families: Mapping[str, Family]
) -> Iterator[str]:
    yield "# Proposed by `drivebridge scan --write` from what the nodes say of themselves. Look through it,"
    yield "# give the nodes names, and each drive that is to be commanded control and fieldbus_timeout_ms."
    yield "[site]"
    yield f"name = {string(name)}"
    yield 'state_dir = "state"'
    yield 'runtime_dir = "run"'
    yield ""
    yield "[[bus]]"
    yield 'name = "can0"'
    yield f"interface = {string(bus.interface)}"
    if bus.channel is not None:
        yield f"channel = {value(bus.channel)}"
    yield f"bitrate = {bus.bitrate}"
    taken = {node.id for node in nodes}
    if _MASTER_ID in taken:
        yield f"master_node_id = {max(set(range(1, 128)) - taken)}      # {_MASTER_ID} is a node's"
    names: set[str] = set()
    for node in nodes:
        yield ""
        family = families.get(node.mapping) if node.mapping else None
        yield from _node(node, _unique(_name(node), names), family)
    yield ""
    yield "[modbus]"
    yield f'listen = "127.0.0.1:{_PORT}"'


def _node(node: ProposedNode, name: str, family: Family | None) -> Iterator[str]:
    yield f"# {one_line(f'{node.device_name}: ' if node.device_name else '')}{one_line(node.says)}"
    if node.why:
        yield f"# {one_line(node.why)}"
    if node.mapping is None or family is None:
        yield "# [[bus.node]]"
        yield f"# name = {string(name)}"
        yield f"# id = {node.id}"
        yield '# mapping = ""'
        return
    facts = family.family
    off = "" if facts.node_id_low <= node.id <= facts.node_id_high else "# "
    if off:
        yield f"# {facts.name} has the addresses {facts.node_id_low}…{facts.node_id_high} only."
    yield f"{off}[[bus.node]]"
    yield f"{off}name = {string(name)}"
    yield f"{off}id = {node.id}"
    yield f"{off}mapping = {string(node.mapping)}"
    if node.has_heartbeat is False and node.has_guarding is False:
        yield f'{off}supervision = "none"      # it has neither 1017h nor 100Ch: nobody notices its loss'
    elif node.has_heartbeat is False:
        yield f'{off}supervision = "guarding"      # it has no 1017h'
    for slot in family.slot:
        yield ""
        yield f"{off}[[bus.node.drive]]"
        yield f"{off}slot = {string(slot.name)}"
        yield f'{off}control = "none"'
        scales = sorted({name for one in family.values_of(slot) for name in one.scaled_by})
        if scales:
            given = ", ".join(f"{scale} = " for scale in scales)
            yield f"# parameters = {{ {given} }}      # where they cannot be read from the drive"


def _name(node: ProposedNode) -> str:
    """A name in lower_snake_case, of what the device calls itself."""
    words = "_".join(ascii_words(node.device_name))[:24].strip("_")
    if not words or not words[0].isalpha():
        words = f"node_{words}".strip("_")
    return words if words != "node" else f"node_{node.id}"


def _unique(name: str, names: set[str]) -> str:
    number, unique = 1, name
    while unique in names:
        number += 1
        unique = f"{name}_{number}"
    names.add(unique)
    return unique
