"""The core by name: which modules are of it, their classes, functions and code."""

from __future__ import annotations

import functools
import importlib
import importlib.util
import inspect
import types
from collections.abc import Iterator
from importlib.abc import InspectLoader
from typing import Any, Final

_CORE: Final = (
    "bridge.base.",
    "bridge.can.",
    "bridge.canopen.",
    "bridge.catalogue.",
    "bridge.command.",
    "bridge.config.",
    "bridge.drive.",
    "bridge.eds.",
    "bridge.image.",
    "bridge.mapping.",
    "bridge.master.",
    "bridge.node.",
    "bridge.parameter.",
    "bridge.text.",
)
_SHELLS: Final = frozenset(
    (
        "bridge.base.clock",
        "bridge.base.line_file",
        "bridge.base.memory_lock",
        "bridge.base.notify",
        "bridge.base.quietlog",
        "bridge.config.site_file",
        "bridge.eds.device_file",
        "bridge.eds.site_configurations",
        "bridge.mapping.loader",
        "bridge.mapping.merge",
        "bridge.mapping.site_families",
        "bridge.master.standstill",
        "bridge.master.timer",
        "bridge.parameter.backup_file",
        "bridge.parameter.factory",
        "bridge.parameter.ledger_file",
        "bridge.parameter.set_file",
        "bridge.text.templates",
    )
)
"""Modules in those folders that open, wait or look at a clock."""
_CORE_OF_CAN: Final = ("bridge.can.burstend", "bridge.can.errorframe", "bridge.can.interface")


class Unusable(Exception):
    """A checkpoint that cannot be made, or holds what none may."""


def is_core(module: str) -> bool:
    """True if objects of this module are of the core."""
    if module.startswith("bridge.can."):
        return module in _CORE_OF_CAN
    return module.startswith(_CORE) and module not in _SHELLS


def class_of(module: str, name: str) -> Any:
    """A class of the core."""
    if is_core(module):
        found: Any = importlib.import_module(module)
        for part in name.split("."):
            found = getattr(found, part, None)
        if isinstance(found, type) and found.__module__ == module:
            return found
    raise Unusable(f"{module}.{name} is no class of the core")


def function_of(module: str, name: str) -> Any:
    """The function of a module of the core, or of a class in it."""
    if not is_core(module):
        raise Unusable(f"{module} is not of the core")
    found: Any = importlib.import_module(module)
    for part in name.split("."):
        found = inspect.getattr_static(found, part)
    found = getattr(found, "__func__", found)
    if not isinstance(found, types.FunctionType) or found.__module__ != module:
        raise Unusable(f"{module}.{name} is no function of the core")
    return found


@functools.cache
def codes_of(module: str) -> dict[str, list[types.CodeType]]:
    """All code of a module by its qualified name, in the order of its lines."""
    spec = importlib.util.find_spec(module)
    loader = spec.loader if spec else None
    assert isinstance(loader, InspectLoader)
    found: dict[str, list[types.CodeType]] = {}
    for code in _nested(loader.get_code(module)):
        found.setdefault(code.co_qualname, []).append(code)
    return found


def _nested(code: types.CodeType | None) -> Iterator[types.CodeType]:
    for one in code.co_consts if code else ():
        if isinstance(one, types.CodeType):
            yield one
            yield from _nested(one)
