"""Requests made of queries, and replies to queries that are none."""

from __future__ import annotations

import contextlib
import json

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.command import Action, Code, Do, Identity, Request, SetTimeout, Source, Start, TakeControl, Write
from bridge.northbound.zenoh.commands import MALFORMED, BadCommand, Commands, identity_of
from tests.support import sites
from tests.support.zenoh_site import make_plant

PLC = Identity(Source.ZENOH, "plc")
PLANT = make_plant()
COMMANDS = Commands(PLANT.image.points)
_WRITABLE = sites.drive("fu3", "zenoh", 200, "fieldbus_timeout_writable = true")


def request(tail: str, payload: str | bytes = b"") -> Request:
    return COMMANDS.request(tail, payload.encode() if isinstance(payload, str) else payload, PLC)


def refusal(tail: str, payload: str | bytes = b"") -> BadCommand:
    with pytest.raises(BadCommand) as caught:
        request(tail, payload)
    assert caught.value.message
    return caught.value


@pytest.mark.parametrize("payload", ['{"v": 1151}', "1151", " 1151\n", "0x047F", "0x47f", "1151.0"])
def test_a_point_of_the_command_group_is_written(payload: str) -> None:
    made = request("conveyor/fu3/command/control_word", payload)
    assert made == Request(PLC, "conveyor/fu3", Write({"control_word": 0x047F}))


def test_an_object_is_one_telegram() -> None:
    made = request("conveyor/fu3/command", '{"control_word": 1151, "setpoint_1": 8192}')
    assert made.command == Write({"control_word": 0x047F, "setpoint_1": 0x2000})


def test_the_owners_time_out_is_set_where_the_site_file_allows_it() -> None:
    key = "conveyor/fu3/supervision/fieldbus_timeout_ms"
    writable = Commands(sites.plant_of(sites.site(sites.bus(sites.node(_WRITABLE)))).image.points)
    assert writable.request(key, b"300", PLC) == Request(PLC, "conveyor/fu3", SetTimeout(300))
    for payload in (b"1.5", b"true", b'"300"', b"1e999", b"", b"{}"):
        with pytest.raises(BadCommand):
            writable.request(key, payload, PLC)
    assert refusal(key, "300").code == Code.READ_ONLY
    with pytest.raises(BadCommand):
        writable.request("conveyor/fu3/supervision/trips", b"0", PLC)


def test_every_method_has_its_key() -> None:
    for action in ("stop", "quick_stop", "disable_voltage", "release_control"):
        assert request(f"conveyor/fu3/command/{action}") == Request(PLC, "conveyor/fu3", Do(Action(action)))
    for action in ("stop", "quick_stop", "disable_voltage", "reset_fault", "release_control", "keep_alive"):
        assert request(f"conveyor/fu3/command/{action}", "{}") == Request(
            PLC, "conveyor/fu3", Do(Action(action))
        )
    assert request("conveyor/fu3/command/start", '{"direction": -1}').command == Start(-1)
    assert request("conveyor/fu3/command/take_control", '{"ttl_ms": 500}').command == TakeControl(500)
    for action in ("reset", "reset_communication", "enable", "disable"):
        assert request(f"conveyor/node/{action}", "{}") == Request(PLC, "conveyor", Do(Action(action)))


@pytest.mark.parametrize("payload", ["", " \n"])
@pytest.mark.parametrize(
    "tail",
    [
        *(f"conveyor/fu3/command/{leaf}" for leaf in ("start", "take_control", "reset_fault", "keep_alive")),
        *(f"conveyor/node/{leaf}" for leaf in ("reset", "reset_communication", "enable", "disable")),
    ],
)
def test_a_plain_get_starts_acknowledges_and_resets_nothing(tail: str, payload: str) -> None:
    bad = refusal(tail, payload)
    assert bad.code == MALFORMED
    assert "{} is enough" in bad.message


