"""The scenario of asyncua's client: asyncua_scenario.py LETTER FOLDER URL COMMANDS."""

from __future__ import annotations

import asyncio
import sys
from datetime import UTC, datetime, timedelta
from itertools import dropwhile
from typing import Any

from asyncua import Client, ua
from asyncua.client.ua_file import UaFile

from tests.support.opcua_alarms import Follower, event_and, following, is_active, is_over, of
from tests.wire.scenarios.asyncua_client import (
    Attribute,
    Ids,
    Kind,
    Session,
    by_certificate,
    code_of,
    logged_in,
    outcome,
    string,
)
from tests.wire.scenarios.asyncua_lasting import diagnostics, end_is_announced, read_through, subscriptions
from tests.wire.scenarios.steps import Steps


async def discovery(steps: Steps) -> None:
    client = Client(steps.url, timeout=10)
    (server,) = await client.connect_and_find_servers()
    steps.step("application", server.ApplicationUri, "urn:plant:drivebridge")
    steps.step("kind of application", server.ApplicationType, ua.ApplicationType.Server)
    steps.step("addresses", server.DiscoveryUrls, [steps.url])
    endpoints = await client.connect_and_get_server_endpoints()
    policies = [one.SecurityPolicyUri.partition("#")[2] for one in endpoints]
    steps.step("policies", policies, ["Basic256Sha256", "Aes128_Sha256_RsaOaep", "Aes256_Sha256_RsaPss"])
    modes = {one.SecurityMode for one in endpoints}
    steps.step("modes", modes, {ua.MessageSecurityMode.SignAndEncrypt})
    tokens = {token.TokenType for one in endpoints for token in one.UserIdentityTokens}
    steps.step("identities", tokens, {ua.UserTokenType.UserName, ua.UserTokenType.Certificate})
    steps.step("without a certificate", await outcome(client.connect()), "BadSecurityPolicyRejected")


async def certificates(steps: Steps) -> None:
    async def shown(name: str) -> str:
        async def enter() -> None:
            async with logged_in(steps, "anna", certificate=name):
                pass

        return await outcome(enter())

    hidden = "BadSecurityChecksFailed"
    steps.step("certificate: untrusted", await shown("untrusted"), hidden)
    steps.step("certificate: weak key", await shown("weak key"), hidden)
    steps.step("certificate: no issuer", await shown("no issuer"), hidden)
    steps.step("certificate: expired", await shown("expired"), "BadCertificateTimeInvalid")
    steps.step("certificate: not yet valid", await shown("not yet valid"), "BadCertificateTimeInvalid")
    steps.step("certificate: wrong URI", await shown("wrong uri"), "BadCertificateUriInvalid")
    steps.step("certificate: wrong usage", await shown("wrong usage"), "BadCertificateUseNotAllowed")
    steps.step("certificate: revoked", await shown("revoked"), "BadCertificateRevoked")
    steps.step("certificate: of an authority", await shown("of authority"), "Good")
    steps.step("certificate: trusted", await shown("trusted"), "Good")


async def users(steps: Steps) -> None:
    async def enter(session: Any) -> str:
        async def stay() -> None:
            async with session:
                pass

        return await outcome(stay())

    steps.step("nobody", await enter(logged_in(steps, "")), "BadIdentityTokenRejected")
    wrong = await enter(logged_in(steps, "anna", password="sardine"))
    steps.step("wrong password", wrong, "BadUserAccessDenied")
    steps.step("unknown user", await enter(logged_in(steps, "udo")), "BadUserAccessDenied")
    steps.step("user with a certificate", await enter(by_certificate(steps, "carl")), "Good")
    steps.step(
        "certificate of no user", await enter(by_certificate(steps, "otto")), "BadIdentityTokenRejected"
    )


