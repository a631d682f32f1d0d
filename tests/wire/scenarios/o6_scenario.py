"""The scenario of open62541's client: o6_scenario.py LETTER FOLDER URL COMMANDS.

What this client does not have: it sends neither Republish nor TransferSubscriptions, and what it calls a
transfer of its session ends before it has one; its languages are those of the time when it connects; its
filters of events name no fields of other namespaces, which are read from the alarm instead.
"""

from __future__ import annotations

import sys
from datetime import UTC, datetime, timedelta
from typing import Any

import o6

from tests.wire.scenarios.o6_client import (
    Session,
    Waiting,
    logged_in,
    outcome,
    plain,
    prepared,
)
from tests.wire.scenarios.o6_lasting import diagnostics, end_is_announced, read_through, subscriptions
from tests.wire.scenarios.steps import Steps

REFUSED = "BadUserAccessDenied"
DONE = ("en", "done")
EVENTS = (
    "SELECT /EventId, /SourceName, /Message, /Severity, /Retain, /ActiveState/Id, /AckedState,"
    " /AckedState/Id, /ConfirmedState/Id, /Comment, /ClientUserId, /EventType"
)


def discovery(steps: Steps) -> None:
    """In a session: without one this client closes the channel that it looks for endpoints on."""
    with logged_in(steps, "anna") as anna:
        (server,) = anna.client.findServers(steps.url)
        endpoints = anna.client.getEndpoints(steps.url)
    steps.step("application", str(server.applicationUri), "urn:plant:drivebridge")
    steps.step("kind of application", int(server.applicationType), 0)
    steps.step("addresses", [str(one) for one in server.discoveryUrls], [steps.url])
    policies = [str(one.securityPolicyUri).partition("#")[2] for one in endpoints]
    steps.step("policies", policies, ["Basic256Sha256", "Aes128_Sha256_RsaOaep", "Aes256_Sha256_RsaPss"])
    steps.step("modes", {int(one.securityMode) for one in endpoints}, {3})
    tokens = {int(token.tokenType) for one in endpoints for token in one.userIdentityTokens}
    steps.step("identities", tokens, {1, 2})


def certificates(steps: Steps) -> None:
    def shown(name: str) -> str:
        def enter() -> None:
            with logged_in(steps, "anna", certificate=name):
                pass

        return outcome(enter)

    hidden = "BadSecurityChecksFailed"
    steps.step("certificate: untrusted", shown("untrusted"), hidden)
    steps.step("certificate: weak key", shown("weak key"), hidden)
    steps.step("certificate: no issuer", shown("no issuer"), hidden)
    steps.step("certificate: expired", shown("expired"), "BadCertificateTimeInvalid")
    steps.step("certificate: not yet valid", shown("not yet valid"), "BadCertificateTimeInvalid")
    steps.step("certificate: wrong URI", shown("wrong uri"), "BadCertificateUriInvalid")
    steps.step("certificate: wrong usage", shown("wrong usage"), "BadCertificateUseNotAllowed")
    steps.step("certificate: revoked", shown("revoked"), "BadCertificateRevoked")
    steps.step("certificate: of an authority", shown("of authority"), "Good")
    steps.step("certificate: trusted", shown("trusted"), "Good")


def users(steps: Steps) -> None:
    def enter(user: str, password: str = "swordfish") -> str:
        def stay() -> None:
            with logged_in(steps, user, password=password):
                pass

        return outcome(stay)

    def shows(person: str) -> str:
        client = prepared(steps)
        files = [(steps.folder / f"{person}.{end}").read_bytes() for end in ("der", "pem")]
        client.config.setAuthenticationCert(*files)
        code = outcome(lambda: client.connect(createDefaultSubscription=False))
        client.disconnect()
        return code

    steps.step("wrong password", enter("anna", "sardine"), "BadUserAccessDenied")
    steps.step("unknown user", enter("udo"), "BadUserAccessDenied")
    steps.step("user with a certificate", shows("carl"), "Good")
    steps.step("certificate of no user", shows("otto"), "BadIdentityTokenRejected")


