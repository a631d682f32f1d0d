"""The page's server under clients that are not ours: who gets in, what is refused, and what it never does."""

from __future__ import annotations

import http.client
import json
import signal
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
GUARDED = (
    "site",
    "faults/de",
    "texts/de",
    "integration",
    "export/modbus.csv",
    f"parameters/{DRIVE}",
    "bus/can0",
    "bus/can0/capture?seconds=1",
    "system",
    "system/site",
    "system/audit",
)
Json = dict[str, Any]


def user(role: str) -> str:
    """User of the role's name, whose password ends with "!"."""
    return f'[[opcua.user]]\nname = "{role}"\nrole = "{role}"\npassword_hash = "{cheap_hash(role + "!")}"\n'


def users() -> str:
    return "\n".join(map(user, ("observer", "operator", "engineer")))


def write_site(folder: Path, port: int, page: str = "", opcua: str = "", timeout_ms: int = 1000) -> Path:
    node = sites.node(sites.drive("fu1", "lease", timeout_ms, f"{sites.ACCEPTED}\n{sites.SCALED}"))
    table = f'[opcua]\nlisten = "127.0.0.1:{free_port()}"\n{opcua}\n{users()}'
    return sites.write(
        folder,
        sites.bus(node, more=sites.BESIDE_A_BROWSER),
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
            legacy=True,
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


@pytest.mark.landing
def test_nothing_is_told_without_a_login(browser: Browser) -> None:
    assert browser.request("GET", "/api/session").status == 401
    for path in GUARDED:
        assert browser.request("GET", f"/api/{path}").status == 401, path
    assert browser.request("GET", "/").status == 200
    with browser.live() as socket, pytest.raises(ConnectionClosed) as closed:
        socket.recv(timeout=TIMEOUT_S)
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == 4401


def test_a_login_gives_what_the_role_may_see(browser: Browser) -> None:
    assert browser.login("operator").json["role"] == "operator"
    site = browser.request("GET", "/api/site").json
    assert browser.request("GET", "/api/export/can0.dbc").body.startswith(b"VERSION")
    assert browser.request("GET", "/api/export/..%2fsite.toml").status == 404
    assert browser.request("GET", "/api/faults/xx").status == 404
    assert browser.request("GET", "/api/texts/xx").status == 404
    assert browser.request("GET", "/api/texts/de").json["node.lost"] == "Knoten nicht erreichbar"
    assert [drive["name"] for drive in site["drives"]] == [DRIVE]


def test_a_login_begins_another_session_and_a_logout_ends_it(browser: Browser) -> None:
    browser.cookie = f"session-{browser.port}=brought-along-by-somebody"
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
    gone = browser.request("POST", "/api/logout", X_Token=browser.token)
    assert gone.status == 200
    assert f"session-{browser.port}=" in gone.cookies[0]
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


@pytest.mark.landing
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


def test_parameters_are_listed_read_and_written_by_whom_may(browser: Browser) -> None:
    browser.login("operator")
    told = browser.request("GET", f"/api/parameters/{DRIVE}").json
    assert "P102.1" in [one["name"] for one in told["parameters"]]
    assert browser.request("GET", "/api/parameters/conveyor/fu9").status == 404
    tab = Tab(browser)
    assert tab.ask("read_parameter", parameter="P102.1")["value"] == 2.0
    missing = tab.ask("read_parameter", parameter="2F00:00")
    assert (missing["ok"], missing["abort_code"]) == (False, 0x0602_0000)
    assert tab.ask("write_parameter", parameter="P102.1", value=3.0)["code"] == "not_allowed"
    tab.socket.close()
    engineer = Browser(browser.port)
    engineer.login("engineer")
    tab = Tab(engineer)
    assert tab.ask("write_parameter", parameter="P102.1", value=3.0)["value"] == 3.0
    assert tab.ask("write_parameter", parameter="P102.1", value=999.0)["code"] == "out_of_range"
    assert tab.ask("write_parameter", parameter="P102.1", value=2.0)["value"] == 2.0
    tab.socket.close()

    def writes() -> int:
        listed = engineer.request("GET", f"/api/parameters/{DRIVE}").json["parameters"]
        return next(one.get("writes", 0) for one in listed if one["name"] == "P102.1")

    until(lambda: writes() == 2, TIMEOUT_S, "both writes are counted")


def test_a_set_becomes_a_file_and_a_file_a_set(browser: Browser) -> None:
    browser.login("operator")
    values = {"values": {"P102.1": 2.5}, "missing": ["P113.1"], "identity": {"vendor": 56}}
    assert browser.request("POST", f"/api/backup/{DRIVE}", values).status == 403, "without the token"
    token = {"X_Token": browser.token}
    made = browser.request("POST", f"/api/backup/{DRIVE}", values, **token)
    assert 'filename="conveyor-fu1.toml"' in made.headers["content-disposition"]
    read = browser.request("POST", f"/api/set/{DRIVE}?name=monday.toml", made.body, **token)
    assert (read.json["values"], read.json["identity"]) == ({"P102.1": 2.5}, {"vendor": 56})
    for name, body, said in (
        ("monday.toml", made.body[:-20], "monday.toml"),
        ("../../etc/passwd", made.body, "a file that ends with"),
        ("fu1.eds", b"nonsense", "fu1.eds"),
        ("fu1.xdd", b"<a>" * 1000, "fu1.xdd"),
    ):
        wrong = browser.request("POST", f"/api/set/{DRIVE}?name={name}", body, **token)
        assert wrong.status == 422, name
        assert said in wrong.json["error"]
        assert "/tmp" not in wrong.json["error"], "nobody is told where files lie on the box"
    for body in (b"", b"[]", b'{"values": 1}', b'{"values": {"P102.1": [1]}}'):
        assert browser.request("POST", f"/api/backup/{DRIVE}", body, **token).status == 400
    assert browser.request("POST", f"/api/set/{DRIVE}?name=a.toml", b"x" * (5 << 20), **token).status == 400
    assert browser.request("GET", "/").status == 200, "and it still serves"


def test_a_tab_hears_the_bus_decoded(browser: Browser) -> None:
    browser.login("observer")
    tab = Tab(browser)
    tab.say({"hear": {"bus": "can0", "kinds": ["pdo"], "nodes": [5]}})
    rows = tab.until(lambda message: message.get("frames"))["frames"]
    assert {row[3] for row in rows} == {"pdo"}
    assert {row[4] for row in rows} == {5}
    assert abs(rows[-1][0] / 1000 - time.time()) < TIMEOUT_S
    tab.say({"hear": {"bus": "can0", "view": "identifiers"}})
    counted = tab.until(lambda message: message.get("identifiers"))["identifiers"]
    assert "080" in [row[0] for row in counted]
    tab.say({"hear": None})
    assert tab.ask("take_control", "nowhere", ttl_ms=1000)["code"] == "unknown_target", "the tab is served"
    tab.socket.close()


@pytest.mark.parametrize(("form", "begins"), [("candump", b"("), ("asc", b"date ")])
def test_a_second_of_the_bus_is_captured(browser: Browser, form: str, begins: bytes) -> None:
    browser.login("observer")
    answer = browser.request("GET", f"/api/bus/can0/capture?seconds=1&format={form}")
    assert answer.status == 200
    assert answer.body.startswith(begins)
    assert answer.body.count(b"\n") > 5
    assert "hall-can0." in answer.headers["content-disposition"]


@pytest.mark.parametrize(
    "query",
    [
        "",
        "seconds=0",
        "seconds=61",
        "seconds=1e9",
        "seconds=1&format=exe",
        "seconds=-1",
        "seconds=" + "9" * 5000,
    ],
)
def test_no_capture_is_endless_or_of_another_form(browser: Browser, query: str) -> None:
    browser.login("observer")
    assert browser.request("GET", f"/api/bus/can0/capture?{query}").status == 422
    assert browser.request("GET", "/api/bus/can9/capture?seconds=1").status == 404


def test_the_system_is_for_everybody_and_its_files_for_engineers(browser: Browser) -> None:
    browser.login("operator")
    told = browser.request("GET", "/api/system").json
    assert told["versions"]["drivebridge"]
    assert told["clients"]["page"] >= 1
    assert "tabs" not in told
    assert [one["of"] for one in told["certificates"]] == ["opcua"]
    for path in ("site", "audit"):
        assert browser.request("GET", f"/api/system/{path}").status == 403
    engineer = Browser(browser.port)
    engineer.login("engineer")
    tab = Tab(engineer)
    tab.until(lambda message: "you" in message)
    assert "engineer" in [one["role"] for one in engineer.request("GET", "/api/system").json["tabs"]]
    file = engineer.request("GET", "/api/system/site").json
    assert "password_hash" in file["text"]
    assert "argon2" not in file["text"]
    assert [one for one in file["findings"] if one["severity"] == "error"] == []
    until(lambda: engineer.request("GET", "/api/system/audit").json != [], TIMEOUT_S, "what was asked for")
    tab.socket.close()


@pytest.mark.landing
def test_a_bus_process_that_hangs_is_told_alone(tmp_path: Path) -> None:
    port = free_port()
    with drivebridge(tmp_path, "run", "run", str(write_site(tmp_path, port)), notify=True) as process:
        process.wait_ready()
        until(lambda: "is served on" in process.output(), 30.0, "the page is served")
        browser = Browser(port)
        browser.login("observer")
        tab = Tab(browser)

        def is_dead(message: Json) -> bool:
            return "bridge_dead" in [one["kind"] for one in message["troubles"]]

        assert not is_dead(tab.until(lambda message: "troubles" in message))
        process.signal(signal.SIGSTOP)
        try:
            told = tab.until(lambda message: "troubles" in message and is_dead(message))
        finally:
            process.signal(signal.SIGCONT)
        assert (len(told["troubles"]), told["waiting"]) == (1, 0)
        tab.until(lambda message: "troubles" in message and not is_dead(message))
        tab.socket.close()


@pytest.mark.landing
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
        body = answer.read()
        assert json.loads(body)["role"] == "observer", "the site file lets anybody read"
        token = json.loads(body)["token"]
        own = cookie.partition(";")[0]
        connection.request("POST", "/api/logout", headers={"Cookie": own, "X-Token": token})
        gone = connection.getresponse().getheader("set-cookie") or ""
        connection.close()
    assert cookie.startswith(f"__Host-session-{port}=")
    assert "Secure" in cookie
    assert gone.startswith(f"__Host-session-{port}=")
    assert {"Secure", "Path=/", "Max-Age=0"} <= {part.strip() for part in gone.split(";")}, "or it stays"
    assert "max-age" in (answer.getheader("strict-transport-security") or "")
