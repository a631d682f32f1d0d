"""Emergency messages and fault numbers of a family."""

from __future__ import annotations

from pydantic import Field

from bridge.mapping import emcy_codes
from bridge.mapping.fields import Decimal, EmcyCode, FaultNumber, Table


class EmcyEvent(Table):
    """An event number in the emergency message, which decides; the code comes second."""

    byte: int = Field(ge=3, le=7)
    cause_byte: int | None = Field(None, ge=3, le=7)
    gone: int | None = Field(None, ge=0, le=255, description="the event that says: no fault any more")


class EmcyNumber(Table):
    """An error number in the manufacturer's bytes, where the code is one of ``codes``."""

    codes: list[EmcyCode] = Field(min_length=1)
    byte: int = Field(ge=3, le=7)
    size: int = Field(ge=1, le=4)


class EmcyTable(Table):
    drive_byte: int | None = Field(None, ge=2, le=7, description="byte that says which drive it is about")
    codes: dict[EmcyCode, str] = Field(description="EMCY code in hexadecimal to text; xx matches any")
    event: EmcyEvent | None = None
    number: EmcyNumber | None = None
    events: dict[Decimal, str] = Field(
        default_factory=dict[str, str], description="event or error number in decimal to text"
    )

    def text(self, code: int) -> str:
        """The text of an EMCY code, or of its group: the family's own, else that of CiA 301."""
        name = f"{code:04X}"
        return self.codes.get(name) or self.codes.get(f"{name[:2]}xx") or emcy_codes.text(code)


class FaultParameter(Table):
    """A fault number that the drive itself keeps."""

    parameter: str = Field(description="a [[parameter]]")


class FaultNumbers(Table):
    """Numbers that the bridge reports in the family's own words."""

    controller_silent: float
    bridge_timeout: float = Field(description="the bus interface's own fault for the same event")
    telegram_downtime: float
    node_missing: float
    prefix: str = ""
    texts: dict[FaultNumber, str]
    current: FaultParameter | None = None
    last: FaultParameter | None = None
