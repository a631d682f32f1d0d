"""The page's server under clients that are not ours: who gets in, what is refused, and what it never does."""

from __future__ import annotations

import http.client
import json
import socket
import ssl
import subprocess
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect

from tests.support import sites
from tests.support.passwords import cheap_hash
from tests.support.process import Process, drivebridge, free_port, until

DRIVE = "conveyor/fu1"
TIMEOUT_S = 5.0
Json = dict[str, Any]


def users() -> str:
    entries = [
        f'[[opcua.user]]\nname = "{name}"\nrole = "{name}"\npassword_hash = "{cheap_hash(name + "!")}"\n'
        for name in ("observer", "operator", "engineer")
    ]
    return "\n".join(entries)


def write_site(folder: Path, port: int, page: str = "", opcua: str = "") -> Path:
    node = sites.node(sites.drive("fu1", "lease", 1000))
    table = f'[opcua]\nlisten = "127.0.0.1:{free_port()}"\n{opcua}\n{users()}'
    return sites.write(
        folder,
        sites.bus(node),
        sites.modbus(free_port()),
        table,
        f'[page]\nlisten = "127.0.0.1:{port}"\n{page}\n',
    )


@dataclass
class Answer:
    status: int
    headers: dict[str, str]
    cookies: list[str]
    body: bytes

    @property
    def json(self) -> Any:
        return json.loads(self.body)


class Browser:
    """What a browser keeps and sends, and no more."""

    def __init__(self, port: int) -> None:
        self.port = port
        self.origin = f"http://127.0.0.1:{port}"
        self.cookie = self.token = ""

    def request(self, method: str, path: str, body: Any = None, **headers: str) -> Answer:
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=TIMEOUT_S)
        sent = {name.replace("_", "-"): value for name, value in headers.items()}
        if self.cookie:
            sent.setdefault("Cookie", self.cookie)
        data = body if isinstance(body, bytes | None) else json.dumps(body).encode()
        try:
            connection.request(method, path, data, sent)
            answer = connection.getresponse()
            got = answer.getheaders()
            cookies = [value for name, value in got if name.lower() == "set-cookie"]
            if cookies:
                self.cookie = cookies[-1].partition(";")[0]
            return Answer(answer.status, {name.lower(): value for name, value in got}, cookies, answer.read())
        finally:
            connection.close()

    def login(self, user: str, password: str | None = None) -> Answer:
        answer = self.request("POST", "/api/login", {"user": user, "password": password or f"{user}!"})
        if answer.status == 200:
            self.token = answer.json["token"]
        return answer

    def live(self, origin: str | None = None) -> ClientConnection:
        """A tab, which has not said its token yet."""
        return connect(
            f"ws://127.0.0.1:{self.port}/live",
            origin=origin or self.origin,  # type: ignore[arg-type]
            additional_headers={"Cookie": self.cookie},
            open_timeout=TIMEOUT_S,
        )


class Tab:
    def __init__(self, browser: Browser) -> None:
        self.socket = browser.live()
        self.socket.send(browser.token)
        self._number = 0

    def ask(self, action: str, target: str = DRIVE, **fields: Any) -> Json:
        self._number += 1
        self.say({"ask": self._number, "target": target, "action": action, "fields": fields})
        return self.until(lambda message: message.get("outcome") == self._number)

    def say(self, message: Json) -> None:
        self.socket.send(json.dumps(message))

    def until(self, is_wanted: Any) -> Json:
        limit = time.monotonic() + TIMEOUT_S
        while time.monotonic() < limit:
            message = json.loads(self.socket.recv(timeout=TIMEOUT_S))
            if is_wanted(message):
                return message
        raise AssertionError("nothing of that kind came")


@pytest.fixture(scope="module")
def bridge(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Process, int]]:
    folder, port = tmp_path_factory.mktemp("page"), free_port()
    with drivebridge(folder, "run", "run", str(write_site(folder, port)), notify=True) as process:
        process.wait_ready()
        until(lambda: "is served on" in process.output(), 30.0, "the page is served")
        yield process, port


@pytest.fixture
def browser(bridge: tuple[Process, int]) -> Browser:
    return Browser(bridge[1])


def test_nothing_is_told_without_a_login(browser: Browser) -> None:
    assert browser.request("GET", "/api/session").status == 401
    for path in ("site", "faults/de", "integration", "export/modbus.csv"):
        assert browser.request("GET", f"/api/{path}").status == 401, path
    assert browser.request("GET", "/").status == 200
    with pytest.raises(InvalidStatus):
        browser.live()


def test_a_login_gives_what_the_role_may_see(browser: Browser) -> None:
    assert browser.login("operator").json["role"] == "operator"
    site = browser.request("GET", "/api/site").json
    assert browser.request("GET", "/api/export/can0.dbc").body.startswith(b"VERSION")
    assert browser.request("GET", "/api/export/..%2fsite.toml").status == 404
    assert browser.request("GET", "/api/faults/xx").status == 404
    assert [drive["name"] for drive in site["drives"]] == [DRIVE]


