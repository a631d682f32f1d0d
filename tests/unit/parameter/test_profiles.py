"""Objects of the device profiles and what a write of them does: CiA 401, 402, 406, 408, in each device."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.parameter.profiles import PROFILES, effect_of
from bridge.parameter.write_effect import Effect


@pytest.mark.parametrize(
    ("index", "profile", "effect"),
    [
        (0x6040, 402, Effect.COMMANDS),
        (0x607A, 402, Effect.COMMANDS),
        (0x60FF, 402, Effect.COMMANDS),
        (0x6007, 402, Effect.MAKES_SAFE),
        (0x605A, 402, Effect.MAKES_SAFE),
        (0x605E, 402, Effect.MAKES_SAFE),
        (0x605F, 402, None),
        (0x6060, 402, Effect.OPERATES),
        (0x6081, 402, None),
        (0x6200, 401, Effect.COMMANDS),
        (0x6411, 401, Effect.COMMANDS),
        (0x6206, 401, Effect.MAKES_SAFE),
        (0x6207, 401, Effect.MAKES_SAFE),
        (0x6202, 401, Effect.SHAPES),
        (0x6442, 401, Effect.SHAPES),
        (0x6443, 401, Effect.MAKES_SAFE),
        (0x6000, 401, None),
        (0x6200, 406, None),
        (0x6300, 408, Effect.COMMANDS),
        (0x6314, 408, Effect.MAKES_SAFE),
    ],
)
def test_an_object_of_a_profile(index: int, profile: int, effect: Effect | None) -> None:
    assert effect_of(index, profile) is effect


def spread(*spans: int | tuple[int, int]) -> set[int]:
    pairs = ((span, span) if isinstance(span, int) else span for span in spans)
    return {index for first, last in pairs for index in range(first, last + 1)}


TABLES = {
    (401, Effect.COMMANDS): spread(0x6200, (0x6220, 0x622F), 0x6300, 0x6320, (0x6410, 0x6414)),
    (401, Effect.SHAPES): spread(
        0x6202, (0x6240, 0x624F), 0x6302, 0x6322, (0x6441, 0x6442), (0x6446, 0x6447)
    ),
    (401, Effect.MAKES_SAFE): spread(
        (0x6206, 0x6208),
        (0x6250, 0x627F),
        (0x6306, 0x6308),
        (0x6326, 0x6328),
        (0x6443, 0x6445),
        0x67FE,
    ),
    (402, Effect.COMMANDS): spread(
        *(0x6040, 0x6042, 0x6052, 0x6071, 0x607A, (0x60B0, 0x60B2), 0x60C1, 0x60FE, 0x60FF)
    ),
    (402, Effect.MAKES_SAFE): spread(0x6007, 0x604A, 0x6051, (0x605A, 0x605E), 0x6085),
    (402, Effect.OPERATES): spread(0x6060),
    (408, Effect.COMMANDS): spread(0x6040, (0x6042, 0x6043), 0x6300),
    (408, Effect.SHAPES): spread(0x6324),
    (408, Effect.MAKES_SAFE): spread(0x6314),
}
"""The tables of the device profiles, written down a second time."""


@pytest.mark.parametrize("profile", PROFILES)
def test_every_object_of_the_first_logical_device(profile: int) -> None:
    for index in range(0x6000, 0x6800):
        effects = [effect for (of, effect), indices in TABLES.items() if of == profile and index in indices]
        assert [effect_of(index, profile)] == (effects or [None]), f"{index:04X}h"


def test_a_further_logical_device_has_the_worst_that_any_profile_says() -> None:
    """CiA 301 §7.4.1: 800h indices each; its own 67FFh says what it is."""
    assert effect_of(0x6840, 402) is Effect.COMMANDS
    assert effect_of(0x6A00, 406) is Effect.COMMANDS, "6200h of CiA 401"
    assert effect_of(0x6200, 406) is None


@pytest.mark.parametrize("profile", [None, 999, *PROFILES])
def test_network_variables_are_process_data(profile: int | None) -> None:
    """CiA 302-4."""
    assert effect_of(0xA000, profile) is effect_of(0xBFFF, profile) is Effect.COMMANDS
    assert effect_of(0xC000, profile) is None


@given(st.integers(0, 0xFFFF), st.sampled_from([None, *PROFILES]))
def test_what_a_profile_says_is_never_worse_than_what_is_taken_without_one(
    index: int, profile: int | None
) -> None:
    known, unknown = effect_of(index, profile), effect_of(index, None)
    order = list(Effect)
    if known is not None:
        assert unknown is not None
        assert order.index(unknown) <= order.index(known)


@given(st.integers(0x1000, 0x5FFF))
def test_what_no_profile_lists_has_no_effect_by_one(index: int) -> None:
    assert effect_of(index, None) is None