async def model(steps: Steps, session: Session) -> None:
    """The drive by published types alone, without a name of ours."""
    client = session.client
    spaces = await client.get_namespace_array()
    uris = ("DI", "Machinery", "Powertrain")
    di, _, powertrain = (spaces.index(f"http://opcfoundation.org/UA/{one}/") for one in uris)
    devices = await client.nodes.objects.get_child(f"{di}:DeviceSet")
    assets = {(await one.read_browse_name()).Name: one for one in await devices.get_children()}
    own = [f"{node}/fu{number}" for node in (steps.first, steps.second) for number in (1, 2, 3, 4)]
    steps.step("assets", sorted(name for name in assets if name in own), own)
    asset = assets[own[0]]
    kind = client.get_node(await asset.read_type_definition())
    names = [(await one.read_browse_name()).to_string() for one in (kind, await _supertype(kind))]
    types = ["PtAssetFrequencyConverterType", "PtAssetDriveType"]
    steps.step("type of asset", names, [f"{powertrain}:{one}" for one in types])

    async def read(*path: str) -> Any:
        return await session.value((await asset.get_child(list(path))).nodeid)

    plate = {name: await read(f"{di}:{name}") for name in ("Manufacturer", "Model", "SoftwareRevision")}
    steps.step("manufacturer", plate["Manufacturer"].Text, "Getriebebau NORD")
    steps.step("model", plate["Model"].Text, "SK TU4-CAO")
    steps.step("software", plate["SoftwareRevision"], "1.2 R0")
    steps.step("serial number", await read(f"{di}:SerialNumber"), "BadNotSupported")
    component = await read(f"{di}:Identification", f"{di}:ComponentName")
    steps.step("identification", component.Text, own[0])
    steps.step("health", await read(f"{di}:DeviceHealth"), 0)
    actual = await asset.get_child([f"{di}:Operational", f"{session.space}:MainActualValue"])
    unit = await (await actual.get_child("0:EngineeringUnits")).read_value()
    steps.step("unit", (unit.DisplayName.Text, unit.UnitId), ("Hz", 4740186))
    methods = await (await asset.get_child(f"{di}:MethodSet")).get_children()
    found = [(await one.read_browse_name()).Name for one in methods][:5]
    steps.step("methods", found, ["Start", "Stop", "QuickStop", "DisableVoltage", "ResetFault"])


async def _supertype(kind: Any) -> Any:
    (above,) = await kind.get_referenced_nodes(Ids.HasSubtype, ua.BrowseDirection.Inverse)
    return above


REFUSED = "BadUserAccessDenied"
WITHIN_S = 40.0
"""Where the machine was too slow for a moment, that explains a cut bus for 20 s."""
DONE, ERLEDIGT = ua.LocalizedText("done", "en"), ua.LocalizedText("ausgeführt", "de")


