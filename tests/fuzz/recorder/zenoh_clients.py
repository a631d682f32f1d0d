"""Recorder of zenoh clients: the demo's controller, the tables of the documentation, and a session's
bytes."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import zenoh

from bridge.sim.controller import Controller, Move, Times
from tests.fuzz.case import Case, Recorded, save
from tests.fuzz.recorder.proxy import recording
from tests.fuzz.rig import Rig
from tests.fuzz.targets.zenoh_target import batches, configure
from tests.support.process import free_port

_DRIVE: Final = "drives/hall/conveyor/fu4"
_MOST_BATCHES: Final = 60
_ASKED: Final = (
    ("a value", f"{_DRIVE}/actual/frequency", ""),
    ("all values", "drives/hall/**", ""),
    ("tokens", "drives/hall/@/**", ""),
    ("a telegram", f"{_DRIVE}/command", '{"control_word": 1151, "setpoint_1": 8192}'),
    ("a word in hexadecimal", f"{_DRIVE}/command/control_word", "0x047E"),
    ("a value as an object", f"{_DRIVE}/command/frequency", '{"v": 25.0}'),
    ("the owner's time-out", f"{_DRIVE}/supervision/fieldbus_timeout_ms", "500"),
    ("a lease", f"{_DRIVE}/command/take_control", '{"ttl_ms": 3000}'),
    ("a start", f"{_DRIVE}/command/start", '{"direction": -1}'),
    ("a stop", f"{_DRIVE}/command/stop", ""),
    ("a quick stop", f"{_DRIVE}/command/quick_stop", ""),
    ("no voltage", f"{_DRIVE}/command/disable_voltage", ""),
    ("keep", f"{_DRIVE}/command/save_parameters", "{}"),
    ("a parameter by its name", f"{_DRIVE}/parameter/P102", ""),
    ("a parameter in brackets", f"{_DRIVE}/parameter/P543%5B2%5D", ""),
    ("a parameter as it was read", f"{_DRIVE}/parameter/p102?cached", ""),
    ("a parameter that is set", f"{_DRIVE}/parameter/p102", "1.03"),
    ("a parameter by its object", f"{_DRIVE}/parameter/2066:01", "7"),
    ("a parameter of another family", "drives/hall/pump/drive/parameter/C00039/1", "100"),
    ("a node", "drives/hall/spare/node/reset_communication", "{}"),
    ("a bus", "drives/hall/bus/can0/start_node", "{}"),
    ("a read-only point", f"{_DRIVE}/status/status_word", "1"),
)


def record(rig: Rig) -> list[Path]:
    return [
        save("zenoh", "demo-controller", "bridge/sim/controller.py as it leads a drive", _controller()),
        save("zenoh", "documentation", "the tables of docs/reference/zenoh.md", _documentation()),
        save("zenoh", "session", "batches that the client library sends", _session(rig)),
    ]


def _noting(speak: Callable[[zenoh.Session], None]) -> list[Recorded]:
    """The queries of ``speak`` to one who answers everything."""
    recorded: list[Recorded] = []

    def note(query: zenoh.Query) -> None:
        key, parameters = str(query.key_expr), str(query.parameters)
        payload, attachment = _bytes(query.payload), _bytes(query.attachment)
        encoding = str(query.encoding) if query.encoding else ""
        texts = (key.encode(), parameters.encode(), payload, attachment, encoding.encode())
        case = Case("get", texts)
        if all(case != one.case for one in recorded):
            recorded.append(Recorded(f"{key} {payload.decode()}".strip(), case))
        if "*" not in key:
            query.reply(key, b'{"ok":true,"forwarded":true}')
        query.drop()

    port = free_port()
    with _open("peer", "listen", port) as server:
        server.declare_queryable("**", note, complete=True)
        with _open("client", "connect", port) as client:
            speak(client)
    return recorded


def _controller() -> list[Recorded]:
    def speak(session: zenoh.Session) -> None:
        times = Times(cycle_s=0.05, run_s=0.4, pause_s=0.2, retry_s=0.1)
        Controller(session, Move(_DRIVE, "frequency", 40.0), times).run_once()

    return _noting(speak)


def _documentation() -> list[Recorded]:
    def speak(session: zenoh.Session) -> None:
        for who in (None, json.dumps({"controller": "robot"})):
            for _, selector, payload in _ASKED:
                for _ in session.get(selector, payload=payload or None, attachment=who, timeout=2.0):
                    pass
                for _ in session.get(
                    selector,
                    payload=payload or None,
                    attachment=who,
                    encoding="application/json",
                    timeout=2.0,
                ):
                    pass

    return _noting(speak)


def _session(rig: Rig) -> list[Recorded]:
    with recording(rig.zenoh) as proxy:
        session = zenoh.open(configure(proxy.port))
        heard = threading.Event()
        session.declare_subscriber("drives/hall/**", lambda _: heard.set())
        session.liveliness().declare_token("drives/hall/@/stranger")
        for _ in session.get("drives/hall/bridge/**", timeout=2.0):
            pass
        session.put(f"{_DRIVE}/command", b'{"control_word":1150}', attachment=b"{}")
        heard.wait(2.0)
        time.sleep(0.5)
        session.close()
        whole = batches(b"".join(link.sent for link in proxy.links))[0]
    names = ("InitSyn", "OpenSyn")
    return [
        Recorded(names[place] if place < len(names) else "a batch of an open session", Case("raw", (batch,)))
        for place, batch in enumerate(whole[:_MOST_BATCHES])
    ]


def _open(mode: str, how: str, port: int) -> zenoh.Session:
    config: Any = zenoh.Config()
    config.insert_json5("mode", json.dumps(mode))
    config.insert_json5(f"{how}/endpoints", json.dumps([f"tcp/127.0.0.1:{port}"]))
    config.insert_json5("scouting/multicast/enabled", "false")
    return zenoh.open(config)


def _bytes(data: zenoh.ZBytes | None) -> bytes:
    return b"" if data is None else data.to_bytes()