def test_a_login_begins_another_session_and_a_logout_ends_it(browser: Browser) -> None:
    browser.cookie = "session=brought-along-by-somebody"
    browser.login("operator")
    first = browser.cookie
    assert "brought" not in first
    browser.login("operator")
    second = browser.cookie
    assert second != first
    browser.cookie = first
    assert browser.request("GET", "/api/site").status == 401, "the session before is over"
    browser.cookie = second
    assert browser.request("POST", "/api/logout").status == 403, "without the token"
    assert browser.request("POST", "/api/logout", X_Token=browser.token).status == 200
    browser.cookie = second
    assert browser.request("GET", "/api/site").status == 401


def test_the_cookie_is_for_this_page_alone(browser: Browser) -> None:
    (cookie,) = browser.login("operator").cookies
    assert {"HttpOnly", "Path=/", "SameSite=strict"} <= {part.strip() for part in cookie.split(";")}
    assert "domain" not in cookie.lower()


@pytest.mark.parametrize("path", ["/", "/api/session", "/nothing", "/static/page.css", "/static/nothing.js"])
def test_each_answer_names_the_browsers_rules(browser: Browser, path: str) -> None:
    headers = browser.request("GET", path).headers
    policy = headers["content-security-policy"]
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy
    assert "frame-ancestors 'none'" in policy
    assert headers["x-content-type-options"] == "nosniff"
    assert "access-control-allow-origin" not in headers
    assert "server" not in headers


@pytest.mark.parametrize(
    "path",
    [
        "/static/../web.py",
        "/static/%2e%2e/web.py",
        "/static/..%2fweb.py",
        "/static/js/../../web.py",
        "/static//etc/passwd",
        "/static/%5c..%5cweb.py",
        "/static/js",
        "/static/",
    ],
)
def test_no_path_leads_out_of_the_pages_files(browser: Browser, path: str) -> None:
    answer = browser.request("GET", path)
    assert answer.status in (400, 404, 405)
    assert b"import" not in answer.body
    assert b"root:" not in answer.body


def test_a_foreign_name_or_page_is_refused(browser: Browser) -> None:
    assert browser.request("GET", "/", Host="evil.example").status == 400
    assert browser.request("GET", "/", Host=f"localhost:{browser.port}").status == 200
    login = {"user": "operator", "password": "operator!"}
    assert browser.request("POST", "/api/login", login, Origin="http://evil.example").status == 400
    browser.login("operator")
    with pytest.raises(InvalidStatus):
        browser.live(origin="http://evil.example")


def test_a_tab_without_the_sessions_token_is_closed(browser: Browser) -> None:
    browser.login("operator")
    with browser.live() as socket:
        socket.send("guessed")
        with pytest.raises(ConnectionClosed) as closed:
            socket.recv(timeout=TIMEOUT_S)
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == 4403


def test_large_and_malformed_requests_are_refused(browser: Browser) -> None:
    assert browser.request("POST", "/api/login", b"x" * 70_000).status == 400
    for body in (b"", b"{", b"[]", b'{"user": 1, "password": 2}', b'{"user": "a"}', b"\xff"):
        assert browser.request("POST", "/api/login", body).status == 400
    assert browser.request("GET", "/", X_Long="x" * 40_000).status in (400, 431)
    assert browser.request("DELETE", "/api/session").status == 405
    assert browser.request("GET", "/").status == 200, "and it still serves"


def test_who_says_nothing_is_cut_off(browser: Browser) -> None:
    """Slow heads: a connection that says nothing, and one that never comes to the end of its head. A tab that
    only looks is none of them."""
    browser.login("observer")
    tab = Tab(browser)
    begun = time.monotonic()
    silent, slow = (socket.create_connection(("127.0.0.1", browser.port), TIMEOUT_S * 4) for _ in range(2))
    slow.sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\n")
    with silent, slow:
        assert silent.recv(100) == b""
        slow.settimeout(TIMEOUT_S)
        assert b"200" not in slow.recv(1000)
    assert time.monotonic() - begun < 15
    assert tab.ask("take_control", "nowhere", ttl_ms=1000)["code"] == "unknown_target", "the tab is served"
    tab.socket.close()


def test_guessing_a_password_gets_slow(browser: Browser) -> None:
    answers = [browser.login("operator", "wrong") for _ in range(8)]
    assert [answer.status for answer in answers[:5]] == [403] * 5
    assert 429 in [answer.status for answer in answers]
    until(lambda: browser.login("operator").status == 200, 15.0, "it may be tried again")