def model(steps: Steps, session: Session) -> None:
    """The drive by published types alone, without a name of ours."""
    client = session.client
    di = session.spaces.index("http://opcfoundation.org/UA/DI/")
    (devices,) = session.targets("i=85", f"{di}:DeviceSet")
    names = [str(session.client.read(one.nodeId, attr="displayName").text) for one in client.browse(devices)]
    own = [f"{node}/fu{number}" for node in (steps.first, steps.second) for number in (1, 2, 3, 4)]
    steps.step("assets", sorted(name for name in names if name in own), own)
    (asset,) = session.targets(devices, f"{session.space}:{own[0]}")
    kind = next(one for one in client.browse(asset, reftype="i=40"))
    steps.step(
        "type of asset",
        str(session.client.read(kind.nodeId, attr="displayName").text),
        "PtAssetFrequencyConverterType",
    )

    def read(*path: str) -> Any:
        return session.value(session.targets(asset, *path)[0])

    steps.step("manufacturer", read(f"{di}:Manufacturer"), ("en", "Getriebebau NORD"))
    steps.step("model", read(f"{di}:Model"), ("en", "SK TU4-CAO"))
    steps.step("software", read(f"{di}:SoftwareRevision"), "1.2 R0")
    steps.step("serial number", read(f"{di}:SerialNumber"), "BadNotSupported")
    component = read(f"{di}:Identification", f"{di}:ComponentName")
    steps.step("identification", component, ("en", own[0]))
    steps.step("health", read(f"{di}:DeviceHealth"), 0)
    unit = read(f"{di}:Operational", f"{session.space}:MainActualValue", "0:EngineeringUnits")
    steps.step("unit", (str(unit.displayName.text), int(unit.unitId)), ("Hz", 4740186))
    (methods,) = session.targets(asset, f"{di}:MethodSet")
    found = [str(session.client.read(one.nodeId, attr="displayName").text) for one in client.browse(methods)]
    steps.step("methods", found[:5], ["Start", "Stop", "QuickStop", "DisableVoltage", "ResetFault"])


def roles(steps: Steps) -> None:
    """What each may do, and what only the next one may."""
    first, drive = f"{steps.first}/fu1", f"{steps.first}/fu4"
    alarm, setpoint = f"{drive}/Alarm", f"{drive}/command/setpoint_1"
    parameter = ("P102", o6.Double(2.5))
    configuration, rejected = "i=12637", "i=12777"
    enable, disable, shelve = "i=9027", "i=9028", "i=9212"
    with logged_in(steps, "otto") as otto:
        steps.step("observer reads", otto.value(f"{first}/parameter/p105"), 50.0)
        steps.step("observer writes", otto.write(setpoint, o6.UInt16(1)), REFUSED)
        steps.step("observer starts", otto.call(drive, "Start", o6.Int32(1)), [REFUSED])
        steps.step("observer stops", otto.call(drive, "Stop"), [REFUSED])
        steps.step("observer resets a node", otto.call(steps.second, "Reset"), [REFUSED])
        steps.step("observer shelves", otto.call(alarm, shelve), [REFUSED])
        steps.step("observer reads a parameter", otto.call(first, "ReadParameter", "P102"), ["Good", 2.0])
    with logged_in(steps, "anna") as anna:
        steps.step("operator writes", anna.write(setpoint, o6.UInt16(1)), "Good")
        steps.step("operator sets a parameter", anna.call(first, "WriteParameter", *parameter), [REFUSED])
        steps.step("operator saves", anna.call(first, "SaveParameters"), [REFUSED])
        steps.step("operator disables an alarm", anna.call(alarm, disable), [REFUSED])
    with logged_in(steps, "eva") as eva:
        steps.step("engineer sets a parameter", eva.call(first, "WriteParameter", *parameter), ["Good", DONE])
        steps.step("engineer reads it", eva.call(first, "ReadParameter", "P102"), ["Good", 2.5])
        steps.step("engineer disables an alarm", eva.call(alarm, disable), ["Good"])
        steps.step("engineer enables it", eva.call(alarm, enable), ["Good"])
        steps.step("engineer sees who was refused", eva.call(configuration, rejected), [REFUSED])
    with logged_in(steps, "ida") as ida:
        code, found = ida.call(configuration, rejected)
        steps.step("admin sees who was refused", (code, len(found) > 0), ("Good", True))


