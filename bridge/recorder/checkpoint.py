"""Checkpoints: the whole state of the core as bytes, from which a replay begins.

What is outside of the core is left out. A recording may come from anybody, so a checkpoint can hold nothing
but objects of classes of the core, plain containers, and code of the core by its name: the core opens
nothing (``.importlinter``, sans-io), so nothing in a checkpoint can.
"""

from __future__ import annotations

import importlib
import io
import pickle
import pickletools
import types
from collections.abc import Callable
from struct import Struct
from typing import Any, Final, cast

import msgspec

from bridge.can.interface import Bus
from bridge.config import Site
from bridge.master.standstill import WatchdogTimer
from bridge.recorder.core_names import Unusable, class_of, codes_of, function_of, is_core
from bridge.recorder.tape import Tape, TapedBus

_AROUND: Final = (
    "bridge.base.notify",
    "bridge.can.",
    "bridge.condition.",
    "bridge.master.timer",
    "bridge.mirror.",
    "bridge.northbound.",
    "bridge.recorder.",
    "bridge.service.",
    "bridge.sim.",
    "bridge.zenohlink.",
)
"""Rooms of what listens to the core and asks it: they are left out."""
_PLAIN: Final = frozenset(
    (
        ("_struct", "Struct"),
        ("builtins", "range"),
        ("collections", "Counter"),
        ("collections", "defaultdict"),
        ("collections", "deque"),
        ("functools", "partial"),
        ("operator", "getitem"),
        ("re", "_compile"),
        ("types", "MappingProxyType"),
    )
)
"""Names of others that a checkpoint may have: none of them opens, runs or reserves anything."""
_REFUSED: Final = frozenset(
    ("PUT", "BINPUT", "LONG_BINPUT", "GLOBAL", "INST", "OBJ", "EXT1", "EXT2", "EXT4", "PERSID", "NEXT_BUFFER")
)
_OWN: Final = "bridge.recorder.checkpoint"
_METHODS_OF: Final = (Struct, dict, list, set, frozenset)
_LOCALS: Final = "<locals>"
_LAMBDA: Final = "<lambda>"


class DialogueIsOn(Unusable):
    """A node is being asked step by step at the moment: how far that is can be put into no checkpoint."""


class Outside:
    """Anything outside of the core, in a replay: it takes every call, and does nothing."""

    def __call__(self, *args: object, **options: object) -> None:
        return None


def save(root: object) -> bytes:
    """The state of everything that ``root`` leads to. Raises ``Unusable`` where that cannot be.

    Objects with an identity of their own are numbered, and their states follow one another: whatever leads
    to one has its number, so that they may lead to each other in any way.
    """
    states = io.BytesIO()
    pickler = _Pickler(states, pickle.HIGHEST_PROTOCOL)
    try:
        pickler.dump(root)
        # Each state may bring more of them.
        for obj in pickler.objects:
            pickler.dump(obj.__reduce_ex__(2)[2:])
    except (pickle.PicklingError, TypeError, AttributeError, RecursionError, ValueError) as error:
        raise Unusable(str(error)) from None
    classes = [(type(obj).__module__, type(obj).__qualname__) for obj in pickler.objects]
    return msgspec.msgpack.encode((classes, states.getvalue()))


def load(data: bytes, tape: Tape, bus_of: Callable[[str], Bus], alarm: WatchdogTimer) -> Any:
    """The root that was saved, with this tape, these buses by name and this alarm around it. Raises
    ``Unusable`` for what is no checkpoint of this program."""
    try:
        classes, states = msgspec.msgpack.decode(data, type=tuple[list[tuple[str, str]], bytes])
        _check_codes(states)
        objects = [_empty(module, name) for module, name in classes]
        unpickler = _Unpickler(io.BytesIO(states), tape, bus_of, alarm, objects)
        root = unpickler.load()
        for obj in objects:
            _fill(obj, *unpickler.load())
    except Exception as error:  # noqa: BLE001 - a damaged one may fail in any way
        raise Unusable(f"{type(error).__name__}: {error}") from None
    return root


