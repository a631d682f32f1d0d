"""Messages between the bus process and its fronts: they read back as they were, faults are named."""

from __future__ import annotations

import contextlib
import stat
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.base.errors import Unavailable
from bridge.catalogue.points import CONNECTION_COUNTS
from bridge.command import (
    Action,
    Code,
    Do,
    Event,
    EventKind,
    Identity,
    Outcome,
    ReadParameter,
    Rejection,
    Request,
    Role,
    SetTimeout,
    Source,
    Start,
    TakeControl,
    Write,
    WriteParameter,
)
from bridge.command.messages.request import COMMANDS
from bridge.image import DataType, Point, Quality
from bridge.mirror import protocol, socket_endpoint
from bridge.mirror.endpoint import prepare_folder
from bridge.mirror.protocol import Answered, Changed, Connected, Counted, Delta, Malformed, Rejected, Snapshot
from bridge.text import Said, Text
from tests.support.zenoh_site import make_plant

values = st.booleans() | st.integers(-(2**31), 2**32 - 1) | st.floats(allow_nan=False) | st.text(max_size=20)
times = st.floats(0, 1e11)
said = st.just("") | st.text(max_size=10).map(Text.plain)
changes = st.builds(Changed, st.integers(0, 9), values, st.sampled_from(Quality), times, said)
identities = st.builds(
    Identity,
    st.sampled_from(Source),
    st.text(max_size=10),
    st.sampled_from(Role),
    st.text(),
    connection=st.text(max_size=10),
)
commands = st.one_of(
    st.builds(Write, st.dictionaries(st.text(max_size=10), values, max_size=4)),
    st.builds(Start, st.sampled_from((-1, 0, 1))),
    st.builds(TakeControl, st.integers(0, 10**6)),
    st.builds(SetTimeout, st.integers(0, 32767)),
    st.builds(ReadParameter, st.text(max_size=10), st.integers(0, 32767)),
    st.builds(WriteParameter, st.text(max_size=10), values),
    st.builds(Do, st.sampled_from([action for action in Action if action not in COMMANDS])),
)
came = st.none() | st.floats(allow_nan=False)
requests = st.builds(Request, identities, st.text(max_size=20), commands, came, st.none() | st.booleans())


@given(st.lists(changes, max_size=20))
def test_deltas_read_back(readings: list[Changed]) -> None:
    delta = Delta(7, 3, tuple(readings))
    back = protocol.decode_delta(protocol.encode(delta), 10)
    assert back == delta
    assert [type(changed.value) for changed in back.readings] == [type(c.value) for c in readings]
    assert all(isinstance(changed.quality, Quality) for changed in back.readings)


@given(st.builds(Connected, identities, st.booleans(), st.booleans()))
def test_who_comes_and_goes_reads_back(told: Connected) -> None:
    assert protocol.decode(Connected, protocol.encode(told)) == told


@given(requests, st.floats(0, 1e9))
def test_requests_read_back_with_their_identity(request: Request, deadline: float) -> None:
    assert protocol.decode_request(protocol.encode_request(request, deadline)) == (request, deadline)


@given(identities, st.text(max_size=20), st.dictionaries(st.text(max_size=10), values, max_size=4))
def test_rejections_read_back(identity: Identity, target: str, written: dict[str, bool | int | float | str]):
    told = Rejected(
        12.5, 3, Rejection(identity, target, Action.WRITE, Code.READ_ONLY, Text.plain("why"), written)
    )
    assert protocol.decode(Rejected, protocol.encode(told)) == told


outcomes = st.builds(Outcome, st.sampled_from(Code), said, st.booleans())


@given(st.builds(Answered, outcomes, st.integers(0, 2**63 - 1), st.integers(0, 10**9)))
def test_outcomes_read_back(answered: Answered) -> None:
    assert protocol.decode(Answered, protocol.encode(answered)) == answered


any_text = st.text(st.characters(), max_size=10)
"""With lone surrogates."""
any_values = st.dictionaries(any_text, any_text | st.integers() | st.floats(), max_size=3)
any_identities = st.builds(Identity, st.sampled_from(Source), any_text, st.sampled_from(Role), any_text)


@given(any_identities, any_text, any_text, any_values)
def test_whatever_was_refused_can_be_told(
    who: Identity, target: str, why: str, written: dict[str, str | int | float]
) -> None:
    """One that could not would end whoever tells it, and every client with that."""
    told = Rejected(12.5, 3, Rejection(who, target, Action.WRITE, why, Text.plain(why), written))
    back = protocol.decode(Rejected, protocol.encode(told))
    assert back.count == 3
    assert len(back.rejection.target) == len(target)


@given(any_text, any_text, any_text | st.integers() | st.floats(allow_nan=False))
def test_whatever_happens_can_be_told(source: str, message: str, value: str | int | float) -> None:
    told = Text.plain(message)
    protocol.decode(Event, protocol.encode(Event(1.5, EventKind.REFUSED, source, 300, told)))
    protocol.decode(Answered, protocol.encode(Answered(Outcome(Code.NOT_VALID, told), 1, 1)))
    delta = Delta(1, 1, (Changed(0, 5, Quality.GOOD, 0, ""), Changed(1, value, Quality.GOOD, 0, told)))
    back = protocol.decode_delta(protocol.encode(delta), 2)
    assert back.readings[0] == delta.readings[0], "what is well is as it was"


