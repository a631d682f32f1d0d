"""A second process with nothing but plain zenoh: does what it is told in JSON lines, tells what it sees.

Usage: zenoh_peer.py ENDPOINT MODE [USER PASSWORD]
"""

from __future__ import annotations

import json
import os
import sys
import threading
import time

import zenoh

LOCK = threading.Lock()


def say(**what: object) -> None:
    with LOCK:
        print(json.dumps(what), flush=True)


def show(sample: zenoh.Sample) -> dict[str, object]:
    return {
        "key": str(sample.key_expr),
        "payload": sample.payload.to_bytes().decode(),
        "encoding": str(sample.encoding),
        "attachment": sample.attachment.to_bytes().decode() if sample.attachment is not None else None,
        "stamped": sample.timestamp is not None,
        "is_put": sample.kind == zenoh.SampleKind.PUT,
    }


def ask(session: zenoh.Session, order: dict[str, str]) -> None:
    begin = time.monotonic()
    target = zenoh.QueryTarget.ALL if order.get("target") == "all" else zenoh.QueryTarget.DEFAULT
    replies = session.get(
        order["key"],
        payload=order.get("payload"),
        attachment=order.get("attachment"),
        target=target,
        timeout=5.0,
        source_info=zenoh.SourceInfo(session.id, 1) if order.get("source") else None,
    )
    values: list[dict[str, object]] = []
    errors: list[str] = []
    for reply in replies:
        if reply.ok is not None:
            values.append(show(reply.ok))
        elif reply.err is not None:
            errors.append(reply.err.payload.to_bytes().decode())
    say(id=order["id"], values=values, errors=errors, took=time.monotonic() - begin)


class Storage:
    """Keeps the newest sample of each key, and answers with it, as zenoh's storages do."""

    def __init__(self, session: zenoh.Session, key: str, *, is_complete: bool) -> None:
        self._kept: dict[str, zenoh.Sample] = {}
        self._declared = (
            session.declare_subscriber(key, self._keep),
            session.declare_queryable(key, self._answer, complete=is_complete),
        )

    def _keep(self, sample: zenoh.Sample) -> None:
        self._kept[str(sample.key_expr)] = sample

    def _answer(self, query: zenoh.Query) -> None:
        for key, sample in list(self._kept.items()):
            if query.key_expr.intersects(zenoh.KeyExpr(key)):
                query.reply(key, sample.payload, encoding=sample.encoding, timestamp=sample.timestamp)
        query.drop()


def answer_always(session: zenoh.Session, key: str, payload: str) -> object:
    def answer(query: zenoh.Query) -> None:
        query.reply(query.key_expr, payload, timestamp=session.new_timestamp())
        query.drop()

    return session.declare_queryable(key, answer, complete=True)


def main() -> None:
    endpoint, mode, *user = sys.argv[1:]
    config = zenoh.Config()
    config.insert_json5("mode", json.dumps(mode))
    config.insert_json5("connect/endpoints", json.dumps([endpoint]))
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("scouting/gossip/enabled", "false")
    if user:
        config.insert_json5("transport/auth/usrpwd/user", json.dumps(user[0]))
        config.insert_json5("transport/auth/usrpwd/password", json.dumps(user[1]))
    session = zenoh.open(config)
    kept: list[object] = []
    say(id="ready", peers=len(session.info.peers_zid()) + len(session.info.routers_zid()))
    for line in sys.stdin:
        order = json.loads(line)
        match order["do"]:
            case "subscribe":
                kept.append(session.declare_subscriber(order["key"], lambda sample: say(sample=show(sample))))
                say(id=order["id"])
            case "liveliness":
                kept.append(
                    session.liveliness().declare_subscriber(
                        order["key"], lambda sample: say(token=show(sample)), history=True
                    )
                )
                say(id=order["id"])
            case "put":
                session.put(order["key"], order["payload"], attachment=order.get("attachment"))
                say(id=order["id"])
            case "delete":
                session.delete(order["key"])
                say(id=order["id"])
            case "token":
                kept.append(session.liveliness().declare_token(order["key"]))
                say(id=order["id"])
            case "answer":
                kept.append(answer_always(session, order["key"], order["payload"]))
                say(id=order["id"])
            case "store":
                kept.append(Storage(session, order["key"], is_complete=order.get("complete") == "yes"))
                say(id=order["id"])
            case "get":
                threading.Thread(target=ask, args=(session, order), daemon=True).start()
            case unknown:
                say(id=order["id"], unknown=unknown)
    os._exit(0)


main()
