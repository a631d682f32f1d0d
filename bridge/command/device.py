"""Device, a node without drives: the signals of its TPDOs as points, and their quality."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, Protocol

from bridge.catalogue import DeviceSpec
from bridge.command.drive import Identification
from bridge.command.drive_link import REASONS, DriveLink, NodeState
from bridge.command.messages.request import Identity, Role
from bridge.command.outputs import Outputs, Telling
from bridge.image import Image, Quality, Value
from bridge.mapping.device_signals import Signal
from bridge.mapping.entry_types import ObjectRef
from bridge.text import Said, Text


@dataclass(frozen=True, slots=True)
class InputPdo:
    """A TPDO as the boot-up has found it. ``objects`` has one for each of its entries, None for a dummy;
    ``deadline_s`` is the longest regular pause between two of them, None if it is sent on change only."""

    name: str
    objects: tuple[ObjectRef | None, ...]
    deadline_s: float | None


@dataclass(slots=True)
class _InputTpdo:
    """One TPDO: the points that show its entries, and their quality."""

    pdo: InputPdo
    link: DriveLink
    shown: list[tuple[int, Signal, int]] = field(default_factory=list[tuple[int, Signal, int]])
    """Place of the entry, its signal, and the index of its point."""
    quality: tuple[Quality, Said] | None = None
    told: tuple[tuple[int, ObjectRef, int], ...] = ()
    """Entries that are outputs: place, object, and the mask that takes the sign away."""
    told_values: list[tuple[ObjectRef, int]] = field(default_factory=list[tuple[ObjectRef, int]])
    """Last values of these."""

    @property
    def points(self) -> list[int]:
        return [index for _, _, index in self.shown]


class Access(Protocol):
    """Rights to command a device, and the requests about it that were refused."""

    @property
    def refused_writes(self) -> int: ...

    def refusal(self, identity: Identity) -> Text | None:
        """Reason why ``identity`` may not command it; None where it may."""
        ...

    def on_refused(self, now: float) -> None:
        """Count a request about it that was refused."""
        ...


class InputAccess:
    """Access to a device of inputs alone: there is nothing to command, and an operator sets its parameters.
    ``place`` is that of the count in the image."""

    def __init__(self, image: Image, place: int) -> None:
        self.refused_writes = 0
        self._image, self._place = image, place

    def refusal(self, identity: Identity) -> Text | None:
        if identity.role < Role.OPERATOR:
            return Text.of("request.may_only_read", who=str(identity))
        return None

    def on_refused(self, now: float) -> None:
        self.refused_writes += 1
        self._image.set(self._place, self.refused_writes, now)


class Device:
    """One node: its inputs, and its outputs where it has some, which are ``commanded``. Times are monotonic
    seconds."""

    def __init__(self, spec: DeviceSpec, image: Image, commanded: Sequence[Outputs] = ()) -> None:
        node, family = spec.node, spec.family
        self.spec = spec
        self.name = node.name
        self.commanded = commanded
        self.family = family
        self._hold_ms = node.hold_ms
        self._image = image
        self._node = NodeState.ABSENT
        self._signals = {signal.object: signal for signal in family.input}
        self._points = {
            signal.object: image.index[f"{node.name}/input/{signal.name}"] for signal in family.input
        }
        self._age = image.index[f"{node.name}/node/pdo_age_ms"]
        self._refused, self._abort_code = (
            image.index[f"{node.name}/supervision/{leaf}"] for leaf in ("refused_writes", "sdo_abort_code")
        )
        self.identification = Identification()
        """Identity of its node, by the last boot-up."""
        channels = (one.channel for one in commanded)
        self._access: Access = next(channels, InputAccess(image, self._refused))
        self._heard: list[_InputTpdo] = []
        self._unserved: dict[int, Text] = {}
        """Points that no TPDO carries, with the reason."""
        self._state: tuple[Quality, Said] = (Quality.WAITING, "")
        """Quality of the inputs that no known TPDO carries."""

    def begin(self, now: float) -> None:
        """Show what is known from the start."""
        self._image.set(self._refused, 0, now)
        self._image.set(self._abort_code, 0, now)
        self._judge(now)

    def on_pdos(self, pdos: Sequence[InputPdo], unserved: Mapping[ObjectRef, Text], now: float) -> None:
        """Take over the TPDOs found at boot-up; ``unserved`` has the reason for inputs that none carries."""
        self._heard = []
        in_charge = _in_charge(pdos)
        for place, pdo in enumerate(pdos):
            link = DriveLink(0.0, self._hold_ms)
            link.on_boot(pdo.deadline_s, ())
            link.on_node(self._node, now)
            heard = _InputTpdo(pdo, link)
            for entry, ref in enumerate(pdo.objects):
                if ref is not None and ref in self._signals and in_charge[ref] == place:
                    heard.shown.append((entry, self._signals[ref], self._points[ref]))
            self._heard.append(heard)
        for outputs in self.commanded:
            self._find_told(outputs, in_charge)
        self._unserved = {self._points[ref]: why for ref, why in unserved.items()}
        self._judge(now)

    def _find_told(self, outputs: Outputs, in_charge: Mapping[ObjectRef, int]) -> None:
        """Note the outputs that its TPDOs carry, too."""
        masks = {one.object: (1 << one.size) - 1 for one in self.family.output}
        for place, heard in enumerate(self._heard):
            heard.told = tuple(
                (entry, ref, masks[ref])
                for entry, ref in enumerate(heard.pdo.objects)
                if ref is not None and ref in masks and in_charge[ref] == place
            )
        outputs.on_telling(
            {ref: Telling(one.pdo.name, one.pdo.deadline_s) for one in self._heard for _, ref, _ in one.told}
        )

    def on_node(self, state: NodeState, now: float) -> None:
        self._node = state
        for heard in self._heard:
            heard.link.on_node(state, now)
        self._judge(now)
        for outputs in self.commanded:
            outputs.channel.on_node(state, now)

    def on_heard_again(self) -> None:
        """Do nothing: its inputs come with the next TPDOs."""

    def on_data(self, place: int, values: Sequence[int], now: float) -> None:
        """Take over the TPDO at this place of ``pdos``: the values of its entries, with their signs."""
        heard = self._heard[place]
        if heard.told:
            self._tell(heard, values, now)
        heard.link.on_pdo(now)
        if heard.quality != (Quality.GOOD, ""):
            self._judge_one(heard, now)
        shown: list[Value] = [signal.decode(values[entry]) for entry, signal, _ in heard.shown]
        self._image.set_values(heard.points, shown, now)

    def _tell(self, heard: _InputTpdo, values: Sequence[int], now: float) -> None:
        """Tell the outputs of their values in a TPDO, before the link knows of it."""
        told = [(ref, values[entry] & mask) for entry, ref, mask in heard.told]
        last, deadline_s = heard.link.last_pdo, heard.pdo.deadline_s
        is_late = last is not None and deadline_s is not None and now - last > deadline_s
        for outputs in self.commanded:
            if outputs.stop_check.is_owed or told != heard.told_values:
                outputs.on_told(told, now, after_pause=is_late)
        heard.told_values = told

    def on_time(self, now: float) -> None:
        """Judge which TPDOs are late, and show their age."""
        for heard in self._heard:
            heard.link.on_time(now)
        self._judge(now)
        self._image.keep(self._age, self.age_ms(now), now)

    def look(self, now: float) -> None:
        """Bring to ``now`` what changes by itself: the quality of its inputs, and times of its outputs."""
        self.on_time(now)
        for outputs in self.commanded:
            outputs.look(now)

    def next_deadline(self) -> float | None:
        times = [heard.link.next_deadline() for heard in self._heard]
        return min((time for time in times if time is not None), default=None)

    @property
    def quality(self) -> Quality:
        """Quality of its inputs as a whole: the worst of its TPDOs."""
        return worst_of([heard.quality[0] for heard in self._shown if heard.quality] or [self._state[0]])

    def age_ms(self, now: float) -> int:
        """Age in ms of the oldest of its TPDOs; FFFFFFFFh where one has never come."""
        return max((heard.link.age_ms(now) for heard in self._shown), default=0xFFFF_FFFF)

    @property
    def _shown(self) -> list[_InputTpdo]:
        """TPDOs that carry points."""
        return [heard for heard in self._heard if heard.shown]

    # a member of its node

    @property
    def is_enabled(self) -> bool:
        """One of its outputs is anything but safe."""
        return any(outputs.is_moving for outputs in self.commanded)

    def refusal(self, identity: Identity) -> Text | None:
        """Reason why ``identity`` may not command it; None where it may."""
        return self._access.refusal(identity)

    @property
    def refused_writes(self) -> int:
        return self._access.refused_writes

    def on_refused(self, now: float) -> None:
        """Count a request about it that was refused elsewhere."""
        self._access.on_refused(now)

    def on_sdo_refused(self, abort_code: int, now: float) -> None:
        """Show the abort code of an SDO that a client had asked for."""
        self._image.set(self._abort_code, abort_code, now)

    def on_parameter(self, name: str, setting: float, now: float) -> None:
        """Do nothing: none of its points depends on a parameter."""

    def _judge(self, now: float) -> None:
        for heard in self._heard:
            self._judge_one(heard, now)
        state = self._state_of_node()
        self._state = state
        known = {index for heard in self._heard for index in heard.points}
        for index in self._points.values():
            if index in known:
                continue
            quality, reason = state
            why = self._unserved.get(index)
            if why and quality in (Quality.GOOD, Quality.STALE, Quality.LOST):
                quality, reason = Quality.CONFIG_ERROR, why
            self._image.judge((index,), quality, now, reason)

    def _judge_one(self, heard: _InputTpdo, now: float) -> None:
        quality = heard.link.quality(now)
        if quality is Quality.STALE and heard.link.last_pdo is None:
            quality = Quality.WAITING
        is_good = quality is Quality.GOOD
        reason = "" if is_good else Text.of("quality.no_pdo_of_node", pdo=heard.pdo.name)
        if self._node is not NodeState.OPERATIONAL:
            reason = REASONS[self._node]
        if (quality, reason) != heard.quality:
            heard.quality = quality, reason
            self._image.judge(heard.points, quality, now, reason)

    def _state_of_node(self) -> tuple[Quality, Said]:
        match self._node:
            case NodeState.OPERATIONAL:
                return Quality.GOOD, ""
            case NodeState.DISABLED:
                return Quality.DISABLED, REASONS[self._node]
            case NodeState.CONFIG_ERROR:
                return Quality.CONFIG_ERROR, REASONS[self._node]
            case _:
                return Quality.WAITING, REASONS[self._node]


def _in_charge(pdos: Sequence[InputPdo]) -> dict[ObjectRef, int]:
    """Place of the TPDO that shows each object: of several that carry it, as encoders have them, the one that
    comes most often. One sent on change only, or waiting for a SYNC that is not sent, is the last choice."""
    chosen: dict[ObjectRef, int] = {}
    order = sorted(range(len(pdos)), key=lambda place: (pdos[place].deadline_s or float("inf"), place))
    for place in order:
        for ref in pdos[place].objects:
            if ref is not None:
                chosen.setdefault(ref, place)
    return chosen


_FROM_GOOD_TO_BAD: Final = (
    Quality.GOOD,
    Quality.STALE,
    Quality.DEVICE_FAULT,
    Quality.LOST,
    Quality.WAITING,
    Quality.CONFIG_ERROR,
    Quality.DEAD,
    Quality.DISABLED,
)


def worst_of(qualities: Iterable[Quality]) -> Quality:
    """The quality of several as a whole; waiting where there are none."""
    return max(qualities, key=_FROM_GOOD_TO_BAD.index, default=Quality.WAITING)