def test_a_tab_controls_a_drive_as_long_as_it_says_so(browser: Browser) -> None:
    browser.login("operator")
    tab = Tab(browser)
    own = tab.until(lambda message: "you" in message)["you"]
    tab.say({"show": [f"drive {DRIVE}"]})
    state = tab.until(lambda message: message.get("topic") == f"drive {DRIVE}")["state"]
    worst_ms = state[f"{DRIVE}/supervision/worst_case_stop_ms"][0]
    assert tab.ask("take_control", ttl_ms=1000)["ok"]
    assert tab.ask("write", values={"frequency": 20.0})["ok"]
    assert tab.ask("start", direction=1)["ok"]
    enabled = run_for(tab, 2.0)
    assert enabled[f"{DRIVE}/supervision/owner"][0] == own
    assert enabled[f"{DRIVE}/actual/frequency"][0] == pytest.approx(20, abs=1)
    tab.socket.close()
    watcher = Tab(browser)
    watcher.say({"show": [f"drive {DRIVE}"]})
    began = time.monotonic()
    shown = watcher.until(lambda message: message.get("topic") == f"drive {DRIVE}")["state"]
    while shown[f"{DRIVE}/supervision/owner"][0] == own:
        shown |= watcher.until(lambda message: "changes" in message)["changes"]
        assert time.monotonic() - began < worst_ms / 1000 + TIMEOUT_S
    assert shown[f"{DRIVE}/supervision/sent_control_word"][0] & 0xF != 0xF
    watcher.socket.close()


def run_for(tab: Tab, seconds: float) -> Json:
    """The points of the drive after this time, in which the tab has said that it is there."""
    until_s = time.monotonic() + seconds
    while time.monotonic() < until_s:
        assert tab.ask("keep_alive")["ok"]
        time.sleep(0.1)
    tab.say({"show": []})
    tab.say({"show": [f"drive {DRIVE}"]})
    return tab.until(lambda message: message.get("topic") == f"drive {DRIVE}" and "state" in message)["state"]


def test_an_observer_sees_and_commands_nothing(browser: Browser) -> None:
    browser.login("observer")
    tab = Tab(browser)
    assert tab.ask("take_control", ttl_ms=1000)["code"] == "not_allowed"
    assert tab.ask("stop")["code"] == "not_allowed"
    assert tab.ask("start", direction=1)["code"] == "not_allowed"
    tab.socket.close()


@pytest.mark.parametrize("message", ["{", '{"dance": 1}', '{"show": ["cellar"]}', '{"show": 1}', "[]", '"x"'])
def test_what_is_no_message_ends_this_tab_alone(browser: Browser, message: str) -> None:
    browser.login("operator")
    other, tab = Tab(browser), Tab(browser)
    tab.socket.send(message)
    with pytest.raises(ConnectionClosed) as closed:
        tab.until(lambda message: False)
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == 1008
    assert other.ask("take_control", "nowhere", ttl_ms=1000)["code"] == "unknown_target"
    other.socket.close()


def test_a_logout_closes_the_tabs_of_its_session(browser: Browser) -> None:
    browser.login("operator")
    tab = Tab(browser)
    tab.until(lambda message: "you" in message)
    browser.request("POST", "/api/logout", X_Token=browser.token)
    with pytest.raises(ConnectionClosed) as closed:
        tab.until(lambda message: False)
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == 4401


def test_by_tls_the_cookie_is_bound_to_it(tmp_path: Path) -> None:
    key, certificate = tmp_path / "key.pem", tmp_path / "certificate.pem"
    made = [
        "openssl",
        "req",
        "-x509",
        "-newkey",
        "ec",
        "-pkeyopt",
        "ec_paramgen_curve:P-256",
        "-nodes",
        "-days",
        "2",
        "-subj",
        "/CN=box",
    ]
    names = ["-addext", "subjectAltName=IP:127.0.0.1"]
    command = [*made, *names, "-keyout", str(key), "-out", str(certificate)]
    subprocess.run(command, check=True, capture_output=True)
    port = free_port()
    table = f'certificate = "{certificate}"\nprivate_key = "{key}"'
    site = write_site(tmp_path, port, table, 'anonymous = "observer"')
    with drivebridge(tmp_path, "run", "run", str(site), notify=True) as process:
        process.wait_ready()
        until(lambda: "is served on" in process.output(), 30.0, "the page is served")
        context = ssl.create_default_context(cafile=str(certificate))
        connection = http.client.HTTPSConnection("127.0.0.1", port, timeout=TIMEOUT_S, context=context)
        connection.request("GET", "/api/session")
        answer = connection.getresponse()
        cookie = answer.getheader("set-cookie") or ""
        assert json.loads(answer.read())["role"] == "observer", "the site file lets anybody read"
        connection.close()
    assert cookie.startswith("__Host-")
    assert "Secure" in cookie
    assert "max-age" in (answer.getheader("strict-transport-security") or "")