@pytest.mark.parametrize(
    ("tail", "payload", "code", "words"),
    [
        ("conveyor/fu3/actual/frequency", "1", Code.READ_ONLY, "conveyor/fu3/command/"),
        ("conveyor/fu3/status/state", "1", Code.READ_ONLY, "read-only"),
        ("bus/can0/load", "1", Code.READ_ONLY, "read-only"),
        ("conveyor/fu3/command/control_wurd", "1", Code.UNKNOWN_POINT, "control_word, setpoint_1"),
        ("conveyor/fu9/command/control_word", "1", Code.UNKNOWN_TARGET, "conveyor/fu1"),
        ("conveyor/node/restart", "{}", Code.UNKNOWN_POINT, "reset_communication"),
        ("conveyor/fu3/actual/nothing", "1", Code.UNKNOWN_POINT, "command"),
        ("", "1", Code.UNKNOWN_POINT, "command"),
        ("conveyor/fu3/command/control_word", "", MALFORMED, '{"v": <number>}'),
        ("conveyor/fu3/command/control_word", "on", MALFORMED, "number"),
        ("conveyor/fu3/command/control_word", '{"v": 0x47F}', MALFORMED, "number"),
        ("conveyor/fu3/command/control_word", '{"w": 1}', MALFORMED, "w"),
        ("conveyor/fu3/command/control_word", '{"v": null}', MALFORMED, "null"),
        ("conveyor/fu3/command/control_word", "1" * 400, Code.OUT_OF_RANGE, "too large"),
        ("conveyor/fu3/command/control_word", b"\xff\xfe", MALFORMED, "number"),
        (
            "conveyor/fu3/command/control_word",
            '{"v": "\ud800"}'.encode("utf-8", "surrogatepass"),
            MALFORMED,
            "number",
        ),
        ("conveyor/fu3/command/control_word", "[" * 4000, MALFORMED, "number"),
        ("conveyor/fu3/command/control_word", "1" * 5000, MALFORMED, "4096"),
        ("conveyor/fu3/command", "1151", MALFORMED, "object"),
        ("conveyor/fu3/command", "{}", MALFORMED, "no point"),
        ("conveyor/fu3/command", '{"control_word": [1]}', MALFORMED, "object"),
        ("conveyor/fu3/command/start", '{"direction": 2}', Code.OUT_OF_RANGE, "reverse"),
        ("conveyor/fu3/command/start", '{"direction": "left"}', MALFORMED, "direction"),
        ("conveyor/fu3/command/start", '{"ttl_ms": 1}', MALFORMED, "ttl_ms"),
        ("conveyor/fu3/command/take_control", '{"ttl_ms": -1}', Code.OUT_OF_RANGE, "ttl_ms takes 0"),
        ("conveyor/fu3/command/take_control", '{"ttl_ms": 4294967296}', Code.OUT_OF_RANGE, "ttl_ms takes 0"),
        ("conveyor/fu3/command/take_control", '{"ttl_ms": 500.5}', MALFORMED, "ttl_ms"),
        ("conveyor/fu3/command/stop", '{"v": true}', MALFORMED, "v"),
    ],
)
def test_what_is_no_command_is_told_what_is_right(
    tail: str, payload: str | bytes, code: str, words: str
) -> None:
    bad = refusal(tail, payload)
    assert bad.code == code
    assert words in bad.message


def test_methods_are_told_from_values() -> None:
    assert COMMANDS.is_method("conveyor/fu3/command/stop")
    assert COMMANDS.is_method("conveyor/node/reset")
    for tail in ("conveyor/fu3/command/control_word", "conveyor/node/nmt_state", "x/y/command/stop", "", "*"):
        assert not COMMANDS.is_method(tail)


@pytest.mark.parametrize(
    ("tail", "target", "action"),
    [
        ("conveyor/fu3/command/no_such", "conveyor/fu3", Action.WRITE),
        ("conveyor/fu3/command/start", "conveyor/fu3", Action.START),
        ("conveyor/fu3/parameter/P102", "conveyor/fu3", Action.WRITE_PARAMETER),
        ("conveyor/fu3", "conveyor/fu3", Action.WRITE),
        ("conveyor/fu33/command/start", "conveyor", Action.WRITE),
        ("conveyor/node/no_such", "conveyor", Action.WRITE),
        ("no_such/fu3/command/start", "no_such/fu3/command/start", Action.WRITE),
        ("", "", Action.WRITE),
    ],
)
def test_what_is_no_command_may_still_be_about_somebody(tail: str, target: str, action: Action) -> None:
    assert COMMANDS.addressee_of(tail) == (target, action)


def test_the_controller_names_itself() -> None:
    assert identity_of(None) == Identity(Source.ZENOH, "anonymous")
    assert identity_of(b'{"controller": "plc-7"}') == Identity(Source.ZENOH, "plc-7")
    assert identity_of(b'{"more": 1}').user == "anonymous"


@pytest.mark.parametrize(
    "attachment",
    [
        b"plc",
        b'{"controller": 7}',
        b'{"controller": ""}',
        b'{"controller": "a/b"}',
        b"\xff",
        b'"x"',
        b" " * 5000,
    ],
)
def test_a_wrong_attachment_is_not_taken_for_anonymous(attachment: bytes) -> None:
    with pytest.raises(BadCommand, match="controller"):
        identity_of(attachment)


tails = st.sampled_from([point.name for point in PLANT.image.points]) | st.sampled_from(
    ["conveyor/fu3/command", "conveyor/fu3/command/start", "conveyor/fu3/command/take_control"]
)
json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=8,
)


@given(
    tail=tails | st.text(max_size=40),
    payload=st.binary(max_size=60) | json_values.map(json.dumps).map(str.encode),
)
def test_no_payload_does_anything_but_make_a_request_or_a_refusal(tail: str, payload: bytes) -> None:
    with contextlib.suppress(BadCommand):
        made = COMMANDS.request(tail, payload, PLC)
        PLANT.submit(made, 1.0, lambda _: None)
