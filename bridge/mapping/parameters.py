"""Parameters of a family: their names and objects, their values, and the wear by writing them."""

from __future__ import annotations

import re
from typing import Annotated, Final, Literal

from pydantic import AfterValidator, Field, ValidationInfo, field_validator

from bridge.canopen.datatypes import Plain, TypeName, encode
from bridge.config.field_types import PlainValue
from bridge.image import DataType
from bridge.mapping.entry_types import ObjectRef, Ref, States, Table
from bridge.text import Text, Words
from bridge.tomlfile import Unfit

GROUPS: Final = ("number", "letter", "element", "set")
"""Groups that the pattern of parameter names may have."""
IndexRange = Annotated[str, Field(pattern=r"^[0-9A-F]{4}(-[0-9A-F]{4})?$")]
Protection = Literal["command", "communication", "safe", "may_move", "while_enabled"]
_PUNCTUATION: Final = re.compile(r"[^a-z0-9]+")
VALUE_TYPES: Final = {
    "bool": DataType.BOOL,
    "int8": DataType.INT16,
    "int16": DataType.INT16,
    "int32": DataType.INT32,
    "int64": DataType.FLOAT,
    "uint8": DataType.UINT8,
    "uint16": DataType.UINT16,
    "uint32": DataType.UINT32,
    "uint64": DataType.FLOAT,
    "real32": DataType.FLOAT,
    "real64": DataType.FLOAT,
    "string": DataType.STRING,
    "bytes": DataType.STRING,
}


def _name_pattern(text: str) -> str:
    try:
        pattern = re.compile(text, re.ASCII)
    except re.error as error:
        raise Unfit(Text.of("site.regular_expression", why=str(error))) from None
    unknown = sorted(set(pattern.groupindex) - set(GROUPS))
    if unknown:
        raise Unfit(Text.of("mapping.pattern_groups", groups=GROUPS, unknown=tuple(unknown)))
    if "number" not in pattern.groupindex:
        raise Unfit(Text.of("mapping.pattern_number", group="(?P<number>…)"))
    return text


class ParameterNames(Table):
    """Rule by which names of parameters become objects.

    index = ``index`` + ``letter_step`` × (letter − A) + ``number_step`` × number;
    sub-index = ``sub`` + ``element_step`` × (element − ``element_first``) + ``set_step`` × set.
    """

    pattern: Annotated[str, AfterValidator(_name_pattern)] = Field(
        description="a regular expression with the groups number, letter, element, set"
    )
    hexadecimal: bool = Field(False, description="true: number and element are written in hexadecimal")
    example: str = Field(description="form in which they are written, for messages")
    index: int = Field(ge=0, le=0xFFFF)
    number_step: int = 1
    letter_step: int = 0
    sub: int = Field(0, ge=0, le=0xFF, description="sub-index where nothing is given")
    element_step: int = 1
    element_first: int = Field(0, ge=0)
    set_step: int = 0
    protected: list[IndexRange] = Field(
        default_factory=list[str],
        description="objects that command the drive, such as 6040 or 3000-300F: never written as parameters",
    )
    settings: list[IndexRange] = Field(
        default_factory=list[str],
        description="objects among which the drive keeps its settings, such as 2064-20C7: a backup asks for "
        "all of them, and has what the file does not list as the drive sends it",
    )


def indices(text: str) -> range:
    """Indices of an ``IndexRange``, such as ``2064-20C7``."""
    first, _, last = text.partition("-")
    return range(int(first, 16), int(last or first, 16) + 1)


