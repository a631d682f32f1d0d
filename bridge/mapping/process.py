"""Process data of a family: words, PDOs, slots, and the values made of the words."""

from __future__ import annotations

from typing import Annotated, Final, Literal

from pydantic import BeforeValidator, Field, ValidationInfo, field_validator

from bridge.canopen.datatypes import INTEGERS, TypeName, encode
from bridge.config.download import Download
from bridge.config.field_types import PlainValue, listed
from bridge.image import DataType
from bridge.mapping.axes import MOST_AXES
from bridge.mapping.entry_types import Bit, Mapped, Name, ObjectRef, Ref, States, Table, Wording, said_of
from bridge.text import Text

MOST_WORDS: Final = 9
"""Largest number of words: control or status word and eight values, for which Modbus has registers."""
ValueKind = Literal["int16", "uint16", "int32", "uint32", "real32"]
REAL: Final = "real32"
"""Type of a floating-point number of two words (CiA 301 §7.1.6.6), which is its own value, without a
scale."""
LARGEST_REAL: Final = float.fromhex("0x1.fffffep+127")
"""Largest number of a real32."""


class Process(Table):
    """Names of the words, in the order of the registers, and of the words in a PDO that names none."""

    rpdo: list[Name] = Field(
        min_length=1, max_length=MOST_WORDS, description="control_word, then the setpoint words"
    )
    tpdo: list[Name] = Field(
        min_length=1, max_length=MOST_WORDS, description="status_word, then the words of actual values"
    )
    rest: dict[Name, Annotated[int, Field(ge=0, le=0xFFFF)]] = Field(
        default_factory=dict[str, int],
        description="words of `rpdo` that are not 0 while nobody commands them, such as a mode of operation",
    )
    exact_length: bool = Field(False, description="true where a PDO of any other length is not evaluated")
    forbidden_types: list[Annotated[int, Field(ge=0, le=255)]] = Field(
        default_factory=list[int], description="transmission types that the drives do not have"
    )

    @property
    def resting(self) -> tuple[int, ...]:
        """Setpoint words while nobody commands them."""
        return tuple(self.rest.get(word, 0) for word in self.rpdo[1:])


class Pdo(Table):
    """One PDO of a slot. ``objects`` gives for each word the objects that may stand for it, the
    factory's first; the order is that of ``words``, or of ``process.rpdo`` or ``process.tpdo``."""

    number: int = Field(ge=1, le=512)
    cob_id: int = Field(ge=0, le=0x7FF, description="without the node id, such as 0x200")
    words: list[Name] = Field(
        default_factory=list[str], description="words that it carries; left out: all of them"
    )
    objects: list[Annotated[list[Mapped], Field(min_length=1)]]
    signed: list[Ref] = Field(
        default_factory=list[ObjectRef], description="objects shorter than a word that hold signed numbers"
    )
    static: bool = Field(
        False,
        description="true: what it carries is fixed and the node does not show it; its mapping object is "
        "not read, and `objects` only names the words",
    )
    optional: bool = Field(False, description="true: the drive works without it, its words do not")
    write: bool = Field(False, description="true: the boot-up writes it into the node where it differs")
    transmission_type: int | None = Field(None, ge=0, le=255, description="0…255, with write = true")
    inhibit_ms: float | None = Field(None, ge=0, le=6553.5, description="0…6553.5 ms, with write = true")
    event_ms: int | None = Field(None, ge=0, le=65535, description="0…65535 ms, with write = true")


class NodeTpdo(Table):
    """A TPDO that belongs to no drive: where the node has it switched on, its objects need no polling."""

    number: int = Field(ge=1, le=512)


SYNC_PERIOD: Final = "sync_period_ms"
"""Placeholder in a start write for the value that the bus of the site has under this name."""


def _is_sync_period(kind: str, value: object) -> bool:
    return value == SYNC_PERIOD and kind in INTEGERS and kind != "bool"


