"""Messages for people who edit a file, of what pydantic has found."""

from __future__ import annotations

from typing import Literal

import pytest
from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator

from bridge.canopen.datatypes import encode
from bridge.text import Text, render
from bridge.tomlfile import Unfit
from bridge.tomlfile.messages import explain


class Table(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)
    name: str = Field("x", description="a short name", max_length=50)
    kind: Literal["red", "green"] = "red"
    share: float = Field(0.5, allow_inf_nan=False)
    odd: int = 1
    small: int = 1
    byte: int = 0

    @field_validator("odd")
    @classmethod
    def _is_odd(cls, value: int) -> int:
        if not value % 2:
            raise ValueError("Must be odd")
        return value

    @field_validator("small")
    @classmethod
    def _is_small(cls, value: int) -> int:
        if value > 9:
            raise Unfit(Text.of("toml.less_than", limit=10))
        return value

    @field_validator("byte")
    @classmethod
    def _is_byte(cls, value: int) -> int:
        encode("uint8", value)
        return value


def told(**data: object) -> tuple[str, str]:
    with pytest.raises(ValidationError) as caught:
        Table.model_validate(data)
    (detail,) = caught.value.errors()
    message, hint = explain(Table, detail)
    return render(message), render(hint)


@pytest.mark.parametrize(
    ("data", "message", "hint"),
    [
        ({"name": 5}, "must be a text in quotes, not 5", "a short name"),
        ({"name": True}, "must be a text in quotes, not true", "a short name"),
        ({"name": [1]}, "must be a text in quotes", "a short name"),
        ({"name": "x" * 51}, "must have at most 50 characters", "a short name"),
        ({"odd": 2}, "must be odd, not 2", ""),
        ({"small": 12}, "must be less than 10, not 12", ""),
        ({"byte": 256}, "a uint8 is 0…255, not 256", ""),
        ({"share": float("inf")}, "must be a finite number, not inf", ""),
        ({"kind": "gren"}, 'must be "red" or "green", not "gren"', 'did you mean "green"?'),
        ({"kind": "blue"}, 'must be "red" or "green", not "blue"', ""),
        ({"nmae": 5}, "is not a key that belongs here", "did you mean name?"),
        ({"zzz": 5}, "is not a key that belongs here", "known here: byte, kind, name, odd, share, small"),
    ],
)
def test_a_sentence_with_the_value_and_what_would_be_right(
    data: dict[str, object], message: str, hint: str
) -> None:
    assert told(**data) == (message, hint)


def test_a_number_that_no_line_could_show_is_left_out() -> None:
    assert told(name=1 << 64)[0] == "must be a text in quotes"


@pytest.mark.parametrize(
    ("data", "german"),
    [
        ({"small": 12}, "muss weniger als 10 sein, nicht 12"),
        ({"byte": 256}, "uint8 ist 0…255, nicht 256"),
    ],
)
def test_a_validators_text_keeps_its_code(data: dict[str, int], german: str) -> None:
    with pytest.raises(ValidationError) as caught:
        Table.model_validate(data)
    (detail,) = caught.value.errors()
    message, _ = explain(Table, detail)
    assert render(message, "de") == german
