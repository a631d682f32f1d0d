"""Words of the command line for each kind of what is commanded: drives, and outputs of a node without."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from bridge.catalogue import DeviceSpec, DriveSpec, MemberSpec


@dataclass(frozen=True, slots=True)
class KindWords:
    """``runs_on``: what it would do where a silent bridge does not stop it. ``drop_test``: what a drop test
    does with it, with ``{node}`` and its ``{id}``."""

    runs_on: str
    drop_test: str


_WORDS: Final[Mapping[type[MemberSpec], KindWords]] = {
    DriveSpec: KindWords(
        "run on",
        "The drives of {node} (id {id}) are booted, get stopped words, and are then left without supervision "
        "until they report a fault. None is enabled; all of them will have to be acknowledged.",
    ),
    DeviceSpec: KindWords(
        "keep its outputs",
        "{node} (id {id}) is booted, its outputs get their safe values, and it is then left without "
        "supervision until it leaves Operational.",
    ),
}


def words_of(one: MemberSpec) -> KindWords:
    return _WORDS[type(one)]
