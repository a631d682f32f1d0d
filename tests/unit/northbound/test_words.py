"""A raw word is 0…65535 on every protocol: whatever else a client writes is refused and never becomes another
word. FFFFh, which a signed -1 would be, acknowledges and enables."""

from __future__ import annotations

import json
import struct

import pytest
from asyncua import ua
from hypothesis import given
from hypothesis import strategies as st

from bridge.command import Code, Identity, Outcome, Plant, Request, Source, Write
from bridge.command.drive_link import NodeState
from bridge.image import Value
from bridge.northbound.opcua.space.data_values import point_value
from bridge.northbound.zenoh.commands import BadCommand, Commands
from tests.support import sites
from tests.support.node_states import node_goes
from tests.support.views import dispatcher_of

SITE = sites.site(
    sites.bus(
        sites.node(
            sites.drive("fu1", "modbus", 200, f"unit_id = 1\n{sites.SCALED}"),
            sites.drive("fu2", "opcua", 200, sites.SCALED),
            sites.drive("fu3", "zenoh", 200, sites.SCALED),
        )
    )
)
LEAVES = ("control_word", "setpoint_1")
_LIMITS = {
    ua.VariantType.SByte: (-(2**7), 2**7 - 1),
    ua.VariantType.Byte: (0, 2**8 - 1),
    ua.VariantType.Int16: (-(2**15), 2**15 - 1),
    ua.VariantType.UInt16: (0, 2**16 - 1),
    ua.VariantType.Int32: (-(2**31), 2**31 - 1),
    ua.VariantType.UInt32: (0, 2**32 - 1),
    ua.VariantType.Int64: (-(2**63), 2**63 - 1),
    ua.VariantType.UInt64: (0, 2**64 - 1),
}
_INTEGERS = st.sampled_from(sorted(_LIMITS, key=str)).flatmap(
    lambda kind: st.integers(*_LIMITS[kind]).map(lambda value: ua.Variant(value, kind))
)
_OTHERS = st.one_of(
    st.booleans().map(lambda value: ua.Variant(value, ua.VariantType.Boolean)),
    st.floats().map(lambda value: ua.Variant(value, ua.VariantType.Double)),
    st.floats(width=32).map(lambda value: ua.Variant(value, ua.VariantType.Float)),
    st.text(max_size=5).map(lambda value: ua.Variant(value, ua.VariantType.String)),
    st.lists(st.integers(0, 0xFFFF), max_size=3).map(lambda value: ua.Variant(value, ua.VariantType.UInt16)),
)
_JSON = st.one_of(
    st.integers(),
    st.integers(-0x1_0000, 0x1_0000),
    st.floats(),
    st.booleans(),
    st.text(max_size=5),
    st.none(),
    st.lists(st.integers(0, 0xFFFF), max_size=2),
    st.dictionaries(st.sampled_from(("v", "w")), st.integers(-5, 5), max_size=2),
)


def plant() -> Plant:
    made = sites.plant_of(SITE)
    node_goes(made, made.nodes["conveyor"], NodeState.OPERATIONAL, 0.0)
    return made


def is_word(value: object) -> bool:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return is_number and 0 <= value <= 0xFFFF and value == int(value)


def write(plant: Plant, drive: str, who: Identity, leaf: str, value: Value) -> Outcome:
    outcomes: list[Outcome] = []
    plant.submit(Request(who, drive, Write({leaf: value})), 1.0, outcomes.append)
    return outcomes[0]


def words_of(plant: Plant, drive: str) -> tuple[int, ...]:
    channel = plant.drives[drive].channel
    return (channel.control_word, *channel.setpoints)


def check(plant: Plant, drive: str, leaf: str, outcome: Outcome | None, value: object) -> None:
    """``outcome`` is None where the protocol has refused it by itself."""
    before = (0x0400, 0, 0, 0, 0)
    after = words_of(plant, drive)
    if outcome is None or not outcome.ok:
        assert after == before
        assert outcome is None or outcome.code in (Code.OUT_OF_RANGE, Code.NOT_VALID)
        assert not is_word(value) or (outcome is not None and outcome.code is Code.NOT_VALID)
    else:
        assert is_word(value)
        assert after[LEAVES.index(leaf)] == value


@pytest.mark.landing
@given(written=st.one_of(_INTEGERS, _OTHERS), leaf=st.sampled_from(LEAVES))
def test_opc_ua(written: ua.Variant, leaf: str):
    made, drive = plant(), "conveyor/fu2"
    point = made.image.points[made.image.index[f"{drive}/command/{leaf}"]]
    try:
        value = point_value(point, written)
    except (TypeError, ValueError):
        assert written.VariantType not in _LIMITS or written.is_array
        return
    check(made, drive, leaf, write(made, drive, Identity(Source.OPCUA, "ann"), leaf, value), written.Value)


@pytest.mark.landing
@given(written=_JSON, leaf=st.sampled_from(LEAVES), shape=st.sampled_from(("bare", "object", "telegram")))
def test_zenoh(written: object, leaf: str, shape: str):
    made, drive = plant(), "conveyor/fu3"
    tail = f"{drive}/command" if shape == "telegram" else f"{drive}/command/{leaf}"
    body = {"bare": written, "object": {"v": written}, "telegram": {leaf: written}}[shape]
    meant = written["v"] if shape == "bare" and isinstance(written, dict) and "v" in written else written
    who = Identity(Source.ZENOH, "plc")
    try:
        request = Commands(made.image.points).request(tail, json.dumps(body).encode(), who)
    except BadCommand:
        assert not is_word(meant) or isinstance(written, dict)
        return
    outcomes: list[Outcome] = []
    made.submit(request, 1.0, outcomes.append)
    check(made, drive, leaf, outcomes[0], meant)


@pytest.mark.parametrize(
    "payload", ["-1", "-0x1", "0x10000", "0xFFFFFFFF", "+1", "0b1", "1e5", "-1.0", "NaN"]
)
def test_zenoh_bare(payload: str):
    made, drive = plant(), "conveyor/fu3"
    who = Identity(Source.ZENOH, "plc")
    try:
        request = Commands(made.image.points).request(f"{drive}/command/control_word", payload.encode(), who)
    except BadCommand:
        return
    outcomes: list[Outcome] = []
    made.submit(request, 1.0, outcomes.append)
    assert outcomes[0].code is Code.OUT_OF_RANGE


@pytest.mark.landing
@given(word=st.integers(0, 0xFFFF), leaf=st.sampled_from(LEAVES))
def test_modbus_whose_registers_are_words(word: int, leaf: str):
    made, drive = plant(), "conveyor/fu1"
    answers: list[bytes] = []
    dispatcher = dispatcher_of(made, lambda: 1.0)
    pdu = struct.pack(">BHH", 6, LEAVES.index(leaf), word)
    dispatcher.handle(1, pdu, Identity(Source.MODBUS, "10.0.0.5"), answers.append)
    code = Code.NOT_VALID if answers[0][0] & 0x80 else Code.OK
    check(made, drive, leaf, Outcome(code), word)