async def roles(steps: Steps) -> None:
    """What each may do, and what only the next one may."""
    drive, first = f"{steps.first}/fu4", f"{steps.first}/fu1"
    parameter = (string("P102"), ua.Variant(2.5, Kind.Double))
    alarm, configuration = f"{drive}/Alarm", ua.NodeId(Ids.ServerConfiguration)
    rejected = Ids.ServerConfiguration_GetRejectedList
    async with logged_in(steps, "otto") as client:
        otto = await Session.of(client)
        steps.step("observer reads", await otto.value(f"{first}/parameter/p105"), 50.0)
        steps.step("observer writes", await otto.write(f"{drive}/command/setpoint_1", 1), REFUSED)
        started = await otto.call(drive, "Start", ua.Variant(1, Kind.Int32))
        steps.step("observer starts", started, [REFUSED])
        steps.step("observer stops", await otto.call(drive, "Stop"), [REFUSED])
        steps.step("observer resets a node", await otto.call(steps.second, "Reset"), [REFUSED])
        shelved = await otto.call(alarm, Ids.AlarmConditionType_ShelvingState_OneShotShelve)
        steps.step("observer shelves", shelved, [REFUSED])
        steps.step(
            "observer reads a parameter",
            await otto.call(first, "ReadParameter", string("P102")),
            ["Good", 2.0],
        )
    async with logged_in(steps, "anna") as client:
        anna = await Session.of(client)
        steps.step("operator writes", await anna.write(f"{drive}/command/setpoint_1", 1), "Good")
        steps.step(
            "operator sets a parameter", await anna.call(first, "WriteParameter", *parameter), [REFUSED]
        )
        steps.step("operator saves", await anna.call(first, "SaveParameters"), [REFUSED])
        steps.step("operator disables an alarm", await anna.call(alarm, Ids.ConditionType_Disable), [REFUSED])
    async with logged_in(steps, "eva") as client:
        eva = await Session.of(client)
        steps.step(
            "engineer sets a parameter", await eva.call(first, "WriteParameter", *parameter), ["Good", DONE]
        )
        steps.step("engineer reads it", await eva.call(first, "ReadParameter", string("P102")), ["Good", 2.5])
        steps.step("engineer disables an alarm", await eva.call(alarm, Ids.ConditionType_Disable), ["Good"])
        steps.step("engineer enables it", await eva.call(alarm, Ids.ConditionType_Enable), ["Good"])
        steps.step("engineer sees who was refused", await eva.call(configuration, rejected), [REFUSED])
    async with logged_in(steps, "ida") as client:
        ida = await Session.of(client)
        code, (*_, newest) = await ida.call(configuration, rejected)
        steps.step("admin sees who was refused", (code, newest[:1]), ("Good", b"\x30"))


async def moving(steps: Steps, anna: Session) -> None:
    drive = f"{steps.first}/fu1"
    state, frequency = f"{drive}/status/state", f"{drive}/actual/frequency"
    steps.step("at first", await anna.value(state), 1)
    empty = UaFile(anna.node(f"{drive}/BlackBox/1"), "r")
    steps.step("no black box as yet", await outcome(empty.open(1)), "BadNotReadable")
    steps.step(
        "out of range", await anna.write(f"{drive}/command/setpoint_1", 70000, Kind.UInt32), "BadOutOfRange"
    )
    steps.step(
        "of a wrong type",
        await anna.write(f"{drive}/command/setpoint_1", "fast", Kind.String),
        "BadTypeMismatch",
    )
    steps.step("what is only read", await anna.write(f"{drive}/status/status_word", 1), "BadNotWritable")
    steps.step("set-point", await anna.write(f"{drive}/command/frequency", 20.0, Kind.Double), "Good")
    steps.step("start", await anna.call(drive, "Start", ua.Variant(1, Kind.Int32)), ["Good", DONE])
    steps.step("enabled", await anna.value(state), 4)
    steps.step("owner", await anna.value(f"{drive}/supervision/owner"), "opcua:anna")
    reached = await anna.until(frequency, lambda hz: 19.5 <= hz <= 20.5)
    steps.step("speed", round(reached), 20)
    steps.step("stop", await anna.call(drive, "Stop"), ["Good", DONE])
    steps.step("standstill", await anna.until(frequency, lambda hz: hz == 0), 0.0)


async def languages(steps: Steps, anna: Session) -> None:
    """English; the same session then asks for German."""
    state = f"{steps.first}/fu1/status/state"

    async def shown() -> tuple[str, str, str]:
        name = await anna.value(state, Attribute.DisplayName)
        states = await anna.value(f"{state}/EnumStrings")
        method = await anna.value(f"{steps.first}/fu1/QuickStop", Attribute.DisplayName)
        return name.Text, states[4].Text, method.Text

    steps.step("in English", await shown(), ("State", "operation_enabled", "QuickStop"))
    anna.client.set_locale(["de-CH", "en"])
    await anna.client.activate_session("anna", "swordfish")
    steps.step("in German", await shown(), ("Zustand", "Betrieb freigegeben", "Schnellhalt"))
    browse_name = await anna.value(state, Attribute.BrowseName)
    steps.step("browse name as before", browse_name.Name, "State")


