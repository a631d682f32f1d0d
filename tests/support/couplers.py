"""The EDS of a modular coupler that does not exist, in the forms that such files have (CiA 306)."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from tests.support import sites
from tests.support.invented_eds import U8, U32, Section, eds, identity, pdo, record, var

HEAD: Final[Mapping[str, Section]] = {
    "1000": var("device type", U32, "ro", "0xF0191"),
    "1001": var("error register", U8, "ro"),
    "1017": var("heartbeat", "0x6", "rw", "0"),
    **identity(product="0x8"),
}
PDOS: Final[Mapping[str, Section]] = {
    **pdo("1400", "$NODEID+0x200", "0x62000108"),
    **pdo("1800", "$NODEID+0x180", "0x60000108", "0x60000208"),
}
"""The default mapping of CiA 401, as far as modules bring its objects."""
ONBOARD: Final = record("6000", "Digital inputs", var("Digital inputs 1", U8, "ro", PDOMapping="1"))
"""Eight inputs of the coupler's own."""
EMPTY: Final = {
    "6000": {"ParameterName": "Digital inputs", "ObjectType": "0x8", "SubNumber": "1"},
    "6000sub0": var("count", U8, "ro", "0"),
}
"""An array that waits for its elements."""
INPUTS, OUTPUTS = "Digital inputs", "Digital outputs"


def module(number: int, product: str, order_code: str, *parts: str) -> str:
    """``parts`` are its ``extension`` and ``fixed`` objects."""
    info = f"[M{number}ModuleInfo]\nProductName={product}\nProductVersion=1\nOrderCode={order_code}\n"
    lists: list[str] = []
    for name, kind in (("SubExtends", "SubExt"), ("FixedObjects", "Fixed")):
        indices = re.findall(rf"\[M\?{kind}([0-9A-F]{{4}})\]", "".join(parts))
        listed = "".join(f"{place}=0x{index}\n" for place, index in enumerate(indices, 1))
        lists.append(f"[M{number}{name}]\nNrOfEntries={len(indices)}\n{listed}")
    return "\n".join((info, *lists, *(part.replace("[M?", f"[M{number}") for part in parts)))


def extension(index: str, name: str, count: str, kind: str = U8, access: str = "ro", more: str = "") -> str:
    is_mapped = int(index not in ("6206", "6207"))
    return (
        f"[M?SubExt{index}]\nParameterName={name}\n"
        f"DataType={kind}\nAccessType={access}\nPDOMapping={is_mapped}\nCount={count}\n{more}\n"
    )


def fixed(index: str, name: str) -> str:
    return (
        f"[M?Fixed{index}]\nParameterName={name}\n"
        f"ObjectType=0x7\nDataType=0x1\nAccessType=rw\nDefaultValue=0\nPDOMapping=0\n"
    )


MODULES: Final = (
    module(1, "8 digital inputs", "AC-DI8", extension("6000", INPUTS, "1")),
    module(2, "4 digital inputs", "AC-DI4", extension("6000", INPUTS, "0;4")),
    module(
        3,
        "8 digital outputs",
        "AC-DO8",
        extension("6200", OUTPUTS, "1", access="rww"),
        extension("6206", "Error mode", "1", access="rw"),
        extension("6207", "Error value", "1", access="rw"),
    ),
    module(
        4,
        "2 analogue inputs",
        "AC-AI2",
        fixed("6423", "Analogue inputs interrupt enable"),
        extension("6401", "Analogue inputs", "2", kind="0x3"),
    ),
)
SUPPORTED: Final = f"[SupportedModules]\nNrOfEntries={len(MODULES)}\n"


def coupler(
    objects: Mapping[str, Section] | None = None, *, modules: tuple[str, ...] = MODULES, more: str = ""
) -> bytes:
    """The file; ``objects`` are the coupler's own beside those of ``HEAD`` and ``PDOS``."""
    own = eds({**HEAD, **PDOS, **(objects or {})}).decode()
    own = own.replace("Acme GmbH", "Acme").replace("Spin 3000", "Node 8")
    return "\n".join((own, SUPPORTED, *modules, more)).encode()


def connected(*numbers: int) -> str:
    """Modules as a DCF has them."""
    listed = "".join(f"{place}={number}\n" for place, number in enumerate(numbers, 1))
    return f"[ConnectedModules]\nNrOfEntries={len(numbers)}\n{listed}"


OWNED = '\n[bus.node.outputs]\ncontrol = "modbus"\nfieldbus_timeout_ms = 200\n'


def written(folder: Path, *modules: str, name: str = "site", outputs: str = OWNED) -> Path:
    """A site file with the coupler as node 21, and these modules in it."""
    (folder / "coupler.eds").write_bytes(coupler())
    listed = ", ".join(f'"{one}"' for one in modules)
    node = sites.node(
        name="io", node_id=21, mapping="eds:coupler.eds", more=f"modules = [{listed}]\n{outputs}"
    )
    path = sites.write(folder, sites.bus(node), sites.modbus(0))
    return path.rename(folder / f"{name}.toml")
