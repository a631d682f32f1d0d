"""What a drive family is: the content of a file below ``mappings/``.

The models are the schema (``mappings/schema.json`` is made from them); everything the service knows
of a vendor's drive is in such a file.
"""

from __future__ import annotations

import re
from typing import Annotated, Final, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field

from bridge.config.model import Name, RegularExpression
from bridge.image import DataType

_OBJECT: Final = re.compile(r"([0-9A-Fa-f]{4}):([0-9A-Fa-f]{2})")
_PATTERN: Final = re.compile(r"[01X]{1,16}")
_CODE: Final = re.compile(r"[0-9A-F]{4}|[0-9A-F]{2}xx")
_NUMBER: Final = re.compile(r"\d+\.\d")


class Table(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


class ObjectRef(Table):
    """An entry of the object dictionary."""

    index: int
    sub: int

    def __str__(self) -> str:
        return f"{self.index:04X}:{self.sub:02X}"


def _object(text: object) -> object:
    if isinstance(text, ObjectRef):
        return text
    match = _OBJECT.fullmatch(text) if isinstance(text, str) else None
    if not match:
        raise ValueError('must be an object as "3002:01", index and sub-index in hexadecimal')
    return ObjectRef(index=int(match[1], 16), sub=int(match[2], 16))


def _pattern(text: str) -> str:
    text = text.replace(" ", "")
    if not _PATTERN.fullmatch(text):
        raise ValueError("must be written with 0, 1 and X (do not care), highest bit first")
    return text


def _code(text: str) -> str:
    if not _CODE.fullmatch(text):
        raise ValueError("must be four hexadecimal digits in capitals, or two and xx for the group")
    return text


def _number(text: str) -> str:
    if not _NUMBER.fullmatch(text):
        raise ValueError('must be a fault number with one decimal, such as "10.3"')
    return text


Ref = Annotated[ObjectRef, BeforeValidator(_object)]
Pattern = Annotated[str, AfterValidator(_pattern)]
Word = Annotated[int, Field(ge=0, le=0xFFFF)]
Bit = Annotated[int, Field(ge=0, le=15)]
Bits = Annotated[list[str], Field(max_length=16, description="names of the bits from bit 0 on")]
Kind = Annotated[DataType, Field(strict=False)]
EmcyCode = Annotated[str, AfterValidator(_code)]
FaultNumber = Annotated[str, AfterValidator(_number)]


def pattern_bits(pattern: str) -> tuple[int, int]:
    """``"0XX1000"`` as (mask, value): the word matches where ``word & mask == value``."""
    mask = int("".join("0" if c == "X" else "1" for c in pattern), 2)
    value = int(pattern.replace("X", "0"), 2)
    return mask, value


class FamilyTable(Table):
    name: str
    vendor: str
    source: str = Field(description="the manual that the facts of this file are taken from")
    node_id_low: int = Field(1, ge=1, le=127)
    node_id_high: int = Field(127, ge=1, le=127)


class IdentityRule(Table):
    """What 1000h and 1018h must hold; what is absent is not compared."""

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


class Pdo(Table):
    """One PDO of a slot. ``objects`` gives for each word the objects that may stand for it, the
    factory's first; the order is that of ``process.rpdo`` or ``process.tpdo``."""

    number: int = Field(ge=1, le=512)
    cob_id: int = Field(ge=0, le=0x7FF, description="without the node id, such as 0x200")
    objects: list[Annotated[list[Ref], Field(min_length=1)]]
    signed: list[Ref] = Field(
        default_factory=list[ObjectRef], description="objects shorter than a word that hold signed numbers"
    )


class NodeTpdo(Table):
    """A TPDO that belongs to no drive: where the node has it switched on, it saves polling."""

    number: int = Field(ge=1, le=512)


class Slot(Table):
    """One drive of the node."""

    name: Name
    rpdo: Pdo
    tpdo: Pdo
    emcy_drive: int | None = Field(None, description="the value of the EMCY drive byte for this drive")
    parameters_by_sdo: bool = Field(
        False, description="true where this drive's parameters are reached by the default SDO channel"
    )


class SdoServer(Table):
    """A further SDO server of the node, beside the first, which every node has at 600h and 580h."""

    number: int = Field(ge=2, le=128, description="2 is object 1201h")
    request: int = Field(ge=0, le=0x7FF, description="COB-ID to the node without the node id, such as 0x640")
    reply: int = Field(ge=0, le=0x7FF, description="COB-ID from the node without the node id")
    slot: Name | None = Field(None, description="the drive it reaches; left out: the same as the first")
    after_stop: bool = Field(
        False, description="true where a change counts only after Stopped and Pre-Operational"
    )


class Process(Table):
    """Names of the words in the order they stand in the PDOs."""

    rpdo: list[Name] = Field(min_length=1, description="control_word, then the setpoint words")
    tpdo: list[Name] = Field(min_length=1, description="status_word, then the words of actual values")
    exact_length: bool = Field(False, description="true where a PDO of any other length is not evaluated")
    forbidden_types: list[Annotated[int, Field(ge=0, le=255)]] = Field(
        default_factory=list[int], description="transmission types that the drives do not have"
    )


class Scale(Table):
    """value = word × full / at, with ``full`` a parameter of the drive such as P105."""

    full: str
    at: int = Field(gt=0)
    limit: float = Field(2.0, gt=0, description="largest magnitude as a multiple of full")


class ScaledValue(Table):
    """A value with a unit beside the raw word it is made from."""

    name: Name
    group: Literal["command", "actual"]
    word: str
    scale: Scale
    unit: str
    description: str = ""

    @property
    def leaf(self) -> str:
        """Its name below the drive, such as ``actual/frequency``."""
        return f"{self.group}/{self.name}"


class Command(Table):
    """Bits that a command sets in the control word: ``word & ~mask | value``."""

    mask: Word
    value: Word


class ControlWord(Table):
    bits: Bits
    valid_bit: Bit | None = Field(None, description="must be 1 or the drive ignores the telegram")
    acknowledge_bit: Bit
    enabling: Command = Field(description="a word with these bits makes the drive move")
    stopped: Word = Field(description="valid, and moves nothing: what the bridge starts with")
    ready: Word = Field(description="leads from switch-on inhibited to ready")
    run: Word = Field(description="leads from ready to operation enabled")
    forward: Word = 0
    reverse: Word = 0
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
    state: list[State]


class Parameter(Table):
    """A parameter that the bridge itself needs: value = wire × factor."""

    name: str
    title: str
    object: Ref
    data_type: Kind
    factor: float = 1.0
    unit: str = ""
    read: bool = Field(True, description="false where it can only be given in the site file")


class Poll(Table):
    """An object of the node that is read again and again and shown as a point of the node."""

    name: Name
    object: Ref
    data_type: Kind
    every_ms: int = Field(ge=100)
    description: str = ""
    bits: list[str] = Field(default_factory=list[str])


class EmcyTable(Table):
    drive_byte: int | None = Field(None, ge=2, le=7, description="byte that says which drive it is about")
    codes: dict[EmcyCode, str] = Field(description="EMCY code in hexadecimal to text; xx matches any")

    def text(self, code: int) -> str:
        """The text of an EMCY code, or of its group."""
        name = f"{code:04X}"
        return self.codes.get(name) or self.codes.get(f"{name[:2]}xx") or "unknown code"


class FaultNumbers(Table):
    """Numbers that the bridge reports in the family's own words."""

    controller_silent: float
    bridge_timeout: float = Field(description="the bus interface's own fault for the same event")
    telegram_downtime: float
    node_missing: float
    prefix: str = ""
    texts: dict[FaultNumber, str]


class OwnTimeout(Table):
    """The object by which the node itself watches the bridge's process data; 0 in it is off."""

    object: Ref
    unit_ms: float = Field(1.0, gt=0, description="what one step of it is, in ms")


class Family(Table):
    """One mapping file."""

    family: FamilyTable
    identity: IdentityRule = Field(default_factory=lambda: IdentityRule.model_validate({}))
    process: Process
    sdo: list[SdoServer] = Field(default_factory=list[SdoServer])
    slot: list[Slot] = Field(min_length=1)
    value: list[ScaledValue] = Field(default_factory=list[ScaledValue])
    control_word: ControlWord
    status_word: StatusWord
    parameter: list[Parameter] = Field(default_factory=list[Parameter])
    poll: list[Poll] = Field(default_factory=list[Poll])
    node_tpdo: list[NodeTpdo] = Field(default_factory=list[NodeTpdo])
    emcy: EmcyTable
    faults: FaultNumbers
    own_timeout: OwnTimeout | None = None

    def slot_named(self, name: str) -> Slot:
        """Raises KeyError where the family has no such slot."""
        for slot in self.slot:
            if slot.name == name:
                return slot
        raise KeyError(name)
