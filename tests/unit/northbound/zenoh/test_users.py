"""Identity of a zenoh client, and the rights of its link."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
import zenoh
from hypothesis import example, given
from hypothesis import strategies as st

from bridge.base.errors import Unavailable
from bridge.config import ZenohTable
from bridge.northbound.zenoh.access_control import access_control
from bridge.northbound.zenoh.keys import KeySpace
from bridge.northbound.zenoh.users import Users, read_users
from tests.support.zenoh_site import make_plant

POINTS = make_plant().image.points
SPACE = KeySpace("drives", "demo", POINTS)
TWO = "bridge:x\nplc:y\n"
THREE = f"{TWO}hmi:z\n"
LISTEN = ["tcp/192.168.1.10:7447"]
ROUTER = ["tcp/192.168.1.1:7447"]


def table(folder: Path, lines: str, **settings: object) -> ZenohTable:
    file = folder / "users"
    file.write_text(lines)
    return ZenohTable.model_validate({"user": "bridge", "password_file": str(file), **settings})


@pytest.mark.parametrize(
    ("lines", "settings", "controllers", "sole"),
    [
        ("bridge:x\n", {"listen": LISTEN}, ("bridge",), "bridge"),
        (TWO, {"listen": LISTEN}, ("plc",), "plc"),
        (THREE, {"listen": LISTEN}, ("plc", "hmi"), ""),
        (TWO, {"listen": LISTEN, "connect": ROUTER}, ("plc",), ""),
        (TWO, {"listen": LISTEN, "controllers": ["plc"]}, ("plc",), ""),
        (THREE, {"listen": LISTEN, "controllers": []}, (), ""),
        # Who is behind a router is the router's to know.
        (TWO, {"listen": [], "connect": ROUTER}, (), ""),
        (TWO, {"mode": "client", "connect": ROUTER}, (), ""),
    ],
)
def test_whose_links_prove_who_they_are(
    tmp_path: Path, lines: str, settings: dict[str, Any], controllers: tuple[str, ...], sole: str
) -> None:
    found = read_users(table(tmp_path, lines, **settings))
    assert (found.controllers, found.sole) == (controllers, sole)
    assert found.are_proved == (settings.get("listen") == LISTEN)
    assert found.login is not None
    assert (found.login.user, found.login.password) == ("bridge", "x")


def test_certificates_are_controllers_where_the_site_names_them() -> None:
    endpoint = "tls/192.168.1.10:7447#enable_mtls=true"
    assert not read_users(ZenohTable(listen=[endpoint])).are_proved
    assert read_users(ZenohTable(listen=[endpoint], controllers=["plc"])).controllers == ("plc",)


@pytest.mark.parametrize("name", ["a b", "plc/1", "*", "", "anonymous", "x" * 65])
def test_a_user_whose_name_can_be_no_key_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(Unavailable, match="cannot be a user here"):
        read_users(table(tmp_path, f"{TWO}{name}:z\n"))


@pytest.mark.parametrize(
    ("tail", "owner", "rest"),
    [
        ("conveyor/fu3/command/start", "", "conveyor/fu3/command/start"),
        ("@/controller/plc/conveyor/fu3/command/start", "plc", "conveyor/fu3/command/start"),
        ("@/controller/plc", "plc", ""),
        ("@/controller/", "", ""),
        ("@/event/refused", "", "@/event/refused"),
    ],
)
def test_whose_a_key_is(tail: str, owner: str, rest: str) -> None:
    assert Users(are_proved=True, controllers=("plc", "hmi")).owner(tail) == (owner, rest)
    assert Users(are_proved=True, controllers=("plc",), sole="plc").owner("conveyor/fu3/command") == (
        "plc",
        "conveyor/fu3/command",
    )
    assert Users().owner(tail) == ("", tail), "where nobody proves anything there are no such keys"


@pytest.mark.parametrize("accept_put", [False, True])
@pytest.mark.parametrize("controllers", [(), ("plc",), ("plc", "hmi")])
def test_zenoh_takes_what_is_made_for_it(controllers: tuple[str, ...], accept_put: bool) -> None:
    access = access_control(SPACE, Users(are_proved=True, controllers=controllers), accept_put=accept_put)
    zenoh.Config().insert_json5("access_control", json.dumps(access))
    assert access["default_permission"] == "deny"


NAMES = ("drives", "demo", "conveyor", "fu1", "fu3", "node", "bus", "can0", "bridge", "version", "command")
words = st.sampled_from((*NAMES, "other", "actual", "@", "controller", "event", "*", "**", "fu$*"))


@given(
    st.one_of(
        st.lists(words, min_size=1, max_size=7).map("/".join),
        st.lists(words, min_size=1, max_size=5).map(lambda tail: "/".join(["drives", "demo", *tail])),
        st.sampled_from(SPACE.keys),
    )
)
@example("drives/demo/bridge/@")
@example("drives/demo/@/controller/plc/@")
@example("drives/demo/@/controller")
def test_what_is_answered_without_waiting_is_what_zenoh_was_told(text: str) -> None:
    """A key that one takes for prompt and the other does not would let one client hold up all."""
    key = zenoh.KeyExpr.autocanonize(text)
    included = any(zenoh.KeyExpr(prompt).includes(key) for prompt in SPACE.prompt)
    assert SPACE.is_prompt(str(key)) == included


def test_every_point_is_answered_without_waiting() -> None:
    assert all(SPACE.is_prompt(key) for key in SPACE.keys)
    assert not SPACE.is_prompt(SPACE.everything)
