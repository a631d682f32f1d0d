"""zenoh: queries and puts of its own client library, sessions that are changed on their way, and bytes at the
port."""

from __future__ import annotations

import contextlib
import select
import socket
import threading
import time
from random import Random
from typing import Final

import zenoh

from tests.fuzz.case import Case, load
from tests.fuzz.mutate import Mutator
from tests.fuzz.rig import STRANGER, Rig
from tests.fuzz.targets.zenoh_config import configure
from tests.fuzz.targets.zenoh_keys import DOINGS, declare_keys

_KINDS: Final = {"get": 70, "put": 12, "declare": 8, "tampered": 3, "raw": 7, "keys": 0.3}
_MODES: Final = ("client", "peer", "router")
_DEEPEST: Final = 9000
"""Words of a key. It fits into no message that the bridge takes, and ended its process when it did."""
_MOST_WORDS: Final = 100_000
"""Limit for the words of all keys of a run: zenoh keeps each word of each for ever."""
_ANSWER_S: Final = 0.3
_MOST_ASKED: Final = 8
_PATIENCE_S: Final = 10.0
_HANDSHAKE: Final = 2
"""Messages of a client until its session is open: InitSyn and OpenSyn."""
_TAMPERED_S: Final = 1.0
_GIVEN_UP_S: Final = 25.0
_TARGETS: Final = ("conveyor/fu1", "conveyor/fu2", "conveyor/fu3", "conveyor/fu4", "pump/drive", "spare/fu1")
_TOP: Final = "drives/hall"
_OF_USERS: Final = f"{_TOP}/@/controller/fuzz"
"""Keys that a site with users has."""
_LONGEST_ENCODING: Final = 60
"""The library panics at more than 255 bytes."""


class Thrower:
    """The parts of a ``get`` or a ``put`` are key, parameters, payload, attachment and encoding; ``raw`` ones
    are batches with their length; that of ``tampered`` is the seed of what is changed. Those of ``keys`` are
    the mode of a session of its own, and for each declaration on it what it declares and how many words its
    key has."""

    def __init__(self, rig: Rig, random: Random) -> None:
        self._rig = rig
        self._named = 0
        """Distinct keys so far."""
        self._port = rig.zenoh
        self._random = random
        self._mutator = Mutator(random, "little")
        corpus = load("zenoh")
        self._queries = corpus.of("get")
        self._batches = corpus.parts("raw")
        self._session: zenoh.Session | None = None
        self._room = threading.BoundedSemaphore(_MOST_ASKED)
        self._tampering: threading.Thread | None = None

    def case(self) -> Case:
        kind = self._random.choices(tuple(_KINDS), tuple(_KINDS.values()))[0]
        if kind == "tampered":
            return Case(kind, (self._random.randbytes(8),))
        if kind == "keys":
            return Case(kind, (self._random.choice(_MODES).encode(), *self._declarations()))
        if kind == "raw":
            raw = self._mutator.mutate(self._random.choice(self._batches), self._batches)
            return Case(kind, tuple(self._mutator.cut(raw, 3)))
        key, parameters, payload, attachment, encoding = self._random.choice(self._queries).parts
        key = self._key(key)
        changed = self._random.sample(range(4), self._random.choice((1, 1, 1, 2, 3)))
        parts = [parameters, payload, attachment, encoding]
        for place in changed:
            parts[place] = self._mutator.mutate_text(parts[place])
        return Case(kind, (key, *parts))

    def _declarations(self) -> list[bytes]:
        words = [1, 3, 30, 300, 3000, _DEEPEST]
        return [
            f"{self._random.choice(DOINGS)} {self._random.choice(words)}".encode()
            for _ in range(self._random.choice((1, 5, 20)))
        ]

    def _key(self, key: bytes) -> bytes:
        _, found, leaf = key.rpartition(b"/command")
        if found and self._random.randrange(2):
            top = _TOP if self._random.randrange(4) else _OF_USERS
            key = f"{top}/{self._random.choice(_TARGETS)}/command".encode() + leaf
        return self._mutator.mutate_text(key) if self._random.randrange(4) == 0 else key

    def throw(self, case: Case) -> None:
        try:
            if case.kind == "raw":
                self._throw_raw(case)
            elif case.kind == "tampered":
                self._tamper(case)
            elif case.kind == "keys":
                self._name_keys(case)
            else:
                self._throw_call(case)
        except (OSError, zenoh.ZError, ValueError, TypeError):
            # The connection has gone, or the library itself does not send such a thing.
            time.sleep(0.001)
        except BaseException as panic:
            if type(panic).__name__ != "PanicException":
                raise
            # That is the library's own fault, at our end. Its session cannot even be closed any more.
            self._session, self._room = None, threading.BoundedSemaphore(_MOST_ASKED)

    def _tamper(self, case: Case) -> None:
        """Beside everything else, one at a time: the library takes ten seconds to give a bad session up."""
        if self._tampering is None or not self._tampering.is_alive():
            arguments = (self._port, Random(case.parts[0]))
            self._tampering = threading.Thread(target=tamper, args=arguments, daemon=True)
            self._tampering.start()

    def _name_keys(self, case: Case) -> None:
        """Distinct ones, on a session of its own that ends with them."""
        mode, *declarations = case.parts
        keys: list[tuple[str, str, int]] = []
        for declaration in declarations:
            doing, words = declaration.decode().split()
            if int(words) < _DEEPEST:
                if self._rig.named_words + int(words) > _MOST_WORDS:
                    continue
                self._rig.named_words += int(words)
            self._named += 1
            keys.append((doing, f"fuzz{self._named}", int(words)))
        declare_keys(self._port, mode.decode(), keys)

    def _throw_call(self, case: Case) -> None:
        key, parameters, payload, attachment, encoding = case.parts
        session = self._open()
        name, options, what = _text(key), _text(parameters), _text(encoding)[:_LONGEST_ENCODING]
        if case.kind == "declare":
            with contextlib.suppress(zenoh.ZError):
                session.liveliness().declare_token(name).undeclare()
            session.declare_subscriber(name, lambda _: None).undeclare()
            return
        if case.kind == "put":
            if len(payload) % 5 == 4:
                session.delete(name, attachment=attachment or None)
            session.put(name, payload, attachment=attachment or None, encoding=what or None)
            return
        if not self._room.acquire(timeout=_PATIENCE_S):
            raise OSError("queries do not come to their end")
        try:
            self._ask(session, f"{name}?{options}" if options else name, payload, attachment, what)
        except BaseException:
            self._make_room()
            raise

    def _ask(
        self, session: zenoh.Session, selector: str, payload: bytes, attachment: bytes, what: str
    ) -> None:
        """Some queries are under way at a time; the end of each makes room."""
        session.get(
            selector,
            zenoh.handlers.Callback(lambda _: None, self._make_room, indirect=False),
            payload=payload or None,
            attachment=attachment or None,
            encoding=what or None,
            timeout=_ANSWER_S,
        )

    def _make_room(self) -> None:
        # A query that could not be asked may have come to its end all the same.
        with contextlib.suppress(ValueError):
            self._room.release()

    def _throw_raw(self, case: Case) -> None:
        with _connect(self._port) as sock:
            for part in case.parts:
                sock.sendall(part)
            while select.select([sock], [], [], 0.02)[0] and sock.recv(65536):
                pass

    def _open(self) -> zenoh.Session:
        if self._session is None or self._session.is_closed():
            self._session = zenoh.open(configure(self._port))
        return self._session

    def close(self) -> None:
        if self._session is not None:
            self._session.close()
            self._session = None
        if self._tampering is not None:
            self._tampering.join(_GIVEN_UP_S)


