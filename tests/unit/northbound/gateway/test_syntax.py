"""Lines of CiA 309-3: each one is a command or is refused."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from bridge.northbound.gateway.syntax import BadLine, parse, split_sequence


@given(st.text())
def test_no_line_raises_anything_but_a_refusal(text: str) -> None:
    try:
        _, rest = split_sequence(text)
        parse(rest)
    except BadLine:
        pass
