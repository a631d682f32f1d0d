"""Reads files for clients: the methods of FileType (OPC 10000-20 §4.2)."""

from __future__ import annotations

import asyncio
import contextlib
import os
from collections.abc import Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path
from typing import Final

from bridge.northbound.opcua.history.black_box_files import BlackBoxFiles
from bridge.northbound.opcua.requests.methods import call_result
from bridge.northbound.opcua.space.data_values import INTEGER_TYPES
from bridge.northbound.opcua.space.nodes import FileNode
from bridge.uaserver.library import ObjectIds, ServiceError, StatusCodes, get, node_id, ua, variant

MOST_OPEN: Final = 10
"""Limit for one session."""
MOST_OPEN_IN_ALL: Final = 200
MOST_READ: Final = 1 << 20
"""Bytes that one Read gives at most; the rest comes with the next."""

_READ: Final = 1
_Type = ua.VariantType


@dataclass(slots=True)
class _OpenFile:
    owner: str
    file: FileNode
    path: Path
    descriptor: int
    size: int
    position: int = 0
    lock: asyncio.Lock = field(default_factory=asyncio.Lock)
    """Held while the file is read: its descriptor is not closed meanwhile."""


class FileTransfer:
    """Open files of all sessions, which are called by their names. What is open can be read to its end, also
    where it is no longer among the newest."""

    def __init__(self, files: BlackBoxFiles) -> None:
        self._files = files
        self._open: dict[int, _OpenFile] = {}
        self._handles = count(1)
        self._closing: set[asyncio.Task[None]] = set()

    async def call(
        self, owner: str, file: FileNode, method: ua.NodeId, given: Sequence[ua.Variant]
    ) -> ua.CallMethodResult:
        """Carry out ``method`` of ``file`` for the session ``owner``."""
        act, arguments = _METHODS[method]
        if len(given) != arguments:
            few = len(given) < arguments
            return call_result(StatusCodes.BadArgumentsMissing if few else StatusCodes.BadTooManyArguments)
        if method == WRITE:
            return call_result(StatusCodes.BadNotWritable)
        faults = [StatusCodes.Good if _is_integer(one) else StatusCodes.BadTypeMismatch for one in given]
        if any(faults):
            return call_result(StatusCodes.BadInvalidArgument, faults)
        try:
            results = await act(self, owner, file, [one.Value for one in given])
        except ServiceError as error:
            return call_result(int(error.code))
        except OSError:
            return call_result(StatusCodes.BadUnexpectedError)
        return call_result(StatusCodes.Good, faults, results)

    def leave(self, owner: str) -> None:
        """The session has ended, or its connection has: what it had open is closed."""
        for handle in [one for one, held in self._open.items() if held.owner == owner]:
            task = asyncio.get_running_loop().create_task(self._close(handle))
            self._closing.add(task)
            task.add_done_callback(self._closing.discard)

    async def settled(self) -> None:
        """Wait until all is closed that is to be."""
        await asyncio.gather(*self._closing)

    # the methods

    async def open(self, owner: str, file: FileNode, given: Sequence[int]) -> list[ua.Variant]:
        (mode,) = given
        if mode != _READ:
            writes = mode & ~_READ
            raise ServiceError(StatusCodes.BadNotWritable if writes else StatusCodes.BadInvalidArgument)
        mine = sum(held.owner == owner for held in self._open.values())
        if mine >= MOST_OPEN or len(self._open) >= MOST_OPEN_IN_ALL:
            raise ServiceError(StatusCodes.BadTooManyOperations)
        found = self._files.find(file.drive, file.number)
        if found is None:
            raise ServiceError(StatusCodes.BadNotReadable)
        handle = next(self._handles)
        descriptor = os.open(found.path, os.O_RDONLY | os.O_CLOEXEC)
        self._open[handle] = _OpenFile(owner, file, found.path, descriptor, found.size)
        await self._files.count_opened(file.drive, found.path, 1)
        return [variant(handle, _Type.UInt32)]

    async def close(self, owner: str, file: FileNode, given: Sequence[int]) -> list[ua.Variant]:
        self._held(owner, file, given[0])
        await self._close(given[0])
        return []

    async def read(self, owner: str, file: FileNode, given: Sequence[int]) -> list[ua.Variant]:
        held = self._held(owner, file, given[0])
        length = given[1]
        if length <= 0:
            raise ServiceError(StatusCodes.BadInvalidArgument)
        async with held.lock:
            self._held(owner, file, given[0])
            # A disk may take long.
            how = held.descriptor, min(length, MOST_READ), held.position
            data = await asyncio.to_thread(os.pread, *how)
            held.position += len(data)
        return [variant(data, _Type.ByteString)]

    async def get_position(self, owner: str, file: FileNode, given: Sequence[int]) -> list[ua.Variant]:
        return [variant(self._held(owner, file, given[0]).position, _Type.UInt64)]

    async def set_position(self, owner: str, file: FileNode, given: Sequence[int]) -> list[ua.Variant]:
        held = self._held(owner, file, given[0])
        # Part 20 §4.2.7: a position behind the end is the end.
        held.position = min(max(given[1], 0), held.size)
        return []

    async def write(self, owner: str, file: FileNode, given: Sequence[int]) -> list[ua.Variant]:
        raise ServiceError(StatusCodes.BadNotWritable)

    def _held(self, owner: str, file: FileNode, handle: int) -> _OpenFile:
        held = self._open.get(handle)
        if held is None or held.owner != owner or held.file != file:
            raise ServiceError(StatusCodes.BadInvalidArgument)
        return held

    async def _close(self, handle: int) -> None:
        held = self._open.pop(handle, None)
        if held is not None:
            async with held.lock:
                with contextlib.suppress(OSError):
                    os.close(held.descriptor)
            await self._files.count_opened(held.file.drive, held.path, -1)


def _is_integer(given: ua.Variant) -> bool:
    return not given.is_array and given.VariantType in INTEGER_TYPES and given.Value is not None


_Method = Callable[[FileTransfer, str, FileNode, Sequence[int]], Awaitable[list[ua.Variant]]]

WRITE: Final = node_id(ObjectIds.FileType_Write)
_METHODS: Final[Mapping[ua.NodeId, tuple[_Method, int]]] = {
    node_id(ObjectIds.FileType_Open): (FileTransfer.open, 1),
    node_id(ObjectIds.FileType_Close): (FileTransfer.close, 1),
    node_id(ObjectIds.FileType_Read): (FileTransfer.read, 2),
    WRITE: (FileTransfer.write, 2),
    node_id(ObjectIds.FileType_GetPosition): (FileTransfer.get_position, 1),
    node_id(ObjectIds.FileType_SetPosition): (FileTransfer.set_position, 2),
}
"""Deeds, and the numbers of their arguments, by the methods of FileType, which all files share."""

READING: Final = frozenset(_METHODS) - {WRITE}


def file_method(call: ua.CallMethodRequest) -> ua.NodeId | None:
    """The method, where it is one of a file's."""
    method: ua.NodeId = get(call, "MethodId")
    return method if method in _METHODS else None
