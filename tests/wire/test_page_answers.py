"""What answers of the page's server have in common, whatever happens behind them."""

from __future__ import annotations

from typing import Any

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
