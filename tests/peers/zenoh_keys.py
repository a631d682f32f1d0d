"""A zenoh client that names many keys, or deep ones: ``zenoh_keys.py ENDPOINT MODE WHAT WORDS COUNT``.

``MODE`` is that of the session; ``WHAT`` is done with ``COUNT`` distinct keys of ``WORDS`` words each, on a
session that stays open.
"""

import contextlib
import json
import sys
import time

import zenoh

endpoint, mode, what, words, count = *sys.argv[1:4], int(sys.argv[4]), int(sys.argv[5])

config = zenoh.Config()
config.insert_json5("mode", json.dumps(mode))
config.insert_json5("connect/endpoints", json.dumps([endpoint]))
config.insert_json5("listen/endpoints", "[]")
config.insert_json5("scouting/multicast/enabled", "false")
session = zenoh.open(config)
kept: list[object] = []


def named(number: int) -> str:
    return "/".join([f"k{number}", *"a" * (words - 1)])


def nothing(*_: object) -> None:
    pass


def do(key: str) -> None:
    match what:
        case "token":
            kept.append(session.liveliness().declare_token(key))
        case "queryable":
            kept.append(session.declare_queryable(key, zenoh.handlers.Callback(nothing, indirect=False)))
        case "subscriber":
            kept.append(session.declare_subscriber(key, zenoh.handlers.Callback(nothing, indirect=False)))
        case "alias":
            kept.append(session.declare_keyexpr(key))
        case "publisher":
            kept.append(session.declare_publisher(key))
        case "get":
            session.get(key, zenoh.handlers.Callback(nothing, nothing, indirect=False), timeout=1.0)
        case "put":
            session.put(key, b"1")
        case _:
            raise SystemExit(f"nobody knows how to {what}")


print("connected", flush=True)
for number in range(count):
    with contextlib.suppress(zenoh.ZError):
        do(named(number))
time.sleep(1.0)
print("done", flush=True)