async def alarms(steps: Steps, client: Client) -> None:
    """A drive's fault is followed, acknowledged and dealt with by somebody who asks for German."""
    drive = f"{steps.first}/fu1"
    alarm = f"{drive}/Alarm"
    async with following(client) as follower:
        steps.break_plant("fail_drive", steps.first)
        # Until its number has been read there is only the emergency's.
        known = lambda event: event["FaultNumber"] == "E003/3.0"  # noqa: E731
        raised = await follower.until(of(drive), is_active, known, seconds=WITHIN_S)
        steps.step("alarm", (raised["SourceName"], raised["Severity"], raised["Retain"]), (drive, 800, True))
        steps.step("its message", raised["Message"].Text, "Störung E003/3.0. Überstrom Wechselrichter.")
        steps.step("its language", raised["Message"].Locale, "de")
        steps.step(
            "its cause",
            raised["Cause"].Text.partition(",")[0],
            "Mögliche Ursachen: Last zu schwer oder blockiert",
        )
        steps.step(
            "its remedy",
            raised["Remedy"].Text.partition(",")[0],
            "Allgemeiner Rat: Leichtgängigkeit der Maschine prüfen",
        )
        steps.step("its code", (raised["Code"], raised["FaultNumber"]), ("condition.drive_fault", "E003/3.0"))
        steps.step("its state", raised["AckedState"].Text, "nicht quittiert")
        given = event_and("Förderband geprüft", raised)
        steps.step("acknowledge", code_of(await follower.call(alarm, "Acknowledge", *given)), "Good")
        acked = await follower.until(of(drive), lambda event: event["AckedState/Id"], seconds=WITHIN_S)
        steps.step("acknowledged", (acked["AckedState"].Text, acked["ClientUserId"]), ("quittiert", "anna"))
        steps.step("comment", acked["Comment"], ua.LocalizedText("Förderband geprüft", "de"))
        again = code_of(await follower.call(alarm, "Acknowledge", *given))
        steps.step("acknowledge twice", again, "BadConditionBranchAlreadyAcked")
        unknown = event_and("", {"EventId": b"nothing"})
        steps.step(
            "acknowledge nothing",
            code_of(await follower.call(alarm, "Acknowledge", *unknown)),
            "BadEventIdUnknown",
        )
        shelve = ua.Variant(60_000.0, Kind.Double)
        steps.step("shelve", code_of(await follower.call(alarm, "TimedShelve", shelve)), "Good")
        twice = code_of(await follower.call(alarm, "OneShotShelve"))
        steps.step("one shot instead", twice, "Good")
        steps.step("unshelve", code_of(await follower.call(alarm, "Unshelve")), "Good")
        steps.step(
            "unshelve twice", code_of(await follower.call(alarm, "Unshelve")), "BadConditionNotShelved"
        )
        await _refreshed(steps, follower, drive)
        session = Session(client, follower.space)
        steps.step("reset of the fault", await session.call(drive, "ResetFault"), ["Good", ERLEDIGT])
        over = await follower.until(of(drive), is_over, seconds=WITHIN_S)
        steps.step(
            "over",
            (over["Retain"], over["Message"].Text),
            (True, "vorbei: Störung E003/3.0. Überstrom Wechselrichter."),
        )
        steps.step(
            "confirm", code_of(await follower.call(alarm, "Confirm", *event_and("", over, ""))), "Good"
        )
        done = await follower.until(of(drive), lambda event: not event["Retain"], seconds=WITHIN_S)
        steps.step("dealt with", done["ConfirmedState/Id"], True)
        await _cut(steps, follower)


