"""Rules for zenoh's links: nobody but the bridge publishes or answers, and each user has keys of its own."""

from __future__ import annotations

from typing import Any, cast

import pytest

from bridge.image import Image
from bridge.northbound.zenoh.access_control import access_control
from bridge.northbound.zenoh.keys import KeySpace
from bridge.northbound.zenoh.users import Users
from tests.support import sites

SITE = sites.site(sites.bus(sites.node(sites.drive("fu1", "zenoh", 200))), sites.zenoh())


def rules(*controllers: str, accept_put: bool = False) -> dict[str, Any]:
    image: Image = sites.plant_of(SITE).image
    keys = KeySpace("plant", "hall", image.points)
    users = Users(are_proved=bool(controllers), controllers=controllers)
    return cast("dict[str, Any]", access_control(keys, users, accept_put=accept_put))


def allowed(found: dict[str, Any], flow: str, message: str) -> list[str]:
    return [
        key
        for rule in found["rules"]
        if flow in rule["flows"] and message in rule["messages"]
        for key in rule["key_exprs"]
    ]


def test_without_a_rule_nothing_passes() -> None:
    found = rules()
    assert (found["enabled"], found["default_permission"]) == (True, "deny")
    assert {rule["permission"] for rule in found["rules"]} == {"allow"}


@pytest.mark.parametrize("message", ["put", "reply", "declare_queryable", "liveliness_token", "delete"])
def test_nobody_can_pose_as_the_bridge(message: str) -> None:
    assert allowed(rules(), "ingress", message) == []


def test_what_the_bridge_publishes_is_below_its_site() -> None:
    for message in ("put", "declare_queryable", "liveliness_token"):
        assert all(key.startswith("plant/hall/") for key in allowed(rules(), "egress", message))


def test_anybody_may_ask_and_follow() -> None:
    assert "**" in allowed(rules(), "ingress", "query")
    assert "*/**/@/**" in allowed(rules(), "ingress", "declare_subscriber")


def test_puts_are_taken_where_the_site_file_says_so_and_for_commands_alone() -> None:
    taken = allowed(rules(accept_put=True), "ingress", "put")
    assert taken
    assert all("/command/" in key for key in taken)


@pytest.mark.parametrize("accept_put", [True, False])
def test_each_controller_has_its_own_keys_by_name_and_certificate(accept_put: bool) -> None:
    found = rules("ann", "bob", accept_put=accept_put)
    by_subject = {policy["subjects"][0]: policy["rules"] for policy in found["policies"]}
    assert by_subject["user ann"] == ["command as ann"]
    (rule,) = (one for one in found["rules"] if one["id"] == "command as ann")
    assert rule["key_exprs"] == ["plant/hall/@/controller/ann/**"]
    assert rule["messages"] == (["query", "put"] if accept_put else ["query"])
    named = {subject["id"]: subject for subject in found["subjects"]}
    assert named["user ann"]["usernames"] == ["ann"]
    assert named["certificate bob"]["cert_common_names"] == ["bob"]
    assert "command as ann" not in by_subject["everybody"]