def _text(raw: bytes) -> str:
    # The library takes texts alone; what is no UTF-8 goes in payloads, attachments and raw bytes.
    return raw.decode("utf-8", "replace")


def _connect(port: int) -> socket.socket:
    return socket.create_connection(("127.0.0.1", port), timeout=2.0, source_address=(STRANGER, 0))


def tamper(port: int, random: Random) -> None:
    """A session of the real library whose messages are changed once it is open."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(2.0)
        carrier = threading.Thread(target=_carry, args=(server, port, random), daemon=True)
        carrier.start()
        with contextlib.suppress(zenoh.ZError):
            session = zenoh.open(configure(server.getsockname()[1]))
            end = time.monotonic() + _TAMPERED_S
            while time.monotonic() < end and not session.is_closed():
                session.get(f"{_TOP}/**", lambda _: None, timeout=_ANSWER_S)
                session.put(f"{_TOP}/conveyor/fu4/command", b'{"control_word":1150}')
                session.liveliness().get(f"{_TOP}/@/**", lambda _: None, timeout=_ANSWER_S)
                time.sleep(0.05)
            session.close()
        carrier.join(_TAMPERED_S + 4.0)


def _carry(server: socket.socket, port: int, random: Random) -> None:
    mutator = Mutator(random)
    with contextlib.suppress(OSError):
        client = server.accept()[0]
        with client, _connect(port) as bridge:
            client.settimeout(2.0)
            rest, messages = b"", 0
            end = time.monotonic() + 2 * _TAMPERED_S
            while time.monotonic() < end:
                for sock in select.select([client, bridge], [], [], 0.1)[0]:
                    data = sock.recv(65536)
                    if not data:
                        return
                    if sock is bridge:
                        client.sendall(data)
                        continue
                    whole, rest = batches(rest + data)
                    for batch in whole:
                        messages += 1
                        if messages > _HANDSHAKE and random.randrange(3) == 0:
                            batch = with_length(mutator.mutate(batch[2:]))
                        bridge.sendall(batch)


def batches(data: bytes) -> tuple[list[bytes], bytes]:
    """Whole batches with their length in front, and what is left."""
    whole: list[bytes] = []
    while len(data) >= 2 and len(data) >= (end := 2 + int.from_bytes(data[:2], "little")):
        whole.append(data[:end])
        data = data[end:]
    return whole, data


def with_length(body: bytes) -> bytes:
    body = body[:0xFFFF]
    return len(body).to_bytes(2, "little") + body