def moving(steps: Steps, anna: Session) -> None:
    drive = f"{steps.first}/fu1"
    state, frequency = f"{drive}/status/state", f"{drive}/actual/frequency"
    setpoint = f"{drive}/command/setpoint_1"
    steps.step("at first", anna.value(state), 1)
    steps.step("out of range", anna.write(setpoint, o6.UInt32(70000)), "BadOutOfRange")
    steps.step("of a wrong type", anna.write(setpoint, "fast"), "BadTypeMismatch")
    steps.step("what is only read", anna.write(f"{drive}/status/status_word", o6.UInt16(1)), "BadNotWritable")
    steps.step("set-point", anna.write(f"{drive}/command/frequency", o6.Double(20.0)), "Good")
    steps.step("start", anna.call(drive, "Start", o6.Int32(1)), ["Good", DONE])
    steps.step("enabled", anna.value(state), 4)
    steps.step("owner", anna.value(f"{drive}/supervision/owner"), "opcua:anna")
    steps.step("speed", round(anna.until(frequency, lambda hz: 19.5 <= hz <= 20.5)), 20)
    steps.step("stop", anna.call(drive, "Stop"), ["Good", DONE])
    steps.step("standstill", anna.until(frequency, lambda hz: hz == 0), 0.0)


def language(steps: Steps, session: Session, words: str, expected: list[tuple[str, str]]) -> None:
    state = f"{steps.first}/fu1/status/state"
    name, method = o6.AttributeId.DISPLAY_NAME, f"{steps.first}/fu1/QuickStop"
    shown = [
        session.value(state, name),
        session.value(f"{state}/EnumStrings")[4],
        session.value(method, name),
    ]
    steps.step(f"in {words}", shown, expected)


def alarms(steps: Steps, anna: Session) -> None:
    """A drive's fault is followed, acknowledged and dealt with by somebody who asks for German."""
    drive = f"{steps.first}/fu1"
    alarm = f"{drive}/Alarm"
    waiting = Waiting()
    subscription = anna.client.createSubscription(50)
    anna.client.monitorEvent("i=2253", waiting, EVENTS, subscription=subscription)

    def told(source: str, **fields: object) -> dict[str, Any]:
        wanted = {f"/{name.replace('_', '/')}": value for name, value in fields.items()}
        found = waiting.until(
            lambda one: (
                str(one["/SourceName"]) == source
                and all(plain(one[name]) == value for name, value in wanted.items())
            ),
            seconds=40,
        )
        return {name.removeprefix("/"): plain(value) for name, value in found.items()}

    steps.break_plant("fail_drive", steps.first)
    # Until its number has been read there is only the emergency's.
    raised = told(drive, ActiveState_Id=True, Message=("de", "Störung E003/3.0. Überstrom Wechselrichter."))
    steps.step("alarm", (raised["SourceName"], raised["Severity"], raised["Retain"]), (drive, 800, True))
    steps.step("its message", raised["Message"], ("de", "Störung E003/3.0. Überstrom Wechselrichter."))
    cause, remedy = (anna.value(f"{alarm}/{name}")[1].partition(",")[0] for name in ("Cause", "Remedy"))
    steps.step("its cause", cause, "Mögliche Ursachen: Last zu schwer oder blockiert")
    steps.step("its remedy", remedy, "Allgemeiner Rat: Leichtgängigkeit der Maschine prüfen")
    steps.step("its code", anna.value(f"{alarm}/Code"), "condition.drive_fault")
    steps.step("its fault number", anna.value(f"{alarm}/FaultNumber"), "E003/3.0")
    steps.step("its state", raised["AckedState"], ("de", "nicht quittiert"))
    acknowledge, confirm = "i=9111", "i=9113"
    said = (o6.ByteString(raised["EventId"]), o6.LocalizedText("Förderband geprüft", "de"))
    steps.step("acknowledge", anna.call(alarm, acknowledge, *said), ["Good"])
    acked = told(drive, AckedState_Id=True, ActiveState_Id=True)
    steps.step("acknowledged", (acked["AckedState"], acked["ClientUserId"]), (("de", "quittiert"), "anna"))
    steps.step("comment", acked["Comment"], ("de", "Förderband geprüft"))
    steps.step("acknowledge twice", anna.call(alarm, acknowledge, *said), ["BadConditionBranchAlreadyAcked"])
    nothing = (o6.ByteString(b"nothing"), o6.LocalizedText("", "de"))
    steps.step("acknowledge nothing", anna.call(alarm, acknowledge, *nothing), ["BadEventIdUnknown"])
    steps.step("shelve", anna.call(alarm, "i=9213", o6.Double(60_000.0)), ["Good"])
    steps.step("unshelve", anna.call(alarm, "i=9211"), ["Good"])
    steps.step("unshelve twice", anna.call(alarm, "i=9211"), ["BadConditionNotShelved"])
    waiting.told.clear()
    refreshed = anna.call("i=2782", "i=3875", o6.UInt32(subscription.id))
    steps.step("refresh", refreshed, ["Good"])
    waiting.until(lambda one: str(one["/EventType"]) == "i=2788")
    kinds = [str(one["/EventType"]) for one in waiting.told]
    # An event of the plant may come before: it is none of the refresh.
    steps.step("refresh begins", "i=2787" in kinds, True)
    between = waiting.told[kinds.index("i=2787") + 1 : kinds.index("i=2788")]
    steps.step("refreshed", drive in [str(one["/SourceName"]) for one in between], True)
    steps.step("reset of the fault", anna.call(drive, "ResetFault"), ["Good", ("de", "ausgeführt")])
    over = told(drive, ActiveState_Id=False)
    message = ("de", "vorbei: Störung E003/3.0. Überstrom Wechselrichter.")
    steps.step("over", (over["Retain"], over["Message"]), (True, message))
    said = (o6.ByteString(over["EventId"]), o6.LocalizedText("", ""))
    steps.step("confirm", anna.call(alarm, confirm, *said), ["Good"])
    steps.step("dealt with", told(drive, Retain=False, ActiveState_Id=False)["ConfirmedState/Id"], True)
    waiting.told.clear()
    steps.break_plant("cut_cable", steps.bus)
    raised = told(steps.bus, ActiveState_Id=True)
    message = "Kein Knoten antwortet. Alle 2 Knoten, die da sein müssten, schweigen"
    steps.step("cut bus", raised["Message"][1].partition(":")[0], message)
    silent = [f"{node}/fu{number}" for node in (steps.first, steps.second) for number in (1, 2, 3, 4)]
    explained = sorted(anna.value(f"bus/{steps.bus}/Alarm/Explains"))
    steps.step("what it explains", explained, sorted([*silent, steps.first, steps.second]))
    steps.break_plant("mend_cable", steps.bus)
    steps.step("bus is back", told(steps.bus, ActiveState_Id=False)["ActiveState/Id"], False)
    subscription.delete()