async def _refreshed(steps: Steps, follower: Follower, drive: str) -> None:
    follower.events.clear()
    steps.step("refresh", code_of(await follower.refresh()), "Good")
    begins, ends = ua.NodeId(Ids.RefreshStartEventType), ua.NodeId(Ids.RefreshEndEventType)
    await follower.until(lambda event: event["EventType"] == ends, seconds=WITHIN_S)
    # An event of the plant may come before: it is none of the refresh.
    told = list(dropwhile(lambda event: event["EventType"] != begins, follower.events))
    steps.step("refresh begins", bool(told), True)
    steps.step("refreshed", drive in [event["SourceName"] for event in told], True)


async def _cut(steps: Steps, follower: Follower) -> None:
    steps.break_plant("cut_cable", steps.bus)
    raised = await follower.until(of(f"bus/{steps.bus}"), is_active, seconds=WITHIN_S)
    message = "Kein Knoten antwortet. Alle 2 Knoten, die da sein müssten, schweigen"
    steps.step("cut bus", raised["Message"].Text.partition(":")[0], message)
    silent = [f"{node}/fu{number}" for node in (steps.first, steps.second) for number in (1, 2, 3, 4)]
    steps.step("what it explains", sorted(raised["Explains"]), sorted([*silent, steps.first, steps.second]))
    steps.break_plant("mend_cable", steps.bus)
    over = await follower.until(of(f"bus/{steps.bus}"), is_over, seconds=WITHIN_S)
    steps.step("bus is back", over["ActiveState/Id"], False)


async def history(steps: Steps, session: Session, began: datetime) -> None:
    drive, end = f"{steps.first}/fu1", datetime.now(UTC) + timedelta(seconds=1)
    frequency, other = session.node(f"{drive}/actual/frequency"), session.node(f"{drive}/status/fault_text")
    raw = await frequency.read_raw_history(began, end, return_bounds=False)
    # While its bus was cut, the drive had no values.
    known = [one for one in raw if one.Value.Value is not None]
    top = max(known, key=lambda one: one.Value.Value)
    seen = (known[-1].Value.Value, round(top.Value.Value))
    steps.step("history goes up and down", seen, (0.0, 20))
    back = await frequency.read_raw_history(end, began, return_bounds=False)
    steps.step("history backwards", back == raw[::-1], True)
    details = ua.ReadAtTimeDetails([top.SourceTimestamp])
    at = (await frequency.history_read(details)).HistoryData.DataValues
    steps.step("history at a time", at[0].Value, top.Value)
    steps.step(
        "what has no history",
        await outcome(other.read_raw_history(began, end)),
        "BadHistoryOperationUnsupported",
    )
    events = await session.client.nodes.server.read_event_history(began, end, 1000)
    mine = [one.Message.Text for one in events if one.SourceName == drive and "berstrom" in one.Message.Text]
    said = "Störung E003/3.0. Überstrom Wechselrichter."
    steps.step("events of the past", list(dict.fromkeys(mine)), [said, f"vorbei: {said}"])


async def black_box(steps: Steps, session: Session) -> None:
    file = session.node(f"{steps.first}/fu1/BlackBox/1")
    size = await session.until(f"{steps.first}/fu1/BlackBox/1/Size", bool)
    async with UaFile(file, "r") as opened:
        content = await opened.read()
    steps.step("black box", len(content), size)
    steps.step("its first column", content.decode("utf-8-sig").partition(",")[0], "time")
    steps.step("black box is not written", await outcome(UaFile(file, "w").open(2)), "BadNotWritable")


async def main(steps: Steps) -> None:
    began = datetime.now(UTC)
    await discovery(steps)
    await certificates(steps)
    await users(steps)
    await roles(steps)
    async with logged_in(steps, "anna") as client:
        anna = await Session.of(client)
        await model(steps, anna)
        await moving(steps, anna)
        await languages(steps, anna)
        await alarms(steps, client)
        await history(steps, anna, began)
        await black_box(steps, anna)
    await subscriptions(steps)
    await diagnostics(steps)
    await read_through(steps)
    await end_is_announced(steps)


if __name__ == "__main__":
    asyncio.run(main(Steps(*sys.argv[1:])))
