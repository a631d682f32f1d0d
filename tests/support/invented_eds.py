"""The EDS of a drive that does not exist, and a bench on which it is driven by a mapping made of it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from bridge.config import load_site
from bridge.derive import Derived, derive_family
from bridge.eds import Description, read_device
from bridge.mapping import Family
from bridge.mapping.loader import read_family
from bridge.sim.generic.generic_eds import plan_of_description
from bridge.sim.generic.generic_node import GenericNode
from tests.support import sites
from tests.support.bench import Bench

NODE_ID = 5
Section = dict[str, str]

U8, U16, U32, I8, I16, I32, STRING, REAL32 = "0x5", "0x6", "0x7", "0x2", "0x3", "0x4", "0x9", "0x8"


def var(name: str, kind: str, access: str = "rw", default: str = "", **more: str) -> Section:
    return {
        "ParameterName": name,
        "ObjectType": "0x7",
        "DataType": kind,
        "AccessType": access,
        **({"DefaultValue": default} if default else {}),
        **more,
    }


def mapped(name: str, kind: str, access: str = "rw", default: str = "") -> Section:
    return var(name, kind, access, default, PDOMapping="1")


def record(number: str, name: str, *subs: Section) -> dict[str, Section]:
    """``subs`` from sub-index 1 on."""
    count = var("count", U8, "rw" if number.startswith(("16", "1A")) else "ro", str(len(subs)))
    root = {"ParameterName": name, "ObjectType": "0x9", "SubNumber": str(len(subs) + 1)}
    return {
        number: root,
        f"{number}sub0": count,
        **{f"{number}sub{sub:X}": one for sub, one in enumerate(subs, 1)},
    }


def pdo(number: str, cob_id: str, *words: str, access: str = "rw") -> dict[str, Section]:
    """``number`` is that of the communication object, such as 1400."""
    mapping = f"{int(number, 16) + 0x200:04X}"
    communication = record(
        number, "communication", var("COB-ID", U32, access, cob_id), var("type", U8, "rw", "255")
    )
    carried = record(mapping, "mapping", *(var("object", U32, access, word) for word in words))
    carried[f"{mapping}sub0"]["AccessType"] = access
    return {**communication, **carried}


def identity(vendor: str = "0xACE", product: str = "0x3000", revision: str = "0x10002") -> dict[str, Section]:
    numbers = (vendor, product, revision, "")
    return record("1018", "identity", *(var("number", U32, "ro", number) for number in numbers))


BASIC: Mapping[str, Section] = {
    "1000": var("device type", U32, "ro", "0x10192"),
    "1001": var("error register", U8, "ro"),
    "1017": var("heartbeat", U16, "rw", "0"),
    **identity(),
}
SPIN: Mapping[str, Section] = {
    **BASIC,
    **pdo("1400", "$NODEID+0x200", "0x60400010", "0x60420010", "0"),
    **pdo("1800", "$NODEID+0x180", "0x60410010", "0x60440010", "0"),
    "2001": var("Überlast", U16, "rw", "40", LowLimit="10", HighLimit="100"),
    **record("2002", "gains", var("P", REAL32, "rw", "1.5"), var("offset", I16, "rw", "-3")),
    "2003": var("tag", STRING, "ro", "spin"),
    "2004": var("temperature", I16, "ro"),
    "603F": mapped("error code", U16, "ro"),
    "6007": var("abort option", I16, "rw", "1"),
    "6040": mapped("control word", U16),
    "6041": mapped("status word", U16, "ro"),
    "6042": mapped("target velocity", I16),
    "6044": mapped("actual velocity", I16, "ro"),
    "6060": mapped("mode", I8),
    "6061": mapped("mode display", I8, "ro"),
}


FIXED: Mapping[str, Section] = {
    **SPIN,
    **pdo("1400", "$NODEID+0x200", "0x60400010", access="const"),
    **pdo("1402", "$NODEID+0x80000400", "0x60400010", "0x20050008", "0x20060008", access="const"),
    **pdo("1403", "$NODEID+0x510", "0x60400010", "0x60FF0020", "0x20070010", access="ro"),
    **pdo("1801", "$NODEID+0x290", "0x60410010", "0x606C0020", "0x60610008", access="ro"),
    "2005": mapped("left", U8, default="1"),
    "2006": mapped("right", U8, default="2"),
    "2007": mapped("ramp", U16, default="500"),
    "60FF": mapped("target", I32),
    "606C": mapped("actual", I32, "ro"),
    "6502": var("modes", U32, "ro", "4"),
}
"""Profile velocity in PDOs that cannot be changed."""


def eds(sections: Mapping[str, Section] = SPIN) -> bytes:
    """An EDS with these sections."""
    info = {"VendorName": "Acme GmbH", "ProductName": "Spin 3000"}
    objects = [name for name in sections if "sub" not in name]
    listed = {"SupportedObjects": str(len(objects))}
    listed |= {str(place): f"0x{name}" for place, name in enumerate(objects, 1)}
    lines: list[str] = []
    for name, keys in {"DeviceInfo": info, "OptionalObjects": listed, **sections}.items():
        lines += [f"[{name}]", *(f"{key}={value}" for key, value in keys.items()), ""]
    return "\n".join(lines).encode()


def described(sections: Mapping[str, Section] = SPIN) -> Description:
    return read_device(eds(sections), "spin.eds")


def family_of(folder: Path, derived: Derived) -> Family:
    path = folder / "mappings" / f"{derived.name}.toml"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(derived.text, encoding="utf-8")
    return read_family(path)


class DerivedBench(Bench):
    """The node that a description describes, and a bridge that knows it by the mapping made of it only."""

    def __init__(
        self,
        folder: Path,
        description: Description,
        mode: str | None = None,
        source: str = "spin.eds",
        timeout_ms: int = 0,
    ) -> None:
        derived = derive_family(description, source, mode)
        family = family_of(folder, derived)
        self.generic = GenericNode(NODE_ID, plan_of_description(description, NODE_ID))
        drives = [sites.drive(slot.name, "modbus", timeout_ms, "") for slot in family.slot]
        by = "heartbeat" if description.entry(0x1017) else "guarding" if description.entry(0x100C) else "none"
        node = sites.node(*drives, mapping=derived.name, node_id=NODE_ID, more=f'supervision = "{by}"')
        site = load_site(sites.write(folder, sites.bus(node), sites.modbus(), name="bench"))
        super().__init__(site, family=family, mapping=derived.name, node=self.generic)
        self.run(1.5)


def axis_objects(axis: int) -> dict[str, Section]:
    """The objects of the profile that ``SPIN`` has, as those of one axis."""
    first = {name: one for name, one in SPIN.items() if name.startswith("60")}
    return {f"{int(name, 16) + 0x800 * (axis - 1):04X}": one for name, one in first.items()}


def axis_pdos(axis: int, number: int, cob_ids: tuple[str, str], access: str = "rw") -> dict[str, Section]:
    """RPDO and TPDO ``number`` (from 0) with an axis's words."""
    command, target, status, actual, mode = (
        f"0x{index + 0x800 * (axis - 1):04X}00{bits}"
        for index, bits in ((0x6040, 10), (0x6042, 10), (0x6041, 10), (0x6044, 10), (0x6061, "08"))
    )
    return {
        **pdo(f"{0x1400 + number:04X}", cob_ids[0], command, target, access=access),
        **pdo(f"{0x1800 + number:04X}", cob_ids[1], status, actual, mode, access=access),
    }