class StartWrite(Table):
    """One object that the boot-up writes for a drive, such as its mode of operation."""

    object: Ref
    type: TypeName = Field(description="the object's data type, such as int8")
    value: PlainValue = Field(description='"sync_period_ms" with an integer type: what the bus has, in ms')
    read_back: bool = Field(True, description="false writes it blindly, as a command")

    @field_validator("value")
    @classmethod
    def _encodes(cls, value: bool | int | float | str, info: ValidationInfo) -> bool | int | float | str:
        """Check that the type can hold the value: a fault here is the value's, with its line. Without a type
        there is a fault already."""
        kind = info.data.get("type")
        if kind is not None and not _is_sync_period(kind, value):
            encode(kind, value)
        return value

    @property
    def is_sync_period(self) -> bool:
        """Whether the value is the SYNC period of the bus."""
        return _is_sync_period(self.type, self.value)

    def value_with(self, sync_period_ms: int) -> bool | int | float | str:
        """Value on a bus with this SYNC period."""
        return sync_period_ms if self.is_sync_period else self.value

    def download(self, sync_period_ms: int) -> Download:
        """Download of the value. Raises ValueError where the SYNC period does not fit the type."""
        data = encode(self.type, self.value_with(sync_period_ms))
        return Download(self.object.index, self.object.sub, data, self.read_back, self.type)


Pdos = Annotated[
    list[Pdo],
    Field(min_length=1),
    BeforeValidator(listed, json_schema_input_type=Pdo | Annotated[list[Pdo], Field(min_length=1)]),
]


class Slot(Table):
    """One drive of the node."""

    name: Name
    axis: int = Field(
        1,
        ge=1,
        le=MOST_AXES,
        description="axis of the node that it is, for CiA 402: its parameters and its own supervision are "
        "800h × (axis − 1) behind those of 6000h … 67FFh that this file names; PDOs and `start` name objects "
        "as the node has them",
    )
    rpdo: Pdos
    tpdo: Pdos
    start: list[StartWrite] = Field(default_factory=list[StartWrite])
    emcy_drive: int | None = Field(None, description="the value of the EMCY drive byte for this drive")
    parameters_by_sdo: bool = Field(
        False, description="true where this drive's parameters are reached by the default SDO channel"
    )


class SdoServer(Table):
    """A further SDO server of the node, besides the first, which every node has at 600h and 580h."""

    number: int = Field(ge=2, le=128, description="2 is object 1201h")
    request: int = Field(ge=0, le=0x7FF, description="COB-ID to the node without the node id, such as 0x640")
    reply: int = Field(ge=0, le=0x7FF, description="COB-ID from the node without the node id")
    slot: Name | None = Field(None, description="the drive it reaches; left out: the same as the first")
    after_stop: bool = Field(
        False, description="true where a change counts only after Stopped and Pre-Operational"
    )


class Scale(Table):
    """Scale of a value = word × full / at, with ``full`` a parameter of the drive such as P105, divided by
    another one, ``over``, where there is one; or value = word × factor + offset."""

    full: str | None = None
    at: int | None = Field(None, gt=0)
    over: str | None = Field(None, description="a further parameter, by which the value is divided")
    limit: float = Field(2.0, gt=0, description="largest magnitude as a multiple of full")
    factor: float = Field(1.0, allow_inf_nan=False)
    offset: float = Field(0.0, allow_inf_nan=False)


class Meaning(Table):
    """Setting of the drive that says what one word carries: ``parameter`` has a code, which values name."""

    group: Literal["command", "actual"]
    word: Name
    parameter: str = Field(description="the parameter that holds the code, such as P543[2]")
    default: int = Field(
        0, description="the code that is taken where there is no drive to ask: in a DBC and by `monitor`"
    )
    absent: int | None = Field(
        None, description="the code that counts where the drive refuses to tell it, as one without the object"
    )
    otherwise: str | Wording | None = Field(
        None,
        description="text for values that name another code than the drive's; left out: that they are "
        "not in the telegram",
    )

    @property
    def leaf(self) -> str:
        """Name of the word below the drive, such as ``actual/value_2``."""
        return f"{self.group}/{self.word}"

    @property
    def said_otherwise(self) -> Text:
        """Reason why the word has no value while a code names another one."""
        return said_of(self.otherwise) or Text.of("meaning.not_in_telegram")


