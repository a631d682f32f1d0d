"""Effects of writes to objects, by the device profiles, and who may write them when."""

from __future__ import annotations

import itertools

import pytest

from bridge.mapping import load_family
from bridge.parameter import Names, ObjectRef
from bridge.parameter.profiles import PROFILES, effect_of
from bridge.parameter.write_effect import Effect, WriteVerdict, judge

COMMANDS, SHAPES, SAFE = Effect.COMMANDS, Effect.SHAPES, Effect.MAKES_SAFE
WRITTEN, NEVER = WriteVerdict.WRITTEN, WriteVerdict.NEVER
ENGINEER, REST = WriteVerdict.NOT_AN_ENGINEER, WriteVerdict.NOT_AT_REST

TABLE = {
    # whoever may set parameters, at rest and in motion; an engineer, at rest and in motion
    Effect.COMMANDS: (NEVER, NEVER, NEVER, NEVER),
    Effect.BUS: (NEVER, NEVER, NEVER, NEVER),
    Effect.SHAPES: (NEVER, NEVER, NEVER, NEVER),
    Effect.SUPERVISES: (ENGINEER, ENGINEER, WRITTEN, REST),
    Effect.MAKES_SAFE: (ENGINEER, ENGINEER, WRITTEN, REST),
    Effect.MAY_MOVE: (ENGINEER, ENGINEER, WRITTEN, REST),
    Effect.OPERATES: (WRITTEN, REST, WRITTEN, REST),
    Effect.SETTING: (WRITTEN, WRITTEN, WRITTEN, WRITTEN),
}


@pytest.mark.parametrize("effect", Effect)
def test_what_moves_is_never_a_parameter_and_what_makes_safe_is_an_engineers_at_rest(effect: Effect) -> None:
    found = [
        judge(effect, is_engineer=engineer, is_moving=moving)
        for engineer, moving in itertools.product((False, True), repeat=2)
    ]
    assert tuple(found) == TABLE[effect]


PROFILE_OBJECTS = [
    # CiA 401: write output, in 8 bits, single bits, 16 and 32 bits
    *((401, index, COMMANDS) for index in (0x6200, 0x6220, 0x6227, 0x6300, 0x6320)),
    # write analogue output, 8, 16, 32 bits, float, manufacturer-specific
    *((401, index, COMMANDS) for index in range(0x6410, 0x6415)),
    # change polarity output; analogue output offset and scaling
    *((401, index, SHAPES) for index in (0x6202, 0x6240, 0x6247, 0x6302, 0x6322)),
    *((401, index, SHAPES) for index in (0x6441, 0x6442, 0x6446, 0x6447)),
    # error mode, error value, filter mask
    *((401, index, SAFE) for index in (0x6206, 0x6207, 0x6208, 0x6250, 0x6260, 0x6270)),
    *((401, index, SAFE) for index in (0x6306, 0x6307, 0x6308, 0x6326, 0x6327, 0x6328)),
    *((401, index, SAFE) for index in (0x6443, 0x6444, 0x6445)),
    # inputs: polarity, filter, interrupt mask, upper limit
    *((401, index, None) for index in (0x6002, 0x6003, 0x6005, 0x6423, 0x6424)),
    # CiA 402
    *((402, index, COMMANDS) for index in (0x6040, 0x6042, 0x6071, 0x607A, 0x60B1, 0x60C1, 0x60FE, 0x60FF)),
    *((402, index, SAFE) for index in (0x6007, 0x604A, 0x605A, 0x605B, 0x605C, 0x605D, 0x605E, 0x6085)),
    (402, 0x6060, Effect.OPERATES),
    # torque limit, profile acceleration, motor data: no outputs there
    *((402, index, None) for index in (0x6072, 0x6083, 0x6410)),
    # CiA 406: 6200h is the cyclic timer of an encoder, 6003h its preset value
    *((406, index, None) for index in (0x6200, 0x6003)),
    # CiA 408
    *((408, index, COMMANDS) for index in (0x6040, 0x6042, 0x6043, 0x6300)),
    (408, 0x6314, SAFE),
    (408, 0x6324, SHAPES),
    # CiA 301 §7.4.1: the second logical device, whose profile its own 67FFh says; network variables
    *((402, index, COMMANDS) for index in (0x6840, 0x68FF, 0x6A00, 0x9840, 0xA000, 0xA480)),
]


@pytest.mark.landing(3)
@pytest.mark.parametrize(("profile", "index", "effect"), PROFILE_OBJECTS)
def test_a_profile_says_what_its_objects_do(profile: int, index: int, effect: Effect | None) -> None:
    assert effect_of(index, profile) is effect


@pytest.mark.landing(3)
@pytest.mark.parametrize(("profile", "index", "effect"), PROFILE_OBJECTS)
def test_of_a_node_whose_profile_nobody_knows_an_object_does_the_worst_that_it_does_in_any(
    profile: int, index: int, effect: Effect | None
) -> None:
    order = list(Effect)
    for unknown in (None, 404, 410, 1):
        assert unknown not in PROFILES
        found = effect_of(index, unknown)
        if effect is not None:
            assert found is not None
            assert order.index(found) <= order.index(effect)


@pytest.mark.parametrize("index", [0x2110, 0x60E0, 0x7100])
def test_what_nobody_describes_may_move_something(index: int) -> None:
    """An object of a drive that its mapping file does not list."""
    names = Names(load_family("cia402/velocity"))
    assert names.protection.effect(ObjectRef(index, 1)) is Effect.MAY_MOVE


def test_a_vendor_that_names_its_parameters_describes_those_that_are_not_listed() -> None:
    names = Names(load_family("nord/sk-tu4-cao"))
    assert names.protection.effect(names.resolve("P203").address) is Effect.SETTING
