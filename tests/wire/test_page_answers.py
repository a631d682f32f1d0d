"""What answers of the page's server have in common, whatever happens behind them."""

from __future__ import annotations

from typing import Any

import pytest

from tests.support.page import NoSystem, Served


class Broken(NoSystem):
    def certificates(self) -> Any:
        raise PermissionError("what nobody has thought of")

    def check(self) -> Any:
        raise RuntimeError("neither of this")

    def versions(self) -> dict[str, str]:
        return {"drivebridge": "1.2.3"}


async def test_what_is_known_of_the_system_is_told_where_a_part_fails() -> None:
    async with Served(system=Broken()).serving() as served:
        cookie, _ = await served.login("engineer")
        told = (await served.ask("GET", "/api/system", Cookie=cookie)).json
        assert told["versions"] == {"drivebridge": "1.2.3"}
        assert (told["certificates"], [one["of"] for one in told["faults"]]) == ([], ["certificates"])
        (finding,) = (await served.ask("GET", "/api/system/site", Cookie=cookie)).json["findings"]
        assert finding["severity"] == "error"


async def broken(*asked: Any) -> Any:
    raise RuntimeError("what nobody has thought of")


async def test_an_answer_to_our_own_failure_names_the_browsers_rules(
    caplog: pytest.LogCaptureFixture,
) -> None:
    async with Served(capture=broken).serving() as served:
        cookie, _ = await served.login("observer")
        answer = await served.ask("GET", "/api/bus/can0/capture?seconds=1", Cookie=cookie)
    assert answer.status == 500
    assert "default-src 'none'" in answer.headers["content-security-policy"]
    assert answer.headers["x-content-type-options"] == "nosniff"
    assert b"thought of" not in answer.body
    assert "thought of" in caplog.text


async def test_a_browser_asks_whether_a_file_is_still_the_same() -> None:
    async with Served().serving() as served:
        first = await served.ask("GET", "/static/js/main.js")
        assert first.headers["cache-control"] == "no-cache"
        again = await served.ask("GET", "/static/js/main.js", If_None_Match=first.headers["etag"])
        assert (again.status, again.body) == (304, b"")
        assert again.headers["cache-control"] == "no-cache"


@pytest.mark.parametrize("opcua", ["", 'trust = "anybody"'])
async def test_the_page_says_whether_anybody_is_let_in_by_opcua(opcua: str) -> None:
    async with Served(opcua=opcua).serving() as served:
        cookie, _ = await served.login("observer")
        told = (await served.ask("GET", "/api/system", Cookie=cookie)).json
        assert told["trusts_anybody"] is bool(opcua)


async def test_without_folders_of_certificates_there_is_nothing_to_decide() -> None:
    async with Served().serving() as served:
        cookie, token = await served.login("engineer")
        for decision in ("trust", "reject"):
            path = f"/api/certificates/{decision}"
            assert (await served.ask("POST", path, b"{}", Cookie=cookie, X_Token=token)).status == 404
