"""Recorded messages, changed: blindly, and where they have lengths, counts, numbers and texts.

Everything comes from one seeded generator: the same seed gives the same messages.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Callable, Sequence
from random import Random
from typing import Final, Literal

Order = Literal["little", "big"]

LONGEST: Final = 200_000
"""No message grows beyond it: what is sent in the time counts, not how much of it."""

NUMBERS: Final = (0, 1, 2, 0x7F, 0x80, 0xFF, 0x100, 0x7FFF, 0x8000, 0xFFFF, 0x10000, 0x7FFFFFFF, 0x80000000)
NUMBERS_64: Final = (2**53, 2**63 - 1, 2**63, 2**64 - 1)
FLOATS: Final = tuple(
    struct.pack("<d", value) for value in (float("nan"), float("inf"), -float("inf"), 1e308, -0.0, 5e-324)
)
NOT_UTF8: Final = (
    b"\x80",  # continues nothing
    b"\xc3",  # ends too early
    b"\xc0\xaf",  # longer than needed
    b"\xed\xa0\x80",  # half of a surrogate pair
    b"\xf4\x90\x80\x80",  # beyond U+10FFFF
    b"\xff\xfe",
)
ODD_TEXTS: Final = (
    b"",
    b"\0",
    b"a\0b",
    b"\r\n00:00:00 ERROR   forged",
    b"\x1b[2J",
    "\u202e\ufeff\U0001f4a5".encode(),
    b"%s%n{0.__class__}",
    b"../../../../etc/passwd",
    b"**",
    b"conveyor/fu1/command/control_word",
    b"$*?#[]/",
    b"A" * 5000,
)
ODD_JSON: Final = (
    b"null",
    b"[]",
    b"{}",
    b'"\\ud800"',
    b"1e999",
    b"-0",
    b"NaN",
    b"1" * 400,
    b"[" * 3000,
    b'{"v":' * 1000,
    b'{"v":1,"v":2}',
    b'{"control_word":1151,"setpoint_1":8192}',
    b'{"control_word":1.5}',
    b'{"control_word":true,"setpoint_1":null}',
    b'{"ttl_ms":-1}',
    b'{"ttl_ms":1e18}',
    b'{"direction":"forward"}',
    b'{"controller":"\\u0000"}',
    b"\xef\xbb\xbf{}",
    b'{"v":"' + b"\xff" + b'"}',
)
_TOKEN: Final = re.compile(rb'"(?:[^"\\]|\\.)*"|-?\d+(?:\.\d+)?|true|false|null|[{}\[\],:]')
_MOST_CHANGES: Final = 4
_LOOKED_AT: Final = 4000
"""Texts are looked for in so many bytes."""


class Mutator:
    """Changes messages. ``order`` is that of the numbers in them; ``texts`` says whether texts stand behind
    a length of 32 bits, as in OPC UA."""

    def __init__(self, random: Random, order: Order = "little", *, texts: bool = False) -> None:
        self.random = random
        self._order: Order = order
        self._texts = texts
        self._changes: list[Callable[[bytes, Sequence[bytes]], bytes]] = [
            self._flip,
            self._put_bytes,
            self._put_number,
            self._add_to_number,
            self._truncate,
            self._lengthen,
            self._delete,
            self._repeat,
            self._swap,
            self._splice,
        ]
        if texts:
            self._changes += [self._change_text, self._change_text, self._change_length, self._put_float]

    def mutate(self, message: bytes, others: Sequence[bytes] = ()) -> bytes:
        """``message`` after one change or some; parts of ``others`` may find their way into it."""
        for _ in range(self.random.choice((1, 1, 1, 2, 3, _MOST_CHANGES))):
            message = self.random.choice(self._changes)(message, others or (message,))
        return message[:LONGEST]

    def mutate_text(self, text: bytes) -> bytes:
        """JSON, a key, a name: changed where it has words, or as bytes."""
        change = self.random.randrange(6)
        if change == 0:
            return self.random.choice(ODD_JSON)
        if change == 1:
            return self._at_random(text, self.random.choice(NOT_UTF8))
        if change == 2:
            return self._at_random(text, self.random.choice(ODD_TEXTS))
        if change == 3:
            return self.mutate(text)
        return self._change_token(text)

    def cut(self, data: bytes, most: int = 5) -> list[bytes]:
        """The same bytes in pieces, as TCP may bring them."""
        places = sorted(self.random.randrange(len(data) + 1) for _ in range(self.random.randrange(most)))
        pieces = [data[a:b] for a, b in zip([0, *places], [*places, len(data)], strict=True)]
        return [piece for piece in pieces if piece]

    # blindly

    def _flip(self, message: bytes, others: Sequence[bytes]) -> bytes:
        changed = bytearray(message)
        for _ in range(self.random.randint(1, 4) if changed else 0):
            changed[self.random.randrange(len(changed))] ^= 1 << self.random.randrange(8)
        return bytes(changed)

    def _put_bytes(self, message: bytes, others: Sequence[bytes]) -> bytes:
        changed = bytearray(message)
        for _ in range(self.random.randint(1, 4) if changed else 0):
            changed[self.random.randrange(len(changed))] = self.random.choice((0, 1, 0x7F, 0x80, 0xFE, 0xFF))
        return bytes(changed)

    def _truncate(self, message: bytes, others: Sequence[bytes]) -> bytes:
        return message[: self.random.randrange(len(message) + 1)]

    def _lengthen(self, message: bytes, others: Sequence[bytes]) -> bytes:
        size = self.random.choice((1, 2, 3, 7, 64, 300, 5000))
        return message + self.random.choice((bytes(size), b"\xff" * size, self.random.randbytes(size)))

    def _delete(self, message: bytes, others: Sequence[bytes]) -> bytes:
        begin, end = self._piece(message)
        return message[:begin] + message[end:]

    def _repeat(self, message: bytes, others: Sequence[bytes]) -> bytes:
        begin, end = self._piece(message)
        return message[:end] + message[begin:end] * self.random.choice((1, 1, 2, 10, 100)) + message[end:]

    def _swap(self, message: bytes, others: Sequence[bytes]) -> bytes:
        """Two pieces change places."""
        a, b, c, d = sorted(self.random.randrange(len(message) + 1) for _ in range(4))
        return message[:a] + message[c:d] + message[b:c] + message[a:b] + message[d:]

    def _splice(self, message: bytes, others: Sequence[bytes]) -> bytes:
        """The beginning of this and the end of another one."""
        other = self.random.choice(others)
        here, there = self.random.randrange(len(message) + 1), self.random.randrange(len(other) + 1)
        return message[:here] + other[there:]

    def _piece(self, message: bytes) -> tuple[int, int]:
        begin = self.random.randrange(len(message) + 1)
        return begin, min(len(message), begin + self.random.choice((1, 2, 4, 8, 16, 64)))

    # numbers

    def _number_at(self, message: bytes) -> tuple[int, int] | None:
        """Place and width of something that may be a number."""
        width = self.random.choice((1, 2, 2, 4, 4, 8))
        if len(message) < width:
            return None
        return self.random.randrange(len(message) - width + 1), width

    def _put(self, message: bytes, place: int, width: int, value: int) -> bytes:
        raw = (value % (1 << 8 * width)).to_bytes(width, self._order)
        return message[:place] + raw + message[place + width :]

    def _put_number(self, message: bytes, others: Sequence[bytes]) -> bytes:
        found = self._number_at(message)
        if found is None:
            return message
        choice = (*NUMBERS, *NUMBERS_64, len(message), len(message) - found[0] - found[1])
        return self._put(message, *found, self.random.choice(choice))

    def _add_to_number(self, message: bytes, others: Sequence[bytes]) -> bytes:
        found = self._number_at(message)
        if found is None:
            return message
        place, width = found
        value = int.from_bytes(message[place : place + width], self._order)
        return self._put(message, place, width, value + self.random.choice((-8, -2, -1, 1, 2, 8, 256)))

    def _put_float(self, message: bytes, others: Sequence[bytes]) -> bytes:
        if len(message) < 8:
            return message
        place = self.random.randrange(len(message) - 7)
        return message[:place] + self.random.choice(FLOATS) + message[place + 8 :]

    # texts behind their length

    def texts_in(self, message: bytes) -> list[tuple[int, int]]:
        """Places of printable texts behind a length that fits: begin and end of each text."""
        found: list[tuple[int, int]] = []
        for place in range(min(len(message) - 4, _LOOKED_AT)):
            size = int.from_bytes(message[place : place + 4], self._order)
            end = place + 4 + size
            if 0 < size <= 1000 and end <= len(message) and message[place + 4 : end].isascii():
                text = message[place + 4 : end].decode("ascii")
                if text.isprintable():
                    found.append((place + 4, end))
        return found

    def _change_text(self, message: bytes, others: Sequence[bytes]) -> bytes:
        """Another text with its right length: only what is done with it can go wrong."""
        texts = self.texts_in(message)
        if not texts:
            return message
        begin, end = self.random.choice(texts)
        old = message[begin:end]
        new = self.random.choice(
            (
                self._at_random(old, self.random.choice(NOT_UTF8)),
                self.random.choice(NOT_UTF8),
                self.random.choice(ODD_TEXTS),
                self._some_text(others),
            )
        )
        return message[: begin - 4] + len(new).to_bytes(4, self._order) + new + message[end:]

    def _change_length(self, message: bytes, others: Sequence[bytes]) -> bytes:
        texts = self.texts_in(message)
        if not texts:
            return message
        begin, end = self.random.choice(texts)
        size = self.random.choice((0, -1, -2, end - begin - 1, end - begin + 1, 0x7FFFFFFF, 0xFFFF, 10**8))
        return self._put(message, begin - 4, 4, size)

    def _some_text(self, others: Sequence[bytes]) -> bytes:
        other = self.random.choice(others)
        texts = self.texts_in(other)
        if not texts:
            return b""
        begin, end = self.random.choice(texts)
        return other[begin:end]

    # texts in words

    def _change_token(self, text: bytes) -> bytes:
        """One word of JSON becomes another, is left out or comes twice."""
        tokens = list(_TOKEN.finditer(text))
        if not tokens:
            return self.mutate(text)
        token = self.random.choice(tokens)
        new = self.random.choice((*ODD_JSON, b"", token[0] * 2, self.random.choice(tokens)[0]))
        return text[: token.start()] + new + text[token.end() :]

    def _at_random(self, text: bytes, what: bytes) -> bytes:
        place = self.random.randrange(len(text) + 1)
        return text[:place] + what + text[place:]
