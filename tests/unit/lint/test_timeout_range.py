"""Range of the owner's time-out: `check` repeats dangerous ones, and publishes the longest."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.lint import CheckResult, Severity, lint
from bridge.mapping import load_family
from bridge.mapping.loader import family_names, mapping_folders
from bridge.project import load_project
from tests.support import sites

FAMILIES = list(family_names(mapping_folders(Path("site.toml"))))
WRITABLE = "fieldbus_timeout_writable = true"
VENDORS = list({name.partition("/")[0]: name for name in FAMILIES}.values())
SITE_MS = 200


def judge(
    folder: Path, mapping: str, more: str, *, control: str = "modbus", timeout_ms: int = SITE_MS
) -> CheckResult:
    slot = load_family(mapping).slot[0].name
    whole = sites.node(sites.drive(slot, control, timeout_ms, more), name="n", mapping=mapping)
    path = sites.write(folder, sites.bus(whole), sites.modbus())
    project = load_project(path)
    return lint(project.site, project.families, path, project.downloads)


def told(verdict: CheckResult) -> list[str]:
    assert not [one for one in verdict.of(Severity.ERROR) if "range" in str(one)]
    return [str(one) for one in verdict.of(Severity.WARNING) if "fieldbus_timeout_range_ms" in str(one)]


@pytest.mark.landing(40)
@pytest.mark.parametrize("mapping", VENDORS)
@pytest.mark.parametrize(
    ("more", "messages"),
    [
        ("", []),
        (WRITABLE, []),
        (f"{WRITABLE}\nfieldbus_timeout_range_ms = [100, 2000]", []),
        (f"{WRITABLE}\nfieldbus_timeout_range_ms = [200, 200]", []),
        (f"{WRITABLE}\nfieldbus_timeout_range_ms = [0, 2000]", ["the owner may switch off the time-out"]),
        (
            f"{WRITABLE}\nfieldbus_timeout_range_ms = [201, 2000]",
            ["does not include the site's own fieldbus_timeout_ms = 200"],
        ),
        (
            f"{WRITABLE}\nfieldbus_timeout_range_ms = [100, 199]",
            ["does not include the site's own fieldbus_timeout_ms = 200"],
        ),
        (
            f"{WRITABLE}\nfieldbus_timeout_range_ms = [0, 199]",
            [
                "the owner may switch off the time-out",
                "does not include the site's own fieldbus_timeout_ms = 200",
            ],
        ),
        ("fieldbus_timeout_range_ms = [100, 2000]", ["has no effect: the owner may not set"]),
        ("fieldbus_timeout_range_ms = [0, 100]", ["has no effect: the owner may not set"]),
    ],
)
def test_a_range_that_cannot_be_meant_so(
    tmp_path: Path, mapping: str, more: str, messages: list[str]
) -> None:
    found = told(judge(tmp_path, mapping, more))
    assert len(found) == len(messages)
    for message in messages:
        assert any(message in one for one in found)


@pytest.mark.landing(6)
@pytest.mark.parametrize("mapping", FAMILIES)
def test_the_longest_time_is_published_beside_the_sites(tmp_path: Path, mapping: str) -> None:
    def case(more: str, timeout_ms: int = SITE_MS):
        return judge(tmp_path, mapping, more, timeout_ms=timeout_ms).worst_cases[0]

    plain = case("")
    assert "owner may set" not in str(plain)
    assert plain.facts["controller_longest_ms"] == plain.stop.ms
    for more, longest_ms in (
        (WRITABLE, 10 * SITE_MS),
        (f"{WRITABLE}\nfieldbus_timeout_range_ms = [100, 1500]", 1500),
        (f"{WRITABLE}\nfieldbus_timeout_range_ms = [50, 100]", SITE_MS),
    ):
        found = case(more)
        expected = case("", longest_ms).stop
        assert found.stop == plain.stop
        assert f"dead controller: {plain.stop} (as its owner may set it: {expected})" in str(found)
        assert found.facts["controller_longest_ms"] == expected.ms
    assert "(as its owner may set it: never)" in str(
        case(f"{WRITABLE}\nfieldbus_timeout_range_ms = [0, 1500]")
    )


def test_without_an_owner_there_is_nothing_to_tell(tmp_path: Path) -> None:
    more = f"{WRITABLE}\nfieldbus_timeout_range_ms = [0, 100]"
    verdict = judge(tmp_path, "nord/sk-tu4-cao", more, control="none")
    assert not told(verdict)
    assert verdict.worst_cases[0].longest is None
