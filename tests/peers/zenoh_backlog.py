"""A zenoh controller that asks without waiting for answers, and hangs.

zenoh_backlog.py ENDPOINT KEY SECONDS
Waits for a line before each step: leads the drive to operation enabled, then sends enabling telegrams for
SECONDS, says when (monotonic) it gave the last one away, and stops itself.
"""

import json
import os
import signal
import sys
import threading
import time

import zenoh

endpoint, key, seconds = sys.argv[1], sys.argv[2], float(sys.argv[3])
config = zenoh.Config()
config.insert_json5("mode", '"client"')
config.insert_json5("connect/endpoints", json.dumps([endpoint]))
config.insert_json5("scouting/multicast/enabled", "false")
# The front that serves zenoh may still be starting.
config.insert_json5("connect/timeout_ms", "30000")
WHO = json.dumps({"controller": "plc"}).encode()


def ask(session: zenoh.Session, word: int) -> tuple[threading.Event, list[bool]]:
    done = threading.Event()
    answers: list[bool] = []
    session.get(
        key,
        zenoh.handlers.Callback(lambda reply: answers.append(reply.ok is not None), done.set, indirect=False),
        payload=json.dumps({"control_word": word}),
        attachment=WHO,
        timeout=10.0,
        express=True,
    )
    return done, answers


with zenoh.open(config) as session:
    for word in (0x047E, 0x047F):
        sys.stdin.readline()
        answers = [False]
        while answers != [True]:  # a busy machine may have held it up
            done, answers = ask(session, word)
            assert done.wait(10.0)
        print(f"{word:04X}", flush=True)
    sys.stdin.readline()
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        ask(session, 0x047F)
    print(time.monotonic(), flush=True)
    os.kill(os.getpid(), signal.SIGSTOP)
