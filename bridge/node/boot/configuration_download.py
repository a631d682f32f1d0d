"""Download of a node's configuration in order, compared first and read back (CiA 302-2, CiA 302-3).

A node that keeps a configuration date and time (1020h) is asked for it first: if it is ours, nothing is
downloaded. The date that the bridge writes is derived from the configuration itself, so that a changed site
file is never taken for the one the node has.
"""

from __future__ import annotations

import zlib
from collections.abc import Generator, Sequence
from typing import Final

from bridge.base.sdo_texts import text_of
from bridge.canopen.datatypes import INTEGERS, NUMBERS
from bridge.canopen.dialogue import SdoRead, SdoWrite, optional
from bridge.canopen.sdo import SdoError
from bridge.canopen.width import holds
from bridge.config.download import Download
from bridge.node.boot.actions import Action, BootResult, BootStep, Do, number, told_as, write_number
from bridge.node.boot.error_status import BootError
from bridge.node.boot.memory import BootMemory
from bridge.node.boot.pdo_downloads import download_pdo, is_pdo, pdo_parameter
from bridge.text import Text, Words

_VERIFY: Final = 0x1020
_STORE: Final = 0x1010
_SAVE: Final = b"save"
_UNANSWERED_STORES: Final = 3
_DAY_MS: Final = 86_400_000
_DAYS: Final = 0xFFFF


def configuration_stamp(downloads: Sequence[Download]) -> tuple[int, int]:
    """Date (days since 1984-01-01) and time (ms) that identify this configuration in 1020h.

    Those in the list, where a DCF brings its own; else derived from the content.
    """
    given = {download.sub: number(download.data) for download in downloads if download.index == _VERIFY}
    if 1 in given and 2 in given:
        return given[1], given[2]
    content = b"".join(
        download.index.to_bytes(2, "little") + bytes((download.sub,)) + download.data
        for download in downloads
    )
    days = 1 + zlib.crc32(content) % _DAYS
    return days, zlib.crc32(content, days) % _DAY_MS


def configure(downloads: Sequence[Download], *, store: bool, result: BootResult) -> Do:
    """Bring the node's objects to ``downloads``; ``store`` saves them with 1010h:1 if one was written, now or
    in an earlier boot-up that did not get as far as storing.

    Raises BootError J with object, expected and read. A value that the node does not keep is written once.
    """
    memory = result.memory
    wanted = [download for download in downloads if download.index != _VERIFY]
    if not wanted:
        return
    yield BootStep(Text.of("boot_step.compare"), "J", needed_by="configure")
    stamp = configuration_stamp(downloads)
    days = yield from optional(_VERIFY, 1)
    has_stamp = days is not None
    is_stored = not (store and memory.unsaved)
    if is_stored and has_stamp and (number(days), number((yield from optional(_VERIFY, 2)))) == stamp:
        result.notes.append(Text.of("boot.has_configuration"))
        return
    written = 0
    parts = _parts(wanted)
    for place, part in enumerate(parts, 1):
        what = Text.of("boot_step.download", place=place, count=len(parts))
        yield BootStep(what, "J", needed_by="configure")
        if is_pdo(part[0].index):
            written += yield from download_pdo(part, memory)
        else:
            written += yield from download(part[0], memory)
    if has_stamp:
        for sub, value in enumerate(stamp, 1):
            yield from _write(Download(_VERIFY, sub, value.to_bytes(4, "little")))
    if store and (memory.unsaved or has_stamp):
        yield from _store(memory, has_stamp=has_stamp)
    if written:
        result.notes.append(Text.of("boot.configured", written=written, count=len(wanted)))