class ProcessValue(Table):
    """A value made from raw words and shown beside them: a number with a unit, an enumeration, named bits or
    one bit."""

    name: Name
    group: Literal["command", "actual"]
    word: str | None = Field(None, description="the word it is made from")
    words: list[str] = Field(
        default_factory=list[str], max_length=2, description="two words, the low one first"
    )
    code: list[int] = Field(
        default_factory=list[int],
        max_length=2,
        description="the code by which the drive names it (`[[meaning]]`), for two words that of the low one "
        "first; without word and words it is made from whichever words have these codes",
    )
    data_type: ValueKind | None = Field(None, description="int16 (int32 for two words) where left out")
    scale: Scale | None = None
    unit: str = ""
    low: float | None = Field(None, allow_inf_nan=False)
    high: float | None = Field(None, allow_inf_nan=False)
    states: States = Field(default_factory=dict[int, str])
    bits: list[str] = Field(
        default_factory=list[str], max_length=32, description="names of the bits from bit 0 on"
    )
    bit: Bit | None = Field(None, description="one bit of the word, as true or false")
    follows: str | None = Field(
        None,
        description="an actual value whose words this command has until the drive is enabled, so that "
        "enabling moves nothing",
    )
    when: dict[str, Annotated[list[float], Field(min_length=1)]] = Field(
        default_factory=dict[str, list[float]],
        description="values of each parameter with which this value means what it says",
    )
    needs: str | None = Field(
        None, description="another value, such as command/position, without which this one means nothing"
    )
    steady: list[str] = Field(
        default_factory=list[str],
        description="parameters that give it another meaning when they are changed, nobody can tell which",
    )
    otherwise: str | Wording | None = Field(
        None,
        description="text where a parameter in `when` has another value; left out: that it means "
        "something else",
    )
    description: str | Wording = ""

    @property
    def leaf(self) -> str:
        """Name of the value below the drive, such as ``actual/frequency``."""
        return f"{self.group}/{self.name}"

    @property
    def said_otherwise(self) -> Text:
        """Reason why the value means nothing while a parameter in ``when`` has another value."""
        return said_of(self.otherwise) or Text.of("meaning.something_else")

    @property
    def word_names(self) -> tuple[str, ...]:
        """Words it is made from, the low one first; none where a code tells which they are."""
        return (self.word,) if self.word is not None else tuple(self.words)

    @property
    def width(self) -> int:
        """Number of words it is made from."""
        return len(self.code) or len(self.word_names)

    @property
    def is_real(self) -> bool:
        """Whether its words are a floating-point number."""
        return self.data_type == REAL

    @property
    def raw_type(self) -> DataType:
        """Type as which its words are read."""
        if self.data_type is not None:
            return DataType.FLOAT if self.is_real else DataType(self.data_type)
        unsigned = bool(self.bits or self.states)
        if self.width > 1:
            return DataType.UINT32 if unsigned else DataType.INT32
        return DataType.UINT16 if unsigned else DataType.INT16

    @property
    def is_signed(self) -> bool:
        """Whether its words are an integer with a sign in the topmost bit."""
        return not self.is_real and INTEGERS[self.raw_type].signed

    @property
    def raw_range(self) -> tuple[int, int] | tuple[float, float]:
        if self.is_real:
            return -LARGEST_REAL, LARGEST_REAL
        number = INTEGERS[self.raw_type]
        return number.low, number.high

    @property
    def point_type(self) -> DataType:
        """Type of its point: a float where it is scaled."""
        if self.bit is not None:
            return DataType.BOOL
        return self.raw_type if self.scale is None else DataType.FLOAT

    @property
    def full(self) -> str | None:
        """Parameter that scales it, or None."""
        return None if self.scale is None else self.scale.full

    @property
    def scaled_by(self) -> tuple[str, ...]:
        """Parameters that scale it."""
        named = () if self.scale is None else (self.scale.full, self.scale.over)
        return tuple(name for name in named if name is not None)

    @property
    def is_conditional(self) -> bool:
        """Whether the drive's parameters decide if there is such a value."""
        return bool(self.code or self.when or self.needs)
