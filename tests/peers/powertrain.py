"""Starts, runs and stops every drive, knowing nothing but the types of OPC 40400-1 and DI: powertrain.py PORT

For each drive one line of JSON: its type, nameplate and health, and its main actual value while it ran, with
its unit. It ends with 1 where a drive does not run, or does not stand again.
"""

import asyncio
import json
import sys
import time
from collections.abc import Awaitable, Callable

from asyncua import Client, Node, ua

POWERTRAIN = "http://opcfoundation.org/UA/Powertrain/"
DI = "http://opcfoundation.org/UA/DI/"
DRIVE_TYPE, DEVICE_SET = 1035, 5001
WANTED = {"Hz": 20.0, "1/min": 400.0}
"""Speed that is asked for, by the unit of the setpoint."""
LIMIT_S = 12.0


async def subtypes(kind: Node) -> list[Node]:
    found = [kind]
    for below in await kind.get_children(refs=ua.ObjectIds.HasSubtype):
        found += await subtypes(below)
    return found


async def named(parent: Node) -> dict[str, Node]:
    """What is below a node by its name, in whatever namespace."""
    return {(await below.read_browse_name()).Name: below for below in await parent.get_children()}


async def until(is_so: Callable[[], Awaitable[bool]], what: str) -> None:
    end = time.monotonic() + LIMIT_S
    while not await is_so():
        if time.monotonic() > end:
            raise SystemExit(f"not within {LIMIT_S:g} s: {what}")
        await asyncio.sleep(0.05)


async def exercise(asset: Node) -> dict[str, object]:
    parts = await named(asset)
    methods, operational = parts["MethodSet"], await named(parts["Operational"])
    names = {name: found.nodeid for name, found in (await named(methods)).items()}
    setpoint, actual = operational["MainSetpoint"], operational["MainActualValue"]
    unit = (await (await setpoint.get_child("0:EngineeringUnits")).read_value()).DisplayName.Text
    assert unit == (await (await actual.get_child("0:EngineeringUnits")).read_value()).DisplayName.Text
    wanted = WANTED[unit]
    kind = await setpoint.read_data_type_as_variant_type()
    is_float = kind in (ua.VariantType.Float, ua.VariantType.Double)
    # Whatever was before is over.
    await methods.call_method(names["ResetFault"])
    await methods.call_method(names["Start"], ua.Variant(1, ua.VariantType.Int32))

    async def runs() -> bool:
        # Each write is a sign of life, too: the drive's watchdog wants them.
        await setpoint.write_value(ua.Variant(wanted if is_float else int(wanted), kind))
        return abs(await actual.read_value() - wanted) < 0.05 * wanted

    async def stands() -> bool:
        return abs(await actual.read_value()) < 0.01 * wanted

    await until(runs, f"{asset} runs")
    ran_at = await actual.read_value()
    health = await parts["DeviceHealth"].read_value()
    await methods.call_method(names["Stop"])
    await until(stands, f"{asset} stands")
    identification = await named(parts["Identification"])
    plate = {}
    for name, node in identification.items():
        value = await node.read_data_value(raise_on_bad_status=False)
        text = value.Value.Value
        plate[name] = text.Text if isinstance(text, ua.LocalizedText) else text
    return {
        "drive": (await asset.read_display_name()).Text,
        "unit": unit,
        "wanted": wanted,
        "ran_at": ran_at,
        "health": health,
        "plate": plate,
    }


async def main(port: int) -> None:
    async with Client(f"opc.tcp://127.0.0.1:{port}/", timeout=10) as client:
        powertrain, di = [await client.get_namespace_index(uri) for uri in (POWERTRAIN, DI)]
        types = await subtypes(client.get_node(ua.NodeId(DRIVE_TYPE, powertrain)))
        names = {kind.nodeid: (await kind.read_browse_name()).Name for kind in types}
        for asset in await client.get_node(ua.NodeId(DEVICE_SET, di)).get_children():
            kind = await asset.read_type_definition()
            if kind in names:
                print(json.dumps({"type": names[kind], **await exercise(asset)}), flush=True)


if __name__ == "__main__":
    asyncio.run(main(int(sys.argv[1])))