def _store(memory: BootMemory, *, has_stamp: bool) -> Do:
    """Write "save" to 1010h. A store that fails is owed until it succeeds: the date in 1020h is taken back,
    so that nobody takes this configuration for the one that the node will have after its next start.

    A node that takes "save" without an answer may have stored all the same: it is not asked for ever.
    """
    yield BootStep(Text.of("boot_step.store"), "J", needed_by="configuration_store")
    if memory.unanswered_stores >= _UNANSWERED_STORES:
        raise BootError("J", Text.of("boot.store_unanswered", times=_UNANSWERED_STORES))
    memory.unsaved = True
    try:
        yield SdoWrite(_STORE, 1, _SAVE)
    except SdoError as error:
        memory.unanswered_stores += not error.by_server
        if has_stamp:
            yield from _take_stamp_back()
        raise BootError("J", Text.of("boot.not_stored", why=text_of(error))) from None
    memory.unsaved = False
    memory.unanswered_stores = 0


def _take_stamp_back() -> Do:
    try:
        yield SdoWrite(_VERIFY, 1, bytes(4))
    except SdoError:
        return  # the store is owed all the same, as long as the bridge runs


def _parts(downloads: Sequence[Download]) -> list[list[Download]]:
    """Downloads in order, one by one; those of one PDO together, at the place of the first."""
    parts: dict[object, list[Download]] = {}
    for place, download in enumerate(downloads):
        key = ("PDO", pdo_parameter(download.index)) if is_pdo(download.index) else place
        parts.setdefault(key, []).append(download)
    return list(parts.values())


def download(one: Download, memory: BootMemory) -> Generator[Action, bytes | None, int]:
    """Download one object; returns 1 where it was written, else 0. Raises BootError J."""
    what = one.index, one.sub, one.data
    if not one.read_back:
        if one.is_command and memory.has_done(*what):
            return 0
        yield from _write(one)
        if one.is_command:
            memory.note_command(*what)
        else:
            memory.unsaved = True
        return 1
    have = yield from optional(one.index, one.sub)
    if have is not None and holds(have, one.data, signed=_is_signed(one)):
        return 0
    if memory.was_not_kept(*what):
        raise _not_kept(one, have)
    memory.unsaved = True
    yield from _write(one, have)
    read = yield from _read_back(one, memory)
    if read is None or not holds(read, one.data, signed=_is_signed(one)):
        memory.note_not_kept(*what)
        raise _not_kept(one, read)
    return 1


def _not_kept(download: Download, read: bytes | None) -> BootError:
    found, written = _shown(read), _shown(download.data)
    what = Text.of("boot.not_kept", object=download.name, read=found, written=written)
    return BootError("J", what)


def _read_back(download: Download, memory: BootMemory) -> Generator[Action, bytes | None, bytes | None]:
    def unreadable(error: SdoError) -> BootError:
        memory.note_not_kept(download.index, download.sub, download.data)
        written = _shown(download.data)
        return BootError("J", Text.of("boot.not_read_back", why=text_of(error), written=written))

    with told_as(unreadable):
        return (yield SdoRead(download.index, download.sub))


def _is_signed(download: Download) -> bool:
    return download.kind in INTEGERS and INTEGERS[download.kind].signed


def _write(download: Download, have: bytes | None = None) -> Do:
    """Write one object; ``have`` is the value read before. A command is written as it is."""

    def refused(error: SdoError) -> BootError:
        return BootError("J", Text.of("boot.not_taken", why=text_of(error), wanted=_shown(download.data)))

    with told_as(refused):
        if have is None:
            yield SdoWrite(download.index, download.sub, download.data)
        else:
            is_number = download.kind in NUMBERS
            yield from write_number(
                download.index,
                download.sub,
                download.data,
                have,
                is_number=is_number,
                signed=_is_signed(download),
            )


def _shown(data: bytes | None) -> Words:
    """A value as shown to people: a hexadecimal number up to eight bytes, else the bytes."""
    if data is None:
        return Text.of("boot.nothing")
    if 0 < len(data) <= 8:
        return f"{int.from_bytes(data, 'little'):0{2 * len(data)}X}h"
    return data.hex(" ").upper() or Text.of("boot.empty")
