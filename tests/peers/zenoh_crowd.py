"""Zenoh clients that ask and do not read: ``zenoh_crowd.py ENDPOINT TOP COUNT``.

Each follows everything and asks for a lot, values and commands. When the first answers have come, the
process stops itself.
"""

import json
import os
import signal
import sys
import threading

import zenoh

endpoint, top, count = sys.argv[1], sys.argv[2], int(sys.argv[3])
ROUNDS = 10
answered = threading.Event()


def connect() -> zenoh.Session:
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    # Little room on the way, as on a network: on loopback megabytes wait in the sockets.
    config.insert_json5("connect/endpoints", json.dumps([f"{endpoint}#so_rcvbuf=8192"]))
    config.insert_json5("scouting/multicast/enabled", "false")
    # So the bridge gives them up while the test goes on.
    config.insert_json5("transport/link/tx/lease", "1500")
    return zenoh.open(config)


sessions = [connect() for _ in range(count)]
kept = [
    session.declare_subscriber(f"{top}/**", zenoh.handlers.Callback(lambda _: None, indirect=False))
    for session in sessions
]


def ask(session: zenoh.Session, key: str, payload: str | None) -> None:
    heard = zenoh.handlers.Callback(lambda _: answered.set(), lambda: None, indirect=False)
    session.get(key, heard, payload=payload, timeout=30.0)


for session in sessions:
    ask(session, f"{top}/**", None)
for _ in range(ROUNDS):
    for session in sessions:
        ask(session, f"{top}/conveyor/fu3/**", None)
        ask(session, f"{top}/conveyor/fu3/actual/frequency", None)
        ask(session, f"{top}/conveyor/fu3/command/keep_alive", "{}")
        ask(session, f"{top}/conveyor/fu3/command/control_word", "on")
        ask(session, f"{top}/conveyor/*/command/stop", "{}")
        ask(session, f"{top}/nothing/here", None)
        ask(session, "elsewhere/**", None)
answered.wait(5.0)
print("stopping", flush=True)
os.kill(os.getpid(), signal.SIGSTOP)
