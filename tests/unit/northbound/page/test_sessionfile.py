"""Sessions that outlast the front they were begun in, and a file that tells nobody's secret."""

from __future__ import annotations

import stat
from pathlib import Path

import pytest

from bridge.command import Role
from bridge.northbound.page.sessionfile import SessionFile, credential_of
from bridge.northbound.page.sessions import IDLE_S, KEEP_EVERY_S, PageSession, PageSessions

ANN = {"ann": credential_of("operator", "$scrypt$1")}


def kept(sessions: PageSessions, now: float = 0.0) -> list[PageSession]:
    found = sessions.take_changed(now)
    assert found is not None
    return found


def begun(folder: Path, credentials: dict[str, str] = ANN) -> tuple[PageSession, Path]:
    sessions = PageSessions()
    session = sessions.begin("ann", Role.OPERATOR, 100.0, "10.0.0.1")
    file = folder / "page.sessions"
    SessionFile(file, credentials).save(kept(sessions, 100.0))
    return session, file


def after(file: Path, credentials: dict[str, str] = ANN, now: float = 200.0) -> PageSessions:
    """Sessions of the next front."""
    sessions = PageSessions()
    sessions.restore(SessionFile(file, credentials).load(now))
    return sessions


def test_a_browser_goes_on_with_its_cookie_and_token(tmp_path: Path) -> None:
    before, file = begun(tmp_path)
    found = after(file).find(before.id, 200.0)
    assert found is not None
    assert (found.user, found.role, found.token, found.began) == ("ann", Role.OPERATOR, before.token, 100.0)
    assert found.has(before.token) and not found.has("")


def test_the_file_holds_no_secret_and_is_ours_alone(tmp_path: Path) -> None:
    session, file = begun(tmp_path)
    text = file.read_text()
    assert session.id not in text and session.token not in text and "$scrypt$1" not in text
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    assert after(file).find(session.key, 200.0) is None, "what it holds opens nothing"
    (known,) = SessionFile(file, ANN).load(200.0)
    assert not known.has(""), "a session whose browser has not come yet has no token"


@pytest.mark.parametrize(
    "credentials",
    [{}, {"ann": credential_of("operator", "$scrypt$2")}, {"ann": credential_of("engineer", "$scrypt$1")}],
)
def test_another_password_or_role_ends_it(tmp_path: Path, credentials: dict[str, str]) -> None:
    session, file = begun(tmp_path)
    assert after(file, credentials).find(session.id, 200.0) is None


def test_a_restart_prolongs_nothing(tmp_path: Path) -> None:
    session, file = begun(tmp_path)
    assert after(file, now=100.0 + IDLE_S).find(session.id, 100.0 + IDLE_S) is None


@pytest.mark.parametrize("text", ["", "[]", '{"boot":"of another one","sessions":[]}'])
def test_a_file_of_another_boot_or_a_broken_one_is_as_none(tmp_path: Path, text: str) -> None:
    file = tmp_path / "page.sessions"
    file.write_text(text)
    assert SessionFile(file, ANN).load(0.0) == []


def test_times_of_another_clock_are_not_believed(tmp_path: Path) -> None:
    session, file = begun(tmp_path)
    assert after(file, now=50.0).find(session.id, 50.0) is None


def test_what_has_not_changed_is_kept_once_a_minute() -> None:
    sessions = PageSessions()
    session = sessions.begin("ann", Role.OPERATOR, 0.0)
    assert kept(sessions, 1.0) == [session]
    assert sessions.take_changed(2.0) is None
    sessions.end(session)
    assert kept(sessions, 3.0) == []
    assert kept(sessions, 3.0 + KEEP_EVERY_S) == []