def _check_codes(states: bytes) -> None:
    """Raise ``Unusable`` for operation codes that ``save`` does not write: a number in one of them is enough
    to reserve any amount of memory."""
    file = io.BytesIO(states)
    while file.tell() < len(states):
        for code, _, _ in pickletools.genops(file):
            if code.name in _REFUSED:
                raise Unusable(f"{code.name} is nothing that a checkpoint has")


def _empty(module: str, name: str) -> Any:
    """An object of a class of the core, without its state."""
    kind = class_of(module, name)
    return kind.__new__(kind)


def _fill(obj: Any, state: Any = None, items: Any = None, entries: Any = None) -> None:
    """Give an object its state, as pickle does."""
    if items is not None or entries is not None:
        raise Unusable(f"{type(obj).__qualname__} is a container")
    if state is None:
        return
    if setter := getattr(obj, "__setstate__", None):
        setter(state)
        return
    fields, slots = cast("tuple[Any, Any]", state if isinstance(state, tuple) else (state, None))
    named: dict[str, Any] = {**(fields or {}), **(slots or {})}
    for name, value in named.items():
        object.__setattr__(obj, name, value)


def _has_identity(obj: object) -> bool:
    """True for an object that is itself and not a value: only then it can be numbered."""
    if not is_core(type(obj).__module__) or type(obj).__hash__ not in (object.__hash__, None):
        return False
    return not isinstance(obj, type | tuple | list | dict | set | BaseException)


class _Pickler(pickle.Pickler):
    def __init__(self, file: io.BytesIO, protocol: int) -> None:
        super().__init__(file, protocol)
        self.objects: list[Any] = []
        self._numbers: dict[int, int] = {}

    def persistent_id(self, obj: Any) -> object:
        match obj:
            case Tape():
                return ("tape",)
            case TapedBus():
                return ("bus", obj.name)
            case WatchdogTimer():
                return ("alarm",)
            case types.FunctionType() if not _is_restorer(obj):
                if not is_core(obj.__module__):
                    return ("outside",)
                name = obj.__qualname__
                is_nested = _LOCALS in name or _LAMBDA in name
                return None if is_nested else ("function", obj.__module__, name)
            case types.FunctionType():
                return None
            case types.BuiltinFunctionType() if isinstance(obj.__self__, types.ModuleType | None):
                return None if (obj.__module__, obj.__name__) in _PLAIN else ("outside",)
            case types.GeneratorType():
                if obj.gi_frame is not None:
                    raise DialogueIsOn(obj.__qualname__)
                return ("outside",)
            case _ if _has_identity(obj):
                number = self._numbers.setdefault(id(obj), len(self.objects))
                if number == len(self.objects):
                    self.objects.append(obj)
                return ("object", number)
            case _:
                return None if _is_kept(obj) else ("outside",)

    def reducer_override(self, obj: Any) -> Any:
        match obj:
            case Site():
                # The rest has ways to passwords, and is not for the core.
                bare = obj.model_copy(update=dict.fromkeys(("modbus", "opcua", "zenoh", "page")))
                return obj.__reduce_ex__(2) if _is_bare(obj) else (_same, (bare,))
            case types.FunctionType() if not _is_restorer(obj):
                return _closure, (*_place_of(obj), *_around(obj))
            case types.MethodType():
                return _method, (obj.__self__, obj.__func__.__name__)
            case types.BuiltinMethodType() if not isinstance(obj.__self__, types.ModuleType | None):
                return _method, (obj.__self__, obj.__name__)
            case types.MappingProxyType():
                return types.MappingProxyType, (dict(cast("Any", obj)),)
            case Struct():
                return Struct, (obj.format,)
            case _:
                return NotImplemented


def _is_restorer(function: types.FunctionType) -> bool:
    name = function.__module__, function.__name__
    return name in _PLAIN or function in _RESTORERS.values()


