"""A node by its objects alone: what a step of the boot-up asks is answered from them, without a bus."""

from __future__ import annotations

from collections.abc import Generator
from typing import TypeVar

from bridge.canopen.dialogue import SdoRead, SdoWrite
from bridge.canopen.sdo import SdoError

T = TypeVar("T")
NO_OBJECT = 0x0602_0000


class Answering:
    """``said`` has what is neither read nor written; objects in ``refused`` are not written."""

    def __init__(self, objects: dict[tuple[int, int], bytes] | None = None) -> None:
        self.objects = dict(objects or {})
        self.refused: set[tuple[int, int]] = set()
        self.silent: set[tuple[int, int]] = set()
        self.reads: list[tuple[int, int]] = []
        self.writes: list[tuple[int, int, bytes]] = []
        self.said: list[object] = []

    def run(self, steps: Generator[object, bytes | None, T]) -> T:
        answer: bytes | SdoError | None = None
        while True:
            try:
                asked = steps.throw(answer) if isinstance(answer, SdoError) else steps.send(answer)
            except StopIteration as end:
                return end.value
            answer = self._answer(asked)

    def _answer(self, asked: object) -> bytes | SdoError | None:
        if isinstance(asked, SdoRead):
            key = asked.index, asked.sub
            self.reads.append(key)
            if key in self.silent:
                return SdoError(*key, 0x0504_0000, by_server=False)
            data = self.objects.get(key)
            return SdoError(*key, NO_OBJECT, by_server=True) if data is None else data
        if isinstance(asked, SdoWrite):
            key = asked.index, asked.sub
            if key in self.refused:
                return SdoError(*key, NO_OBJECT, by_server=True)
            self.writes.append((*key, asked.data))
            self.objects[key] = asked.data
            return b""
        self.said.append(asked)
        return None
