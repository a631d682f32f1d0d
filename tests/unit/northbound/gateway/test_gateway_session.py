"""Sessions of the ASCII gateway (CiA 309-3): lines in, requests out, lines back."""

from __future__ import annotations

import base64

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.command import Action, Code, Do, Identity, Outcome, ReadParameter, Reply, Request, Role, Source
from bridge.northbound.gateway.gateway_session import MOST_PENDING, GatewaySession, Net
from bridge.northbound.gateway.syntax import LONGEST_LINE

TOOL = Identity(Source.LOCAL, "gateway", Role.ENGINEER)
NET = Net(
    1,
    "bus/can0",
    {5: ("conveyor", "conveyor/fu1"), 6: ("encoder", None)},
    "0 0 0.1 0 1 3.00 0.1",
    "tap /run/hall-can0.frames",
)


class Client:
    def __init__(self) -> None:
        self.requests: list[Request] = []
        self.replies: list[Reply] = []
        self.woken = 0
        self.session = GatewaySession(NET, TOOL, self._submit, self._wake)

    def _submit(self, request: Request, reply: Reply) -> None:
        self.requests.append(request)
        self.replies.append(reply)

    def _wake(self) -> None:
        self.woken += 1

    def say(self, line: str, now: float = 0.0) -> str:
        self.session.receive(f"{line}\r\n".encode(), now)
        return self.heard()

    def heard(self) -> str:
        return self.session.take_lines().decode()

    def end(self, outcome: Outcome) -> str:
        self.replies.pop(0)(outcome)
        return self.heard()


@pytest.fixture
def client() -> Client:
    return Client()


@given(st.lists(st.binary(max_size=40)))
def test_no_bytes_raise_and_every_answer_is_a_line(pieces: list[bytes]) -> None:
    client = Client()
    for piece in pieces:
        client.session.receive(piece, 0.0)
    for line in client.heard().splitlines():
        assert line.startswith("[")


@given(st.binary(max_size=200), st.integers(0, 200))
def test_where_a_stream_is_cut_changes_nothing(stream: bytes, place: int) -> None:
    whole, cut = Client(), Client()
    whole.session.receive(stream, 0.0)
    cut.session.receive(stream[:place], 0.0)
    cut.session.receive(stream[place:], 0.0)
    assert whole.heard() == cut.heard()
    assert whole.requests == cut.requests


@pytest.mark.parametrize("line", ["[7]", "[7] ", "[7] # only a comment", "[7] 5", "[7] 1 5 # nothing"])
def test_a_line_without_a_command_is_answered(client: Client, line: str) -> None:
    """CiA 309-3: every line with a sequence number has its answer, or its sender would wait for ever."""
    client.session.receive(f"{line}\n".encode(), 0.0)
    assert client.session.take_lines() == b"[7] ERROR:101\r\n"


def test_a_read_is_a_request_for_the_bytes(client: Client) -> None:
    assert client.say("[7] 5 read 0x2066 1 i16") == ""
    assert client.requests == [Request(TOOL, "conveyor/fu1", ReadParameter("2066:01", raw=True))]
    assert client.end(Outcome(Code.OK, value="67 00")) == "[7] 103\r\n"
    assert client.woken == 1


def test_a_read_without_a_type_gives_bytes(client: Client) -> None:
    client.say("[7] 5 r 0x2066 1")
    assert client.end(Outcome(Code.OK, value="67 00")) == "[7] 67 00\r\n"


def test_a_value_of_another_length_is_a_mismatch(client: Client) -> None:
    client.say("[7] 5 r 0x2066 1 i32")
    assert client.end(Outcome(Code.OK, value="67 00")) == "[7] ERROR:0x06070010 #2066h:01: no i32\r\n"


def test_a_write_is_a_request_with_the_bytes(client: Client) -> None:
    text = base64.b64encode(b"\1\2").decode()
    assert client.say(f"[8] 1 5 w 0x2066 1 d {text}") == ""
    (request,) = client.requests
    assert (request.target, request.action) == ("conveyor/fu1", Action.WRITE_PARAMETER)
    assert client.end(Outcome(Code.OK, value="01 02")) == "[8] OK\r\n"


@pytest.mark.parametrize(
    ("outcome", "error"),
    [
        (
            Outcome(Code.REFUSED_BY_DRIVE, abort_code=0x0602_0000),
            "0x06020000 #2066h:01: object does not exist in the object dictionary",
        ),
        (
            Outcome(Code.NOT_ALLOWED, "the drive is\r\nsomebody's"),
            "0x08000021 #2066h:01: the drive is somebody's",
        ),
        (Outcome(Code.READ_ONLY), "0x06010002 #2066h:01: read_only"),
        (Outcome(Code.TIMED_OUT), "103 #2066h:01: timed_out"),
        (Outcome(Code.NOT_READY, "its node is booting"), "102 #2066h:01: its node is booting"),
    ],
)
def test_a_failure_has_its_code_with_object_and_reason(client: Client, outcome: Outcome, error: str) -> None:
    client.say("[9] 5 w 0x2066 1 i16 103")
    assert client.end(outcome) == f"[9] ERROR:{error}\r\n"