class Parameter(Table):
    """A parameter of the drive: value = number read × factor."""

    name: str = Field(min_length=1)
    title: str
    german: str = Field("", description="title in German")
    object: Ref | None = Field(None, description="left out: by [parameter_names]")
    data_type: TypeName
    factor: float = Field(1.0, allow_inf_nan=False)
    unit: str = ""
    low: float | None = Field(None, allow_inf_nan=False)
    high: float | None = Field(None, allow_inf_nan=False)
    access: Literal["rw", "ro", "wo"] = "rw"
    default: PlainValue | None = Field(
        None, description="raw value in a drive as delivered, without `factor`: for the simulator"
    )
    sets: int = Field(0, ge=0, le=16, description="number of parameter sets; 0: it has one value")
    elements: int = Field(0, ge=0, le=255, description="number of elements; 0: it is no array")
    states: States = Field(
        default_factory=dict[int, str],
        description="number to text; it takes no others, unless it has `low` and `high`",
    )
    german_states: States = Field(
        default_factory=dict[int, str], description="the same in German, with the numbers of `states`"
    )
    point: bool = Field(False, description="true: shown as a point of the drive")
    every_ms: int = Field(0, ge=0, le=3_600_000, description="period in which a point is read; 0: on demand")
    absent: float | None = Field(
        None, description="the value that counts where the drive refuses to tell it, as one without it"
    )
    read: bool = Field(True, description="false where it can only be given in the site file")
    volatile: bool = Field(False, description="true where a write does not go to the EEPROM")
    command: bool = Field(
        False,
        description="true: a write starts something, and what is read is how far it is: it is written even "
        "if the drive holds the value, and not read back",
    )
    protected: Protection | None = Field(
        None,
        description="command: never written as a parameter; communication, safe (how it stops, what it "
        "becomes), may_move: by an engineer, while the drive is not enabled; while_enabled: not written "
        "while the drive is enabled",
    )
    backup: bool = Field(True, description="false: identity, addresses and commands, in no parameter set")
    of_node: bool = Field(False, description="true: the node's own, over its first SDO channel")

    @field_validator("default")
    @classmethod
    def _encodes(cls, value: Plain | None, info: ValidationInfo) -> Plain | None:
        """Check that the type can hold the default. Without a type there is a fault already."""
        kind = info.data.get("data_type")
        if kind is not None and value is not None:
            encode(kind, value)
        return value

    @property
    def leaf(self) -> str:
        return leaf_of(self.name)

    @property
    def said_states(self) -> tuple[tuple[int, Words], ...]:
        """Values with their texts in the reader's language."""
        return tuple((code, self.said_state(code)) for code in self.states)

    def said_state(self, code: int) -> Words:
        """Text of a value in the reader's language; "" where it has none."""
        english, german = self.states.get(code, ""), self.german_states.get(code, "")
        return Text.both(english, german) if german else english

    @property
    def is_enumeration(self) -> bool:
        """True where it takes no value but those in ``states``."""
        return bool(self.states) and (self.low is None or self.high is None)

    @property
    def readable(self) -> bool:
        return self.access != "wo"

    @property
    def writable(self) -> bool:
        return self.access != "ro"

    @property
    def value_type(self) -> DataType:
        """Type of the value as users see it."""
        if self.factor != 1.0 and self.data_type not in ("string", "bytes", "bool"):
            return DataType.FLOAT
        return VALUE_TYPES[self.data_type]


def leaf_of(name: str) -> str:
    """Name of a parameter's point: ``P102[2]`` is ``p102_2``."""
    return _PUNCTUATION.sub("_", name.lower()).strip("_")


class RamOnly(Table):
    """A parameter and the value of it with which writes go to the RAM alone."""

    parameter: str
    value: int | float


class SaveCommand(Table):
    """A command of the device that saves the parameters: this value is written to this parameter."""

    parameter: str
    value: int


class Eeprom(Table):
    """Wear of the EEPROM by writes, and the way to save parameters."""

    cycles: int | None = Field(None, gt=0, description="writes that it endures")
    ram_only: RamOnly | None = None
    save: Ref | None = Field(None, description='"save" is written here, on request only')
    save_command: SaveCommand | None = Field(None, description="saves instead of `save`, on request only")
    written_on_save_only: bool = Field(False, description="true: a write stays in the RAM until it is saved")

    @property
    def can_save(self) -> bool:
        return self.save is not None or self.save_command is not None


def object_of(names: ParameterNames, name: str, sets: int = 0, elements: int = 0) -> ObjectRef:
    """Object of the parameter called ``name``. Raises ``Unfit`` with what is wrong.

    A name without a set means the first one of a parameter with ``sets``, one without an element the first of
    a parameter with ``elements``; elsewhere the sub-index is ``names.sub``. Where elements and sets share the
    sub-index, an element of a parameter without sets is in the first set (BU 2500 §6.6.1).
    """
    match = re.fullmatch(names.pattern, name, re.ASCII)
    numbers = None if match is None else _numbers_in(match, hexadecimal=names.hexadecimal)
    if match is None or numbers is None:
        raise Unfit(Text.of("mapping.no_parameter_name", name=name, example=names.example))
    index = names.index + names.letter_step * numbers["letter"] + names.number_step * numbers["number"]
    sub = names.sub
    element, in_set = numbers.get("element"), numbers.get("set")
    first = names.element_first
    if element is not None or elements:
        number = first if element is None else element
        sub += names.element_step * (number - first)
        if elements and not 0 <= number - first < elements:
            raise Unfit(Text.of("mapping.no_element", name=name, low=first, high=first + elements - 1))
    if in_set is not None or sets or (names.set_step and (element is not None or elements)):
        number = 1 if in_set is None else in_set
        sub += names.set_step * number
        if sets and not 1 <= number <= sets:
            raise Unfit(Text.of("mapping.no_set", name=name, high=sets))
    if not (0 <= index <= 0xFFFF and 0 <= sub <= 0xFF):
        raise Unfit(Text.of("mapping.impossible_object", name=name, index=index, sub=sub))
    return ObjectRef(index, sub)


def _numbers_in(match: re.Match[str], *, hexadecimal: bool) -> dict[str, int] | None:
    """Numbers of those groups that a name has, its letter counted from A; None where the pattern takes for a
    number or a letter what is none, or where the name has no number."""
    groups = {group: text for group, text in match.groupdict().items() if text is not None}
    letter = groups.pop("letter", "") or "A"
    base = 16 if hexadecimal else 10
    try:
        numbers = {group: int(text, 10 if group == "set" else base) for group, text in groups.items()}
        numbers["letter"] = ord(letter.upper()) - ord("A")
    except (ValueError, TypeError):  # several letters are no character
        return None
    return numbers if "number" in numbers else None
