"""open62541's client, as PyPI's o6 has it, as its scenario uses it.

Whatever is refused is the name of its code. Texts are pairs of language and text.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import o6
from asyncua.ua.status_codes import get_name_and_doc
from o6.ns import ns0

from tests.support.certificates import CLIENT_URI
from tests.support.scenario_plant import PASSWORD
from tests.wire.scenarios.steps import Steps

POINTS = "urn:drivebridge:points"
POLICY = "http://opcfoundation.org/UA/SecurityPolicy#Aes128_Sha256_RsaOaep"
Types = ns0.datatypes
_SILENT = logging.getLogger("o6 of the scenario")
_SILENT.setLevel(logging.CRITICAL + 1)


def code_of(status: int) -> str:
    return get_name_and_doc(int(status))[0]


def outcome(work: Callable[[], object]) -> str:
    """Good, or the code with which it is refused."""
    try:
        work()
    except o6.StatusCodeError as error:
        return code_of(error.code)
    return "Good"


def plain(value: Any) -> Any:
    """A value without the types of o6."""
    if isinstance(value, o6.LocalizedText):
        return str(value.locale), str(value.text)
    if isinstance(value, list | np.ndarray):
        return [plain(one) for one in value]
    if isinstance(value, np.generic):
        return value.item()
    for kind in (bool, int, float, str, bytes):
        if isinstance(value, kind):
            return kind(value)
    return bool(value) if isinstance(value, o6.Boolean) else value


def prepared(steps: Steps, certificate: str = "trusted", locale: str = "en") -> o6.Client:
    shown = steps.folder / "shown"
    own = steps.folder / "state" / "certificates" / "own" / "own_certificate.der"
    client = o6.Client(
        steps.url,
        certificate=str(shown / f"{certificate}.der"),
        privateKey=str(shown / f"{certificate}.pem"),
        trustList=[str(own)],
        securityMode=3,
        securityPolicy=POLICY,
        applicationUri=CLIENT_URI,
        logger=_SILENT,
    )
    client.config.sessionLocaleIds = [locale]
    return client


@contextmanager
def logged_in(
    steps: Steps, user: str, *, password: str = PASSWORD, certificate: str = "trusted", locale: str = "en"
) -> Iterator[Session]:
    """A session of ``user``, or of nobody."""
    client = prepared(steps, certificate, locale)
    if user:
        client.config.setUsernamePassword(user, password)
    client.connect(createDefaultSubscription=False)
    try:
        yield Session(client)
    finally:
        client.disconnect()


class Session:
    """A client's requests by the names of points, with their codes."""

    def __init__(self, client: o6.Client) -> None:
        self.client = client
        self.spaces = [str(one) for one in client.read("i=2255")]
        self.space = self.spaces.index(POINTS)

    def id(self, name: str | o6.NodeId) -> str | o6.NodeId:
        return (
            name
            if not isinstance(name, str) or name.startswith(("i=", "ns="))
            else f"ns={self.space};s={name}"
        )

    def value(self, name: str, attribute: o6.AttributeId = o6.AttributeId.VALUE) -> Any:
        """The value, or the code that it has instead."""
        try:
            return plain(self.client.read(self.id(name), attr=attribute))
        except o6.StatusCodeError as error:
            return code_of(error.code)

    def write(self, name: str, value: object) -> str:
        return code_of(self.client.write(self.id(name), value))

    def call(self, where: str, method: str, *given: object) -> list[Any]:
        """Code and what the method gives; ``method`` is a name in ``where``, or a NodeId of namespace 0."""
        named = method if method.startswith("i=") else self.id(f"{where}/{method}")
        code, *outputs = self.client.call(self.id(where), named, list(given))
        return [code_of(code), *map(plain, outputs)]

    def until(self, name: str, fits: Callable[[Any], bool], seconds: float = 10) -> Any:
        """The value once it fits; else the last one."""
        end = time.monotonic() + seconds
        while not fits(value := self.value(name)) and time.monotonic() < end:
            time.sleep(0.05)
        return value

    def targets(self, start: str, *names: str) -> list[o6.NodeId]:
        """NodeIds at the end of a path of ``namespace:name``."""
        found = self.client.browseSimplifiedBrowsePaths(self.id(start), list(names))
        return [one.targetId for one in found.targets]


class Waiting:
    """What has been told by a subscription, in its order."""

    def __init__(self) -> None:
        self.told: list[Any] = []

    def __call__(self, value: Any) -> None:
        self.told.append(value)

    def until(self, fits: Callable[[Any], bool], seconds: float = 10) -> Any:
        """The first that fits, also of those that have come."""
        end = time.monotonic() + seconds
        while True:
            for one in list(self.told):
                if fits(one):
                    return one
            assert time.monotonic() < end, f"not told within {seconds} s: {self.told[-3:]}"
            time.sleep(0.02)