def test_where_the_frames_can_be_heard_is_told(client: Client) -> None:
    assert client.say("[3] _frames") == "[3] tap /run/hall-can0.frames\r\n"


def test_answers_have_the_sequence_of_their_command(client: Client) -> None:
    client.session.receive(b"[1] 5 r 0x1000 0 u32\n[2] 5 r 0x1001 0 u8\n", 0.0)
    client.replies.reverse()
    assert client.end(Outcome(Code.OK, value="00")) == "[2] 0\r\n"
    assert client.end(Outcome(Code.OK, value="00 00 00 00")) == "[1] 0\r\n"


@pytest.mark.parametrize(
    ("words", "action"),
    [
        ("start", Action.START_NODE),
        ("stop", Action.STOP_NODE),
        ("preop", Action.ENTER_PRE_OPERATIONAL),
        ("reset node", Action.RESET),
        ("reset communication", Action.RESET_COMMUNICATION),
    ],
)
@pytest.mark.parametrize(("node", "target"), [(5, "conveyor"), (0, "bus/can0"), (6, "encoder")])
def test_nmt_is_a_request_like_any_other(
    client: Client, words: str, action: Action, node: int, target: str
) -> None:
    client.say(f"[1] {node} {words}")
    assert client.requests == [Request(TOOL, target, Do(action))]
    assert client.end(Outcome(Code.NOT_ALLOWED)) == f"[1] ERROR:102 #{target}: not_allowed\r\n"


@pytest.mark.parametrize(
    ("line", "answer"),
    [
        ("[1] r 0x1000 0 u32", "[1] ERROR:105"),
        ("[1] 9 r 0x1000 0 u32", "[1] ERROR:107"),
        ("[1] 6 r 0x1000 0 u32", "[1] ERROR:100"),
        ("[1] 2 5 r 0x1000 0 u32", "[1] ERROR:106"),
        ("[1] set network 2", "[1] ERROR:106"),
        ("[1] set network 1", "[1] OK"),
        ("[1] 5 r 0x10000 0 u32", "[1] ERROR:101"),
        ("[1] 5 w 0x2000 0 u8 256", "[1] ERROR:101"),
        ("[1] 5 enable heartbeat 100", "[1] ERROR:100"),
        ("[1] lss_get_node", "[1] ERROR:100"),
        ("[1] info version", "[1] 0 0 0.1 0 1 3.00 0.1"),
        ("5 r 0x1000 0 u32", "[0] ERROR:101"),
        ("[4294967296] 5 stop", "[0] ERROR:101"),
        ("[1] 5", "[1] ERROR:101"),
    ],
)
def test_what_needs_no_node_is_answered_at_once(client: Client, line: str, answer: str) -> None:
    assert client.say(line) == f"{answer}\r\n"
    assert client.requests == []


def test_comments_and_empty_lines_without_a_sequence_have_no_answer(client: Client) -> None:
    assert client.say("# a comment") == client.say("") == ""


def test_the_default_node_is_taken_where_none_is_named(client: Client) -> None:
    assert client.say("[1] set node 5") == "[1] OK\r\n"
    client.say("[2] stop")
    assert client.requests[0].target == "conveyor"


def test_a_line_that_is_too_long_is_one_error_and_the_next_is_heard(client: Client) -> None:
    client.session.receive(b"[1] 5 w 0x2000 0 d " + b"A" * LONGEST_LINE, 0.0)
    client.session.receive(b"A" * LONGEST_LINE + b"\n", 0.0)
    assert client.heard() == "[0] ERROR:101\r\n"
    assert client.say("[2] set node 5") == "[2] OK\r\n"


def test_a_client_has_so_many_commands_under_way(client: Client) -> None:
    for number in range(MOST_PENDING):
        assert client.say(f"[{number}] 5 r 0x1000 0 u32") == ""
    assert client.say("[99] 5 r 0x1000 0 u32") == "[99] ERROR:600\r\n"
    client.end(Outcome(Code.OK, value="00 00 00 00"))
    assert client.say("[100] 5 r 0x1000 0 u32") == ""


def test_a_command_that_takes_too_long_ends_with_an_error_and_once(client: Client) -> None:
    client.say("[1] set command_timeout 500")
    client.say("[2] 5 r 0x1000 0 u32", now=10.0)
    assert client.session.next_deadline() == 10.5
    client.session.on_time(10.5)
    assert client.heard() == "[2] ERROR:103\r\n"
    assert client.end(Outcome(Code.OK, value="00 00 00 00")) == ""


def test_nobody_is_told_after_the_end(client: Client) -> None:
    client.say("[2] 5 r 0x1000 0 u32")
    client.session.close()
    assert client.end(Outcome(Code.OK, value="00 00 00 00")) == ""
    assert client.woken == 0
