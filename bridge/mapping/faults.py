"""Emergency messages and fault numbers of a family."""

from __future__ import annotations

import re
from typing import Annotated, Final

from pydantic import AfterValidator, Field

from bridge.mapping import emcy_codes
from bridge.mapping.entry_types import Decimal, EmcyCode, FaultNumber, Table, Wording
from bridge.text import Text, Words
from bridge.tomlfile import Unfit

FORM_FIELD: Final = re.compile(r"\{(number|group|hex|bits (\d{1,2})-(\d{1,2}))(?::(\d))?\}")
"""Fields of a ``FaultForm``, with the least number of their digits."""
_NAME: Final = re.compile(r"\d{1,10}(\.\d{1,3})?|[0-9A-F]{2}(?:[0-9A-F]{2}|xx)h")


def _form(text: str) -> str:
    if re.search(r"[{}]", FORM_FIELD.sub("", text)):
        raise Unfit(Text.of("mapping.fault_form"))
    return text


def _fault_name(text: str) -> str:
    if not _NAME.fullmatch(text):
        raise Unfit(Text.of("mapping.fault_name"))
    return text


FaultForm = Annotated[str, AfterValidator(_form)]
FaultName = Annotated[str, AfterValidator(_fault_name)]


class EmcyEvent(Table):
    """Event number in the emergency message: it decides, and the code comes second."""

    byte: int = Field(ge=3, le=7)
    cause_byte: int | None = Field(None, ge=3, le=7)
    gone: int | None = Field(None, ge=0, le=255, description="the event that says: no fault any more")


class EmcyNumber(Table):
    """Error number in the manufacturer's bytes, where the code is one of ``codes``."""

    codes: list[EmcyCode] = Field(min_length=1)
    byte: int = Field(ge=3, le=7)
    size: int = Field(ge=1, le=4)
    mask: int | None = Field(
        None, gt=0, description="the bits by which a text is found; the others say how the drive reacts"
    )


class EmcyTable(Table):
    drive_byte: int | None = Field(None, ge=2, le=7, description="byte that says which drive it is about")
    codes: dict[EmcyCode, str] = Field(description="EMCY code in hexadecimal to text; xx matches any")
    event: EmcyEvent | None = None
    number: EmcyNumber | None = None
    events: dict[Decimal, str] = Field(
        default_factory=dict[str, str], description="event or error number in decimal to text"
    )

    def text(self, code: int) -> Words:
        """Text of an EMCY code, or of its group: the family's own, else that of CiA 301."""
        name = f"{code:04X}"
        return self.codes.get(name) or self.codes.get(f"{name[:2]}xx") or emcy_codes.text(code)


class Explanation(Table):
    """A manual's explanation of a fault, in one language; empty where it gives none."""

    cause: str = ""
    remedy: str = ""


class FaultEntry(Table):
    """Cause and remedy of a fault, in our own words."""

    name: FaultName = Field(description="a number of `texts`, an event, an event and its cause, or a code")
    source: str = Field("", description="place in the manual")
    en: Explanation = Field(default_factory=lambda: Explanation.model_validate({}))
    de: Explanation = Field(default_factory=lambda: Explanation.model_validate({}))


class Advised(Table):
    """General advice in one language, always with both sentences."""

    cause: str = Field(min_length=1, description="most frequent cause, as the rest of a sentence")
    remedy: str = Field(min_length=1, description="remedy, in whole sentences")


class Advice(Table):
    """General advice for one kind of fault, in our own words."""

    en: Advised
    de: Advised


class FaultParameter(Table):
    """A fault number that the drive itself keeps."""

    parameter: str = Field(description="a [[parameter]]")


class FaultNumbers(Table):
    """Numbers that the bridge reports in the family's own words."""

    controller_silent: float
    bridge_timeout: float = Field(description="the bus interface's own fault for the same event")
    telegram_downtime: float
    node_missing: float
    silent_bus: list[FaultName] = Field(
        default_factory=list[str], description="faults with which the drive itself answers a silent bus"
    )
    prefix: str = ""
    form: FaultForm = Field("", description="form in which the maker writes a number that the drive tells")
    form_to: float | None = Field(None, description="numbers above it are written as they are")
    elsewhere: Wording | None = Field(
        None, description="manual that knows more of a fault that has general advice alone"
    )
    kinds: dict[FaultName, str] = Field(
        default_factory=dict[str, str],
        description="kind of each fault, an entry of `advice`, by what a [[fault]] would be called",
    )
    other_kind: str | None = Field(None, description="the kind of every fault that `kinds` does not have")
    advice: dict[str, Advice] = Field(
        default_factory=dict[str, Advice],
        description="general advice, for faults without cause and remedy of their own",
    )
    texts: dict[FaultNumber, str]
    german: dict[FaultName, str] = Field(
        default_factory=dict[str, str], description="texts in German, by what a [[fault]] would be called"
    )
    current: FaultParameter | None = None
    last: FaultParameter | None = None
