"""Settings of zenoh sessions as zenoh itself has taken them."""

from __future__ import annotations

import json

import pytest

from bridge.base.errors import Unavailable
from bridge.zenohlink.zenoh_config import LEASE_MS, zenoh_config


def setting(name: str, **given: object) -> object:
    return json.loads(zenoh_config(**given).get_json(name))  # type: ignore[arg-type]


def test_a_session_discovers_nobody_and_keeps_trying() -> None:
    assert setting("scouting/multicast/enabled") is False
    assert setting("scouting/gossip/enabled") is False
    assert setting("connect/exit_on_failure") is False
    assert setting("transport/unicast/accept_timeout") == LEASE_MS == 1000


@pytest.mark.parametrize("lease_ms", [LEASE_MS, 250])
def test_a_silent_peer_is_noticed_within_the_lease(lease_ms: int) -> None:
    assert setting("transport/link/tx/lease", lease_ms=lease_ms) == lease_ms


def test_endpoints_are_those_that_are_given() -> None:
    assert setting("listen/endpoints", listen=["tcp/127.0.0.1:7447"]) == ["tcp/127.0.0.1:7447"]
    assert setting("connect/endpoints", mode="client", connect=["tcp/127.0.0.1:1"]) == ["tcp/127.0.0.1:1"]


def test_an_endpoint_that_is_none_is_told_with_its_key() -> None:
    with pytest.raises(Unavailable, match="zenoh does not take listen/endpoints"):
        zenoh_config(listen=["nonsense"])


def test_nothing_longer_than_was_said_is_taken() -> None:
    assert setting("transport/link/rx/max_message_size", longest=4096) == 4096
    assert setting("transport/link/tx/batch_size", longest=4096) == 4096


def test_answers_that_may_be_dropped_go_ahead_of_values_and_others_wait() -> None:
    found = setting("qos/network", prompt=["a/**"], waiting=["b/**"])
    assert isinstance(found, list)
    said = [
        (one["key_exprs"], one["overwrite"]["congestion_control"], one["overwrite"]["priority"])
        for one in found
    ]
    assert said == [
        (["**", "*/**/@/**"], "drop", "background"),
        (["b/**"], "block", "data_low"),
        (["a/**"], "drop", "interactive_high"),
    ]


def test_our_own_user_and_the_file_of_all_are_given_together() -> None:
    given = ("bridge", "secret", "/etc/users")
    assert setting("transport/auth/usrpwd/user", users=given) == "bridge"
    assert setting("transport/auth/usrpwd/dictionary_file", users=given) == "/etc/users"
