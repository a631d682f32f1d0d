"""Habits of devices as files: where a simulated node's frames differ from what the standard says.

A habit is a TOML file with rules on the frames to and from one node. Those in ``sim/habits`` come with the
program; a user's report of a device that behaves oddly becomes one more.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final, Literal

from pydantic import Field, field_validator, model_validator

from bridge.base.errors import OperationFailed
from bridge.config.field_types import RegularExpression
from bridge.config.model import Table
from bridge.text import Text
from bridge.tomlfile import TomlFile, Unfit

FrameKind = Literal["request", "answer", "error_control", "emcy", "tpdo"]
"""Frames of a node: SDO requests to it and answers of its first SDO server, its heartbeats, boot-up messages
and answers to node guarding, its emergency messages, and its TPDOs."""

_FOLDER: Final = Path(__file__).parents[1] / "habits"
_TEMPLATE: Final = re.compile(r"(\.\.|[0-9A-Fa-f]{2})( (\.\.|[0-9A-Fa-f]{2})){0,7}")
_MOST_BYTES: Final = 8
_DEEDS: Final = ("data", "size", "abort", "delay_ms", "silent")


class Rule(Table):
    """Treatment of one kind of frame. Rules are applied in the order of the file, each to what the one before
    has left."""

    frames: FrameKind = Field(description="the frames it is about")
    like: RegularExpression = Field(
        "",
        description='beginning of each: a regular expression on bytes as "4B 17 10"; empty: all',
    )
    skip: int = Field(
        0, ge=0, description="number of them that remain as they are before the first that does not"
    )
    data: str = Field("", description='bytes in place of its first ones; ".." leaves a byte as it is')
    size: int | None = Field(None, ge=0, le=_MOST_BYTES, description="bytes: the rest is cut off, or 0")
    abort: int | None = Field(
        None, ge=0, le=0xFFFF_FFFF, description="the transfer is aborted with this code"
    )
    delay_ms: int = Field(0, ge=0, le=60_000, description="delay with which it is sent")
    silent: bool = Field(False, description="it gets lost")

    @field_validator("data")
    @classmethod
    def _is_bytes(cls, value: str) -> str:
        if value and not _TEMPLATE.fullmatch(value):
            raise Unfit(Text.of("habit_file.no_frame"))
        return value

    @model_validator(mode="after")
    def _fits_its_frames(self) -> Rule:
        if not self.model_fields_set & set(_DEEDS):
            raise Unfit(Text.of("habit_file.no_deed", deeds=_DEEDS))
        if self.abort is not None and self.frames not in ("request", "answer"):
            raise Unfit(Text.of("habit_file.abort_frames"))
        if self.delay_ms and self.frames == "request":
            raise Unfit(Text.of("habit_file.delayed_request"))
        return self


class Habit(Table):
    """One habit; ``says`` is what the bridge makes of it."""

    title: str = Field(description="deed of the device, in a sentence")
    source: str = Field(description="place where it was seen, or what the standard says instead")
    says: str = Field("", description="a part of what the bridge says of it; empty: nothing")
    boots: bool = Field(True, description="the bridge takes the node into operation all the same")
    rule: list[Rule] = Field(min_length=1, description="applied in this order")


def shipped_habits() -> dict[str, Path]:
    """The files that come with the program, by name."""
    return {path.stem: path for path in sorted(_FOLDER.glob("*.toml"))}


def load_habit(name: str) -> Habit:
    """A habit by the name of one that comes with the program, or by the path of its file.

    Raises ``FileFaults`` with every fault of the file, ``OperationFailed`` where there is none.
    """
    shipped = shipped_habits()
    path = shipped.get(name) or Path(name)
    if name not in shipped and path.suffix != ".toml":
        raise OperationFailed(f"there is no habit {name}: a file *.toml, or one of {', '.join(shipped)}")
    file = TomlFile(path)
    habit = file.validate(Habit)
    file.finish()
    if habit is None:
        raise AssertionError("a file without a model always has faults")
    return habit