def history(steps: Steps, anna: Session, began: datetime) -> None:
    """While its bus was cut, the drive had no values."""
    drive, end = f"{steps.first}/fu1", datetime.now(UTC) + timedelta(seconds=1)
    frequency = anna.id(f"{drive}/actual/frequency")

    def read(*times: datetime, most: int = 0) -> list[float | None]:
        found = anna.client.historyRead(frequency, *times, numValuesPerNode=most)
        return [plain(one.value) for one in found.dataValues]

    told = read(began, end)
    known = [hertz for hertz in told if hertz is not None]
    steps.step("history goes up and down", (known[-1], round(max(known))), (0.0, 20))
    steps.step("history backwards", read(end, began), told[::-1])
    steps.step("history of three", read(began, end, most=3), told[:3])
    none = outcome(lambda: anna.client.historyRead(anna.id(f"{drive}/status/fault_text"), began, end))
    steps.step("what has no history", none, "BadHistoryOperationUnsupported")


def black_box(steps: Steps, anna: Session) -> None:
    file = f"{steps.first}/fu1/BlackBox/1"
    size = anna.until(f"{file}/Size", bool)
    opened, read, close = "i=11580", "i=11585", "i=11583"
    steps.step("open for writing", anna.call(file, opened, o6.Byte(2)), ["BadNotWritable"])
    code, handle = anna.call(file, opened, o6.Byte(1))
    steps.step("open for reading", code, "Good")
    code, content = anna.call(file, read, o6.UInt32(handle), o6.Int32(size))
    steps.step("black box", (code, len(content)), ("Good", size))
    steps.step("its first column", content.decode("utf-8-sig").partition(",")[0], "time")
    steps.step("close", anna.call(file, close, o6.UInt32(handle)), ["Good"])


def main(steps: Steps) -> None:
    began = datetime.now(UTC)
    discovery(steps)
    certificates(steps)
    users(steps)
    roles(steps)
    with logged_in(steps, "anna") as anna:
        model(steps, anna)
        moving(steps, anna)
        english = [("en", "State"), ("en", "operation_enabled"), ("en", "QuickStop")]
        language(steps, anna, "English", english)
    with logged_in(steps, "anna", locale="de") as anna:
        german = [("de", "Zustand"), ("de", "Betrieb freigegeben"), ("de", "Schnellhalt")]
        language(steps, anna, "German", german)
        alarms(steps, anna)
        history(steps, anna, began)
        black_box(steps, anna)
    subscriptions(steps)
    diagnostics(steps)
    read_through(steps)
    end_is_announced(steps)


if __name__ == "__main__":
    main(Steps(*sys.argv[1:]))