def test_texts_are_passed_on_as_they_are() -> None:
    why = Text.of("node.lost")
    said = Text.of("meaning.lost", parameter="P1", in_set=2, before=1.5, affected=(why, "P2"))
    delta = Delta(1, 1, (Changed(0, said, Quality.LOST, 0, why),))
    assert protocol.decode_delta(protocol.encode(delta), 1) == delta


def test_a_changed_value_takes_25_bytes() -> None:
    readings = tuple(
        Changed(1000 + n, 25.0 + n / 7, Quality.GOOD, 1_763_888_888.123456, "") for n in range(100)
    )
    assert len(protocol.encode(Delta(2**62, 123_456, readings))) <= 25 * 100


@given(any_identities, any_text, any_values)
def test_a_request_is_passed_on_as_it_is_or_not_at_all(
    who: Identity, target: str, values: dict[str, str | int | float]
) -> None:
    request = Request(who, target, Write(values))
    with contextlib.suppress(Malformed):
        assert repr(protocol.decode_request(protocol.encode_request(request, 1.0))) == repr((request, 1.0))


def test_a_command_with_other_fields_is_malformed() -> None:
    request = Request(Identity(Source.MODBUS, "plc"), "conveyor/fu1", SetTimeout(200))
    told = protocol.encode_request(request, 1.0).replace(b"timeout_ms", b"another_ms")
    with pytest.raises(Malformed):
        protocol.decode_request(told)


def test_a_snapshot_brings_the_nature_of_every_point() -> None:
    points = make_plant().image.points
    snapshot = Snapshot(1, 2, points, ())
    assert protocol.decode_snapshot(protocol.encode(snapshot)).points == points
    rich = Point(
        name="a/b/c/d",
        data_type=DataType.UINT16,
        unit="Hz",
        low=-100,
        high=100.5,
        writable=True,
        states=((0, "off"), (1, "on")),
        bits=("run", "", "fault"),
    )
    assert protocol.decode_snapshot(protocol.encode(Snapshot(1, 2, (rich,), ()))).points == (rich,)


@given(times, st.sampled_from(EventKind), st.text(max_size=10), st.integers(1, 1000), said)
def test_events_read_back(time: float, kind: EventKind, source: str, severity: int, told: Said) -> None:
    event = Event(time, kind, source, severity, told)
    assert protocol.decode(Event, protocol.encode(event)) == event


DECODERS = (
    protocol.decode_snapshot,
    lambda data: protocol.decode_delta(data, 10),
    lambda data: protocol.decode(Event, data),
    protocol.decode_request,
    lambda data: protocol.decode(Answered, data),
)


@pytest.mark.parametrize("decode", DECODERS)
@given(data=st.binary(max_size=64))
def test_garbage_is_malformed_and_nothing_worse(decode: Callable[[bytes], object], data: bytes) -> None:
    with contextlib.suppress(Malformed):
        decode(data)


@pytest.mark.parametrize("index", [-1, 10])
def test_an_index_outside_the_image_is_malformed(index: int) -> None:
    delta = Delta(1, 1, (Changed(index, 0, Quality.GOOD, 0, ""),))
    with pytest.raises(Malformed, match="none of 10 points"):
        protocol.decode_delta(protocol.encode(delta), 10)


def test_deep_nesting_is_malformed() -> None:
    with pytest.raises(Malformed):
        protocol.decode_request(b"\x91" * 100_000)


def test_the_runtime_folder_is_made_for_us_alone(tmp_path: Path) -> None:
    endpoint = socket_endpoint(tmp_path / "run" / "drivebridge", "hall3")
    assert endpoint == f"unixsock-stream/{tmp_path}/run/drivebridge/hall3.sock"
    prepare_folder(endpoint)
    assert stat.S_IMODE((tmp_path / "run" / "drivebridge").stat().st_mode) == 0o700


def test_a_folder_others_may_write_to_is_refused(tmp_path: Path) -> None:
    tmp_path.chmod(0o777)
    with pytest.raises(Unavailable, match="chmod 700"):
        prepare_folder(socket_endpoint(tmp_path, "hall3"))


def test_a_path_that_is_no_socket_path_is_refused(tmp_path: Path) -> None:
    with pytest.raises(Unavailable, match="too long"):
        socket_endpoint(tmp_path / ("x" * 100), "hall3")
    with pytest.raises(Unavailable, match="must not contain"):
        socket_endpoint(tmp_path / "a#b", "hall3")


@given(st.sampled_from(sorted(CONNECTION_COUNTS)), st.integers(1, 10**6))
def test_counts_read_back(leaf: str, by: int) -> None:
    assert protocol.decode_counted(protocol.encode(Counted(leaf, by))) == Counted(leaf, by)


@pytest.mark.parametrize(("leaf", "by"), [("refused_writes", 1), ("opcua_refused_connections", 0), ("", -1)])
def test_a_front_counts_nothing_else(leaf: str, by: int) -> None:
    with pytest.raises(Malformed):
        protocol.decode_counted(protocol.encode(Counted(leaf, by)))
