"""Certificates as the page tells them: to whom, with what, and whether their lists count."""

from __future__ import annotations

import json
from typing import Any

import pytest
from starlette.requests import Request

from bridge.command import Role
from bridge.northbound.page.sessions import PageSession
from bridge.northbound.page.system import CertificateFacts, System
from bridge.text import Text
from tests.support.page import NoSystem

REFUSED = CertificateFacts("rejected", "CN=panel", 1.0, 2.0, "AB:CD", "abcd", Text.of("trust.untrusted"))
TRUSTED = CertificateFacts("trusted", "CN=scada", 1.0, 2.0, "EF:01", "ef01")


class TwoClients(NoSystem):
    def certificates(self) -> Any:
        return [TRUSTED, REFUSED]


async def told(role: Role, *, trusts_anybody: bool = False) -> Any:
    session = PageSession("key", "anna", role, 0.0, 0.0)
    system = System(TwoClients(), list, lambda request: session, trusts_anybody=trusts_anybody)
    (route,) = (route for route in system.routes if route.path == "/api/system")
    answer = await route.endpoint(Request({"type": "http", "method": "GET", "headers": []}))
    return json.loads(bytes(answer.body))


async def test_a_certificate_has_its_bounds_both_its_names_and_what_stands_against_it() -> None:
    trusted, refused = (await told(Role.ENGINEER))["certificates"]
    assert trusted == {
        "of": "trusted",
        "subject": "CN=scada",
        "since": 1.0,
        "until": 2.0,
        "fingerprint": "EF:01",
        "thumbprint": "ef01",
    }
    assert refused["wrong"]["message"] == "it is not trusted"
    assert refused["wrong"]["text"]["code"] == "trust.untrusted"


@pytest.mark.parametrize("role", list(Role))
async def test_names_that_strangers_have_given_themselves_are_for_who_decides(role: Role) -> None:
    shown = [one["of"] for one in (await told(role))["certificates"]]
    assert shown == (["trusted", "rejected"] if role >= Role.ENGINEER else ["trusted"])


@pytest.mark.parametrize("trusts_anybody", [False, True])
async def test_where_anybody_is_let_in_it_is_told(trusts_anybody: bool) -> None:
    assert (await told(Role.OBSERVER, trusts_anybody=trusts_anybody))["trusts_anybody"] is trusts_anybody