def _is_bare(site: Site) -> bool:
    return not (site.modbus or site.opcua or site.zenoh or site.page)


def _is_kept(obj: object) -> bool:
    """True for what a checkpoint has: the rest is around the core. Raises ``Unusable`` for one of
    which nobody knows."""
    kind = obj if isinstance(obj, type) else type(obj)
    if kind.__module__ == "builtins":
        return not isinstance(obj, types.ModuleType | types.CoroutineType)
    if (kind.__module__, kind.__name__) in _PLAIN or is_core(kind.__module__) or kind.__module__ == "re":
        return True
    if kind.__module__.startswith("bridge.") and not kind.__module__.startswith(_AROUND):
        raise Unusable(f"{kind.__module__}.{kind.__qualname__} is neither of the core nor around it")
    return False


class _Unpickler(pickle.Unpickler):
    def __init__(
        self,
        file: io.BytesIO,
        tape: Tape,
        bus_of: Callable[[str], Bus],
        alarm: WatchdogTimer,
        objects: list[Any],
    ) -> None:
        super().__init__(file)
        self._tape, self._bus_of, self._alarm, self._objects = tape, bus_of, alarm, objects

    def persistent_load(self, pid: Any) -> object:
        match pid:
            case ("tape",):
                return self._tape
            case ("bus", str() as name):
                return self._bus_of(name)
            case ("alarm",):
                return self._alarm
            case ("outside",):
                return Outside()
            case ("object", int() as number):
                return self._objects[number]
            case ("function", str() as module, str() as name):
                return function_of(module, name)
            case _:
                raise Unusable(f"an unknown reference {pid!r}")

    def find_class(self, module_name: str, global_name: str, /) -> Any:
        if (module_name, global_name) in _PLAIN:
            return super().find_class(module_name, global_name)
        if module_name == _OWN and global_name in _RESTORERS:
            return _RESTORERS[global_name]
        if is_core(module_name):
            return class_of(module_name, global_name)
        if (module_name, global_name) == ("bridge.recorder.tape", "NumberedReply"):
            return super().find_class(module_name, global_name)
        raise Unusable(f"{module_name}.{global_name} is nothing that a checkpoint may have")


# code by its name


def _method(owner: Any, name: str) -> object:
    """The method of an object of the core, or one of a plain container."""
    kind: type[Any] = owner if isinstance(owner, type) else type(owner)
    if not (is_core(kind.__module__) or isinstance(owner, (*_METHODS_OF, Tape, Outside))):
        raise Unusable(f"{kind.__qualname__} is not of the core")
    return owner if isinstance(owner, Outside) else getattr(cast("object", owner), name)


def _place_of(function: types.FunctionType) -> tuple[str, str, int]:
    """Module, qualified name and number of a nested function's or a lambda's code: the number counts those of
    the same name in the module."""
    code = function.__code__
    same = codes_of(function.__module__)[code.co_qualname]
    return function.__module__, code.co_qualname, same.index(code)


def _around(function: types.FunctionType) -> tuple[Any, Any, Any]:
    """Belongings of a nested function beside its code: closure, defaults, defaults by keyword."""
    cells = tuple(cell.cell_contents for cell in function.__closure__ or ())
    return cells, function.__defaults__, function.__kwdefaults__


def _closure(module: str, name: str, number: int, cells: Any, defaults: Any, by_keyword: Any) -> Any:
    if not is_core(module):
        raise Unusable(f"{module} is not of the core")
    code = codes_of(module)[name][number]
    made = types.FunctionType(
        code,
        vars(importlib.import_module(module)),
        code.co_name,
        defaults,
        tuple(types.CellType(one) for one in cells),
    )
    made.__kwdefaults__ = by_keyword
    made.__qualname__ = code.co_qualname
    return made


def _same(one: object) -> object:
    return one


_RESTORERS: Final[dict[str, Callable[..., Any]]] = {"_closure": _closure, "_method": _method, "_same": _same}
