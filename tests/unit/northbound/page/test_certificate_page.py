"""Decisions on certificates: by administrators alone, unread by others, and one certificate at a time."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from starlette.requests import Request
from starlette.responses import Response

from bridge.command import Role
from bridge.northbound.page.certificate_page import CertificatePage
from bridge.northbound.page.refused import BodyTooLong
from bridge.northbound.page.sessions import PageSession
from bridge.trust import TrustStore
from bridge.trust.files import thumbprint
from tests.support.certificates import CLIENT, make

STRANGER, KNOWN = make(), make(CLIENT.but(subject="known"))
PRINT, KNOWN_PRINT = (thumbprint(one.certificate) for one in (STRANGER, KNOWN))


class Case:
    """A page whose ``store`` has refused the stranger and trusts who is known."""

    def __init__(self, folder: Path) -> None:
        self.store = TrustStore(folder / "certificates")
        self.store.prepare()
        self.store.keep_rejected([STRANGER.certificate], "10.0.0.1", 0.0)
        self.store.trust(KNOWN.certificate)
        self.session: PageSession | None = PageSession("key", "anna", Role.ADMIN, 0.0, 0.0)
        self.has_token = True
        self.too_much: Exception | None = None
        self.body = b""
        self.page = CertificatePage(
            self.store, self._read, lambda request: self.session, lambda request: self.has_token
        )

    async def _read(self, request: Request, most: int) -> bytes:
        if self.too_much:
            raise self.too_much
        return self.body

    async def post(self, decision: str, body: Any, scheme: str = "http", host: str = "127.0.0.1") -> Response:
        path = f"/api/certificates/{decision}"
        (route,) = (route for route in self.page.routes if route.path == path)
        assert route.methods == {"POST"}, "a link must not decide"
        self.body = body if isinstance(body, bytes) else json.dumps(body).encode()
        scope = {"type": "http", "method": "POST", "path": path, "headers": [], "scheme": scheme}
        return await route.endpoint(Request({**scope, "client": (host, 50_000) if host else None}))

    @property
    def trusted(self) -> set[str]:
        lists = self.store.lists()
        made = {"stranger": STRANGER, "known": KNOWN}
        return {name for name, one in made.items() if lists.trusts(one.certificate)}


@pytest.fixture
def case(tmp_path: Path) -> Case:
    return Case(tmp_path)


def told(answer: Response) -> tuple[int, str]:
    return answer.status_code, json.loads(bytes(answer.body)).get("error", "")


async def test_who_was_refused_is_trusted_and_rejected_again_with_a_line_each(
    case: Case, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO")
    assert told(await case.post("trust", {"thumbprint": PRINT})) == (200, "")
    assert case.trusted == {"stranger", "known"}
    assert case.store.rejected_ones() == []
    assert told(await case.post("reject", {"thumbprint": PRINT})) == (200, "")
    assert case.trusted == {"known"}
    assert [one.certificate for one in case.store.rejected_ones()] == [STRANGER.certificate]
    assert caplog.messages == [
        f"page: anna from 127.0.0.1 trusts the certificate {PRINT}",
        f"page: anna from 127.0.0.1 rejects the certificate {PRINT}",
    ]


@pytest.mark.parametrize("role", [role for role in Role if role < Role.ADMIN])
@pytest.mark.parametrize("decision", ["trust", "reject"])
async def test_below_an_administrator_nobody_decides(case: Case, role: Role, decision: str) -> None:
    case.session = PageSession("key", "otto", role, 0.0, 0.0)
    for print_ in (PRINT, KNOWN_PRINT):
        assert told(await case.post(decision, {"thumbprint": print_})) == (403, "admin")
    assert case.trusted == {"known"}


async def test_without_a_session_or_from_another_page_nothing_is_decided(case: Case) -> None:
    case.has_token = False
    assert told(await case.post("trust", {"thumbprint": PRINT})) == (403, "token")
    case.session = None
    assert told(await case.post("trust", {"thumbprint": PRINT})) == (401, "login")
    assert case.trusted == {"known"}


@pytest.mark.parametrize(
    ("scheme", "host", "status"),
    [
        ("http", "127.0.0.1", 200),
        ("http", "::ffff:127.0.0.1", 200),
        ("http", "::1", 200),
        ("https", "192.168.1.7", 200),
        ("https", "fe80::1%eth0", 200),
        ("http", "192.168.1.7", 403),
        ("http", "fe80::1%eth0", 403),
        ("http", "", 403),
    ],
)
async def test_in_clear_it_is_decided_on_the_box_alone(
    case: Case, scheme: str, host: str, status: int
) -> None:
    answer = await case.post("trust", {"thumbprint": PRINT}, scheme, host)
    assert told(answer) == (status, "encryption" if status == 403 else "")
    assert ("stranger" in case.trusted) is (status == 200)


@pytest.mark.parametrize(
    "body",
    [
        b"",
        b"{",
        b"\xff",
        [],
        {},
        {"thumbprint": 7},
        {"thumbprint": ""},
        {"thumbprint": PRINT[:-1]},
        {"thumbprint": PRINT.upper() + "0"},
        {"thumbprint": PRINT + "\n"},
        {"thumbprint": "../" + PRINT[3:]},
        {"thumbprint": PRINT, "folder": "own"},
    ],
)
async def test_one_certificate_is_named_in_full_or_none(case: Case, body: Any) -> None:
    assert (await case.post("trust", body)).status_code == 400
    assert case.trusted == {"known"}


@pytest.mark.parametrize("error", [BodyTooLong(), TimeoutError()])
async def test_a_body_that_never_ends_is_refused(case: Case, error: Exception) -> None:
    case.too_much = error
    assert (await case.post("trust", {"thumbprint": PRINT})).status_code == 400


@pytest.mark.parametrize(
    ("decision", "print_"), [("trust", KNOWN_PRINT), ("reject", PRINT)], ids=["trust", "reject"]
)
async def test_what_is_not_there_any_more_is_told(
    case: Case, caplog: pytest.LogCaptureFixture, decision: str, print_: str
) -> None:
    answer = await case.post(decision, {"thumbprint": print_})
    assert answer.status_code == 409
    assert json.loads(bytes(answer.body))["text"]["code"] == "trust.no_such"
    assert f"anna {decision}s {print_} in vain: no certificate in" in caplog.text
    assert case.trusted == {"known"}


async def test_a_folder_that_cannot_be_written_is_told(case: Case) -> None:
    for file in case.store.trusted.iterdir():
        file.unlink()
    case.store.trusted.rmdir()
    case.store.trusted.write_text("in the way")
    answer = await case.post("trust", {"thumbprint": PRINT})
    assert answer.status_code == 409
    assert json.loads(bytes(answer.body))["text"]["code"] == "trust.unwritable"
