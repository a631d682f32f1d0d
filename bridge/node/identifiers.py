"""Identifiers of the nodes of one bus: which of them are another node's."""

from __future__ import annotations

from typing import Protocol


class Identified(Protocol):
    """A node by the COB-IDs that are its own."""

    @property
    def given_ids(self) -> frozenset[int]:
        """COB-IDs that the site's files give to its PDOs."""
        ...

    def uses(self, cob_id: int) -> bool:
        """Whether it uses this COB-ID at present, for a PDO or anything else."""
        ...


class BusIdentifiers:
    """COB-IDs of all nodes of one bus, as each of them asks for those of the others."""

    def __init__(self) -> None:
        self._all: list[Identified] = []

    def add(self, one: Identified) -> None:
        self._all.append(one)

    def is_taken(self, asks: Identified, cob_id: int) -> bool:
        """Whether another node than the one that ``asks`` uses this COB-ID."""
        return any(one.uses(cob_id) for one in self._all if one is not asks)

    def is_foreign(self, asks: Identified, cob_id: int) -> bool:
        """Whether this COB-ID is another node's, or will be by the site's files."""
        others = (one for one in self._all if one is not asks)
        return any(one.uses(cob_id) or cob_id in one.given_ids for one in others)
