"""The protocols that are thrown at: each makes cases from its corpus, and throws them."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from random import Random
from typing import Final, Protocol, cast

from tests.fuzz.case import Case
from tests.fuzz.rig import Rig


class Target(Protocol):
    """One protocol."""

    def case(self) -> Case:
        """The next case; it depends on the seed alone, not on answers."""
        ...

    def throw(self, case: Case) -> None:
        """Throw it, and wait a little for what comes back. Whatever the bridge does to the connection is no
        failure: the judge says what is."""
        ...

    def close(self) -> None: ...


PROTOCOLS: Final = ("opcua", "modbus", "zenoh", "can")


def make_target(protocol: str, rig: Rig, random: Random) -> Target:
    """Its module is ``tests/fuzz/targets/<protocol>_target.py``, its class ``Thrower``."""
    module = import_module(f"tests.fuzz.targets.{protocol}_target")
    make = cast(Callable[[Rig, Random], Target], module.Thrower)
    return make(rig, random)
