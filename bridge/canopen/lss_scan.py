"""Every device without a node id: fastscan, one after the other (CiA 305 §6.7). Sans-IO.

A device that was found is in configuration state and should be silent in a scan. CANopenNode is not: there it
answers every query, and hides all devices that have not been found yet. If so, devices that keep answering
are sent back to waiting state, where they answer only what matches them; silent ones are kept in
configuration state by selecting them; and the others are told apart query by query.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Final

from bridge.canopen import lss
from bridge.canopen.lss import LssAddress, LssError, Service

_MOST_FOUND: Final = 127
_MOST_SPOILT: Final = 3
_FIELDS: Final = len(lss.FIELDS)
_TOO_LATE: Final = "devices answer too late: allow them more time"


@dataclass(slots=True)
class Scanned:
    """Filled while the scan goes on. ``keeps_answering``: which of those ``found`` answered further queries.
    ``problem``: why there may be more devices, empty if there are none."""

    found: list[LssAddress] = field(default_factory=list[LssAddress])
    keeps_answering: list[LssAddress] = field(default_factory=list[LssAddress])
    problem: str = ""


def find_all(known: LssAddress | None, scanned: Scanned | None = None) -> Service[Scanned]:
    """Every device without a node id, in ``scanned``; all are left in waiting state.

    A late answer that is taken for the answer to another query spoils a scan: no device confirms, or the
    identity found is wrong. The search is repeated with the time that the late answer has shown to be needed,
    and an identity counts only if the device can be selected by it.
    """
    scanned = scanned or Scanned()
    found = scanned.found
    spoilt = 0
    yield from lss.to_waiting()
    while len(found) < _MOST_FOUND:
        yield from lss.settle()
        if not (yield from lss.is_anybody_there(is_first=True)):
            break
        if found and (yield from lss.answers_everything()):
            yield from _among_talkers(known, scanned)
            return scanned
        try:
            identity = yield from lss.fastscan(known)
        except LssError as error:
            spoilt += 1
            if spoilt > _MOST_SPOILT:
                scanned.problem = str(error)
                break
            continue
        if identity not in found:
            found.append(identity)
        elif identity not in scanned.keeps_answering:
            # It did not enter configuration state, or answered late: now it is sent there.
            scanned.keeps_answering.append(identity)
            yield from _is_there(identity)
        else:
            yield from _among_talkers(known, scanned)
            return scanned
    yield from _keep_real(scanned)
    return scanned


def _keep_real(scanned: Scanned) -> Service[None]:
    """Drop identities that cannot be selected. Only one device at a time is in configuration state, because
    there CANopenNode takes any identity for its own."""
    for identity in tuple(scanned.found):
        yield from lss.to_waiting()
        if not (yield from _is_there(identity)):
            scanned.found.remove(identity)
    scanned.keeps_answering[:] = [one for one in scanned.keeps_answering if one in scanned.found]
    yield from lss.to_waiting()


def _is_there(identity: LssAddress) -> Service[bool]:
    try:
        yield from lss.switch_selective(identity)
    except LssError:
        return False
    return True


def _among_talkers(known: LssAddress | None, scanned: Scanned) -> Service[None]:
    """Go on with a scan in which a device keeps answering."""
    silent: list[LssAddress] = []
    for identity in tuple(scanned.found):
        yield from lss.to_waiting()
        if not (yield from _is_there(identity)):
            scanned.found.remove(identity)
        elif not (yield from lss.is_anybody_there()) or not (yield from lss.answers_everything()):
            silent.append(identity)
        elif identity not in scanned.keeps_answering:
            scanned.keeps_answering.append(identity)
    yield from lss.to_waiting()
    for identity in silent:
        yield from _is_there(identity)
    yield from lss.settle()
    if (yield from lss.is_anybody_there()) and (yield from lss.answers_everything()):
        scanned.problem = "a device that has not been found answers every question: the others are hidden"
    else:
        present = [one for one in scanned.keeps_answering if one in scanned.found and one not in silent]
        yield from _tell_all_apart(known, present, scanned)
    yield from _keep_real(scanned)


def _tell_all_apart(
    known: LssAddress | None, present: Collection[LssAddress], scanned: Scanned
) -> Service[None]:
    """Add the devices in waiting state; once more if an answer was missing."""
    for _ in range(_MOST_SPOILT):
        is_sure = yield from _tell_apart(known, present, scanned.found)
        scanned.problem = "" if is_sure else _TOO_LATE
        if is_sure:
            return


def _tell_apart(
    known: LssAddress | None, present: Collection[LssAddress], found: list[LssAddress]
) -> Service[bool]:
    """Add every device in waiting state to ``found``; none leaves that state. Those ``present`` are known to
    answer and are not queried. False: not all confirmed what they had answered.
    """
    is_sure = True
    branches: list[tuple[int, ...]] = [()]
    while branches and len(found) < _MOST_FOUND:
        branch = branches.pop()
        if not (yield from _go_to(branch)):
            is_sure = False
            continue
        sub = len(branch)
        certain = {one[sub] for one in present if one[:sub] == branch}
        values, confirmed = yield from _values(sub, known[sub] if known else 0, certain)
        is_sure &= confirmed
        if sub < _FIELDS - 1:
            branches += [(*branch, value) for value in values]
        else:
            new = [LssAddress._make((*branch, value)) for value in values]
            found += [identity for identity in new if identity not in found]
    return is_sure


def _go_to(branch: tuple[int, ...]) -> Service[bool]:
    """Begin again, and bring the devices whose first fields are these to the next field."""
    if not (yield from lss.is_anybody_there()):
        return False
    for sub, value in enumerate(branch):
        if not (yield from lss.enter(sub, value)):
            return False
    return True


def _values(sub: int, known: int, certain: Collection[int]) -> Service[tuple[list[int], bool]]:
    """The values of field ``sub`` in the devices that are at it, and whether all are confirmed."""
    if known:
        return [known], True  # who goes on says so
    found: list[int] = []
    confirmed = True
    branches = [(0, 31, True)]
    while branches:
        value, bit, is_answered = branches.pop()
        if bit < 0:
            if is_answered or value in certain or (yield from lss.has(sub, value)):
                found.append(value)
            else:
                confirmed = False
            continue
        low, high = value, value | 1 << bit
        has_low = _is_among(low, bit, certain) or (yield from lss.has(sub, low, bit))
        if has_low:
            branches.append((low, bit - 1, True))
        if _is_among(high, bit, certain) or (has_low and (yield from lss.has(sub, high, bit))):
            branches.append((high, bit - 1, True))
        elif not has_low:
            # A device matched the bits above: it has a 1 here, or its answer was lost.
            branches.append((high, bit - 1, False))
    return found, confirmed


def _is_among(value: int, bit: int, certain: Collection[int]) -> bool:
    return any(one >> bit == value >> bit for one in certain)
