"""Model of a drive family: the content of a file below ``mappings/``.

The models are the schema (``mappings/schema.json`` is made from them); everything the service knows of a
vendor's drive is in such a file.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Literal

from pydantic import Field, PrivateAttr

from bridge.config import DriveTable
from bridge.config.field_types import RegularExpression
from bridge.mapping.aliases import Aliases
from bridge.mapping.axes import STANDARDISED, on_axis
from bridge.mapping.device_signals import Output, Signal, no_process
from bridge.mapping.entry_types import Bit, Bits, Kind, Name, ObjectRef, Pattern, Ref, Table, Word, Wording
from bridge.mapping.entry_types import MappedObject as MappedObject
from bridge.mapping.entry_types import pattern_bits as pattern_bits
from bridge.mapping.faults import EmcyTable, FaultEntry, FaultNumbers
from bridge.mapping.faults import FaultParameter as FaultParameter
from bridge.mapping.own_supervision import OwnObject as OwnObject
from bridge.mapping.own_supervision import OwnReaction as OwnReaction
from bridge.mapping.own_supervision import OwnSupervision
from bridge.mapping.parameters import Eeprom, Parameter, ParameterNames, object_of
from bridge.mapping.process import Meaning, NodeTpdo, Pdo, Process, ProcessValue, SdoServer, Slot
from bridge.text import Text
from bridge.tomlfile import Unfit


class FamilyTable(Table):
    name: str
    vendor: str
    source: str = Field(description="the manual that the facts of this file are taken from")
    drive_type: Literal["frequency_converter", "servo_drive", "variable_speed_drive"] | None = Field(
        None,
        description="type of its drives in OPC 40400-1, for OPC UA. Left out: a drive of whatever type",
    )
    profile: int | None = Field(
        None,
        ge=0,
        le=0xFFFF,
        description="number of the device profile, such as 401: what its objects do when they are written. "
        "Left out: 402 for drives, elsewhere what `device_type` says; else an object is protected as in any",
    )
    read_only: str | Wording = Field(
        "",
        description="reason why the bridge writes neither outputs nor parameters into such a device, as "
        "`check` says and a refused write is told. Left out: it is written like any other",
    )
    template: bool = Field(False, description="true: it can only be extended, no site can use it")
    preferred: bool = Field(
        False, description="true: `scan` names it where other mappings fit equally well; not inherited"
    )
    stopped_by: Literal["stop_node", "reset_node"] = Field(
        "stop_node",
        description="the NMT command that stops its drives where no word reaches them: `reset_node` where "
        "they run on in the state Stopped",
    )
    node_id_low: int = Field(1, ge=1, le=127)
    node_id_high: int = Field(127, ge=1, le=127)


class IdentityRule(Table):
    """Required content of 1000h and 1018h; what is absent is not compared."""

    device_type: int | None = None
    device_type_mask: int | None = None
    vendor_id: int | None = None
    product_code: int | None = None
    product_code_mask: int | None = None
    revision: int | None = None
    revision_mask: int | None = None
    device_name: RegularExpression | None = Field(
        None, description="a regular expression found in 1008h; `scan` alone goes by it"
    )


class Command(Table):
    """Bits that a command sets in the control word: ``word & ~mask | value``."""

    mask: Word
    value: Word


class Handshake(Table):
    """Handover of a position to the drive: the bridge does it when the value is written."""

    value: Name = Field(description="the command value that is handed over, such as position")
    bit: Bit = Field(description="bit of the control word: its rising edge says that there is a new one")
    acknowledge_bit: Bit = Field(description="bit of the status word: 1 when the drive has taken it")


class ControlWord(Table):
    bits: Bits
    valid_bit: Bit | None = Field(None, description="must be 1 or the drive ignores the telegram")
    acknowledge_bit: Bit
    parameter_set_bits: list[Bit] = Field(
        default_factory=list[int],
        description="they choose the drive's parameter set, low bit first; all 0 is set 1",
    )
    enabling: Command = Field(description="a word with these bits makes the drive move")
    stopped: Word = Field(description="valid, and moves nothing: what the bridge starts with")
    ready: Word = Field(description="leads from switch-on inhibited to ready")
    run: Word = Field(description="leads from ready to operation enabled")
    forward: Word = 0
    reverse: Word = 0
    begin: Word = Field(0, description="bits that `Start` adds once the drive is enabled")
    handshake: Handshake | None = None
    stop: Command
    quick_stop: Command
    disable_voltage: Command


class State(Table):
    name: Literal[
        "not_ready",
        "switch_on_inhibited",
        "ready",
        "switched_on",
        "operation_enabled",
        "quick_stop_active",
        "fault_reaction_active",
        "fault",
    ]
    pattern: Pattern


class StatusWord(Table):
    bits: Bits
    parameter_set_bits: list[Bit] = Field(
        default_factory=list[int],
        description="they tell the drive's parameter set, low bit first; all 0 is set 1",
    )
    state: list[State]
    holding: Pattern | None = Field(
        None,
        description="*operation enabled* at standstill: how a drive looks that a stop keeps under voltage",
    )


class Stopping(Table):
    """Longest time that a drive may report itself enabled after a stop; beyond it, it ignores the stop."""

    off_ms: int = Field(
        250, ge=0, le=60_000, description="after a word that takes the voltage: the brake, the drive's cycle"
    )
    ramp_ms: int = Field(
        60_000, ge=0, le=600_000, description="after any other stop: the longest ramp, as far as it is known"
    )


class Poll(Table):
    """An object of the node that is read periodically and shown as a point of the node."""

    name: Name
    object: Ref
    data_type: Kind
    every_ms: int = Field(ge=100)
    description: str | Wording = ""
    bits: list[str] = Field(default_factory=list[str])


def _no_control_word() -> ControlWord:
    nothing = {"mask": 0, "value": 0}
    commands = ("enabling", "stop", "quick_stop", "disable_voltage")
    words = ("acknowledge_bit", "stopped", "ready", "run")
    none: dict[str, object] = {"bits": [], **dict.fromkeys(commands, nothing), **dict.fromkeys(words, 0)}
    return ControlWord.model_validate(none)


def _no_status_word() -> StatusWord:
    return StatusWord.model_validate({"bits": [], "state": []})


class Family(Table):
    """One mapping file, merged with those it extends: a family of drives or, without slots, a device that is
    no drive and has inputs instead of process data, control word and status word."""

    extends: str | None = Field(None, description='another mapping, such as "nord/sk-tu4-cao"')
    without: list[str] = Field(
        default_factory=list[str],
        description="parts that this file leaves out of the one it extends, such as `parameter:P150`",
    )
    family: FamilyTable
    identity: IdentityRule = Field(default_factory=lambda: IdentityRule.model_validate({}))
    process: Process = Field(default_factory=no_process)
    sdo: list[SdoServer] = Field(default_factory=list[SdoServer])
    slot: list[Slot] = Field(default_factory=list[Slot], description="one for each drive of the node")
    input: list[Signal] = Field(
        default_factory=list[Signal], description="values that the PDOs of a node without drives tell"
    )
    output: list[Output] = Field(
        default_factory=list[Output], description="values that the PDOs of a node without drives command"
    )
    meaning: list[Meaning] = Field(default_factory=list[Meaning])
    value: list[ProcessValue] = Field(default_factory=list[ProcessValue])
    control_word: ControlWord = Field(default_factory=_no_control_word)
    status_word: StatusWord = Field(default_factory=_no_status_word)
    stopping: Stopping = Field(default_factory=lambda: Stopping.model_validate({}))
    parameter_names: ParameterNames | None = None
    aliases: Aliases = Field(default_factory=Aliases)
    parameter: list[Parameter] = Field(default_factory=list[Parameter])
    eeprom: Eeprom | None = None
    poll: list[Poll] = Field(default_factory=list[Poll])
    node_tpdo: list[NodeTpdo] = Field(default_factory=list[NodeTpdo])
    emcy: EmcyTable
    faults: FaultNumbers
    fault: list[FaultEntry] = Field(default_factory=list[FaultEntry])
    own_supervision: list[OwnSupervision] = Field(default_factory=list[OwnSupervision])

    _axis: int = PrivateAttr(1)

    def of_axis(self, axis: int) -> Family:
        """Family as an axis of the node has it: its parameters are objects of that axis."""
        if axis == self._axis:
            return self
        made = self.model_copy()
        made._axis = axis
        return made

    def of_slot(self, slot: Slot) -> Family:
        """Family as the drive in this slot has it."""
        return self.of_axis(slot.axis)

    def place(self, ref: ObjectRef) -> ObjectRef:
        """Object that the axis has for one that the file names."""
        return ObjectRef(on_axis(ref.index, self._axis), ref.sub)

    def is_per_axis(self, ref: ObjectRef) -> bool:
        """Whether each axis of the node has an object of its own for this one of the file."""
        return ref.index in STANDARDISED and any(slot.axis > 1 for slot in self.slot)

    @property
    def is_device(self) -> bool:
        """Whether it describes a node without drives."""
        return not self.slot

    def slot_named(self, name: str) -> Slot:
        """Slot of this name. Raises KeyError where the family has none."""
        for slot in self.slot:
            if slot.name == name:
                return slot
        raise KeyError(name)

    def is_on_first(self, slot: Slot | None) -> bool:
        """Whether the node's first SDO channel, which has the node's own parameters, reaches this drive."""
        has_own_channel = slot is not None and any(server.slot == slot.name for server in self.sdo)
        return slot is None or slot.parameters_by_sdo or not has_own_channel

    def sdo_channel(self, slot: Slot, opened: Sequence[int]) -> int | None:
        """Number of the SDO server that reaches a drive's parameters, with these opened beside the first;
        None where none does."""
        if slot.parameters_by_sdo:
            return 1
        numbers = {server.number for server in self.sdo if server.slot == slot.name}
        return next((number for number in opened if number in numbers), None)

    def leaf_of(self, drive: DriveTable) -> str:
        """Name of a drive below its node: its own, else its slot's; ``drive`` where the family has one slot
        only."""
        return drive.name or (drive.slot if len(self.slot) > 1 else "drive")

    def parameter_named(self, name: str) -> Parameter:
        """Parameter of this name. Raises KeyError where the family lists none."""
        for parameter in self.parameter:
            if parameter.name == name:
                return parameter
        raise KeyError(name)

    def depends_on_set(self, value: ProcessValue) -> bool:
        """Whether a parameter that scales the value differs between the drive's parameter sets."""
        return any(self.parameter_named(name).sets for name in value.scaled_by)

    def steady_of(self, value: ProcessValue) -> list[str]:
        """Parameters whose change makes the value unknown: also one that scales it and is told in another
        form than the site file gives it."""
        return [*value.steady, *(name for name in value.scaled_by if not self.parameter_named(name).read)]

    def object_of(self, parameter: Parameter) -> ObjectRef:
        """Object of a parameter. Raises ``Unfit`` where it has none."""
        if parameter.object is not None:
            return self.place(parameter.object)
        if self.parameter_names is None:
            raise Unfit(Text.of("mapping.no_object", parameter=parameter.name))
        named = object_of(self.parameter_names, parameter.name, parameter.sets, parameter.elements)
        return self.place(named)

    def rpdo_words(self, pdo: Pdo) -> list[str]:
        """Words that this RPDO carries, in its order."""
        return pdo.words or self.process.rpdo

    def tpdo_words(self, pdo: Pdo) -> list[str]:
        """Words that this TPDO carries, in its order."""
        return pdo.words or self.process.tpdo

    def carried(self, slot: Slot) -> tuple[list[str], list[str]]:
        """Words of this drive: those of its RPDOs and those of its TPDOs, as ``process`` orders them. The
        others do not exist for it."""
        commanded = {word for pdo in slot.rpdo for word in self.rpdo_words(pdo)}
        actual = {word for pdo in slot.tpdo for word in self.tpdo_words(pdo)}
        return (
            [word for word in self.process.rpdo if word in commanded],
            [word for word in self.process.tpdo if word in actual],
        )

    def values_of(self, slot: Slot) -> list[ProcessValue]:
        """Values of this drive: those all of whose words it has, and those that enough of its words may be
        set to carry."""
        rpdo, tpdo = self.carried(slot)
        words = {"command": set(rpdo[1:]), "actual": set(tpdo)}

        def may_have(value: ProcessValue) -> bool:
            if value.code and not value.word_names:
                runs = self.meanings_of(slot, value.group)
                return any(len(run) >= value.width for run in runs)
            return words[value.group].issuperset(value.word_names)

        return [value for value in self.value if may_have(value)]

    def is_usual(self, slot: Slot, value: ProcessValue) -> bool:
        """Whether this drive's words carry the value while their codes are the mapping file's defaults."""
        runs = self.meanings_of(slot, value.group)
        if value.word_names:
            codes = {one.word: one.default for run in runs for one in run}
            named = zip(value.word_names, value.code, strict=False)
            return all(codes.get(word) == code for word, code in named)
        return any({one.default for one in run}.issuperset(value.code) for run in runs)

    def meanings_of(self, slot: Slot, group: str) -> list[list[Meaning]]:
        """Meanings of this drive's words, for each PDO of one direction."""
        by_word = {meaning.word: meaning for meaning in self.meaning if meaning.group == group}
        pdos = slot.rpdo if group == "command" else slot.tpdo
        words = self.rpdo_words if group == "command" else self.tpdo_words
        return [[by_word[word] for word in words(pdo) if word in by_word] for pdo in pdos]

    def told_by(self, slot: Slot, meaning: Meaning) -> str | None:
        """Word of a TPDO that carries the code itself, as where 6061h is mapped; None where none does."""
        ref = self.object_of_meaning(meaning, 1)
        for pdo in slot.tpdo if self.sets == 1 else ():
            for word, refs in zip(self.tpdo_words(pdo), pdo.objects, strict=True):
                if all(one.parts == (ref,) for one in refs):
                    return word
        return None

    def needed_bits(self, group: str) -> int:
        """Bits of the control word (of the status word for the group ``actual``) without which a drive cannot
        be commanded, or would be shown in a state that it is not in."""
        control, status = self.control_word, self.status_word
        handshake = [control.handshake] if control.handshake else []
        if group == "actual":
            found = 0
            for pattern in (*(state.pattern for state in status.state), *filter(None, [status.holding])):
                found |= pattern_bits(pattern)[0]
            bits = [*status.parameter_set_bits, *(one.acknowledge_bit for one in handshake)]
        else:
            found = control.stopped | control.ready | control.run
            found |= control.forward | control.reverse | control.begin
            for command in (control.enabling, control.stop, control.quick_stop, control.disable_voltage):
                found |= command.mask
            bits = [control.acknowledge_bit, *control.parameter_set_bits, *(one.bit for one in handshake)]
            bits += [] if control.valid_bit is None else [control.valid_bit]
        return found | sum(1 << bit for bit in set(bits))

    @property
    def sets(self) -> int:
        """Number of parameter sets that its drives have."""
        return 1 << len(self.status_word.parameter_set_bits)

    def parameter_and_set(self, name: str) -> tuple[str, int]:
        """Name of a parameter, and the parameter set that ``name`` ends with, 1 where it names none."""
        names = self.parameter_names
        match = re.fullmatch(names.pattern, name, re.ASCII) if names else None
        in_set = match.groupdict().get("set") if match else None
        if match is None or in_set is None:
            return name, 1
        return name[: match.start("set")].rstrip(".-_/ "), int(in_set)

    def object_in_set(self, ref: ObjectRef, in_set: int) -> ObjectRef:
        """Object of a parameter in this set, given its object in set 1."""
        step = self.parameter_names.set_step if self.parameter_names else 0
        return ObjectRef(ref.index, ref.sub + step * (in_set - 1))

    def object_of_meaning(self, meaning: Meaning, in_set: int) -> ObjectRef:
        """Object in which the drive says what a word carries. Raises ``Unfit`` where there is none."""
        if self.parameter_names is None:
            raise Unfit(Text.of("mapping.no_object", parameter=meaning.parameter))
        first = object_of(self.parameter_names, meaning.parameter, self.sets if self.sets > 1 else 0)
        return self.object_in_set(self.place(first), in_set)
