"""Second part of open62541's scenario: subscriptions, what the server says of itself, and its end."""

from __future__ import annotations

import time
from typing import Any

import o6

from tests.support.certificates import CLIENT_URI
from tests.wire.scenarios.o6_client import (
    Session,
    Types,
    Waiting,
    logged_in,
    outcome,
    plain,
)
from tests.wire.scenarios.steps import Steps


def subscriptions(steps: Steps) -> None:
    with logged_in(steps, "anna") as anna:
        _items(steps, anna)
        _triggering(steps, anna)


def _deadband(kind: int, value: float) -> Any:
    return Types.DataChangeFilter(trigger=1, deadbandType=kind, deadbandValue=value)


def _items(steps: Steps, anna: Session) -> None:
    client, drive = anna.client, f"{steps.first}/fu3"
    made = client.createSubscription(1, 1, 7)
    steps.step(
        "revised subscription",
        (made.publishingInterval, made.lifetimeCount, made.maxKeepaliveCount),
        (50, 21, 7),
    )

    def refused(name: str, percent: float) -> str:
        wanted = _deadband(2, percent)
        return outcome(lambda: client.monitor(anna.id(name), Waiting(), subscription=made, filter=wanted))

    steps.step("percent of a state", refused(f"{drive}/status/state", 5), "BadDeadbandFilterInvalid")
    steps.step(
        "more than all", refused(f"{steps.first}/fu1/actual/frequency", 101), "BadDeadbandFilterInvalid"
    )
    steps.step("percent of a range", refused(f"{steps.first}/fu1/actual/frequency", 5), "Good")
    told, setpoint = Waiting(), f"{drive}/command/setpoint_1"
    client.monitor(anna.id(setpoint), told, 50, subscription=made, filter=_deadband(1, 500), queueSize=10)
    told.until(lambda word: word == 0)
    for word in (1000, 1200, 2000):
        anna.write(setpoint, o6.UInt16(word))
        time.sleep(0.2)
    told.until(lambda word: word == 2000)
    steps.step("within a deadband of 500", plain(told.told), [0, 1000, 2000])
    made.modify(publishingInterval=200, maxKeepaliveCount=1, lifetimeCount=1)
    steps.step(
        "modified subscription",
        (made.publishingInterval, made.lifetimeCount, made.maxKeepaliveCount),
        (200, 3, 1),
    )
    made.delete()


def _triggering(steps: Steps, anna: Session) -> None:
    client, setpoint = anna.client, f"{steps.first}/fu3/command/setpoint_1"
    made = client.createSubscription(50)
    first, linked = Waiting(), Waiting()
    trigger = client.monitor(anna.id(setpoint), first, 50, subscription=made)
    sampled = client.monitor(
        "i=2255", linked, 50, subscription=made, monitoringMode=Types.MonitoringMode.SAMPLING
    )
    first.until(lambda word: word == 2000)
    steps.step("sampled and not told", linked.told, [])
    steps.step("links", outcome(lambda: trigger.setTriggering([sampled])), "Good")
    anna.write(setpoint, o6.UInt16(3000))
    uris = linked.until(lambda value: True)
    steps.step("triggered", str(uris[0]), "http://opcfoundation.org/UA/")
    made.delete()


def diagnostics(steps: Steps) -> None:
    every, secret = "i=3707", "i=3708"
    with logged_in(steps, "anna") as anna, logged_in(steps, "eva") as eva:
        summary = anna.value("i=2275")
        steps.step("sessions are counted", int(summary.currentSessionCount) >= 2, True)
        steps.step("refused sessions are counted", int(summary.securityRejectedSessionCount) >= 1, True)
        steps.step("sessions for an operator", anna.value(every), "BadUserAccessDenied")
        steps.step("secrets for an operator", anna.value(secret), "BadUserAccessDenied")
        found = {str(one.clientDescription.applicationUri) for one in eva.value(every)}
        steps.step("sessions for an engineer", CLIENT_URI in found, True)
        users = {name for one in eva.value(secret) for name in map(str, one.clientUserIdHistory)}
        steps.step("secrets for an engineer", {"anna", "eva"} <= users, True)


def read_through(steps: Steps) -> None:
    """What is set at the drive itself is known once somebody asks the drive."""
    with logged_in(steps, "anna") as anna:
        where = Types.ReadValueId()
        where.nodeId = o6.NodeId(anna.id(f"{steps.first}/fu1/parameter/p102"))
        where.attributeId = o6.AttributeId.VALUE

        def read(max_age: float) -> float:
            request = Types.ReadRequest()
            request.maxAge = max_age
            request.nodesToRead = [where]
            return float(anna.client.serviceRead(request).results[0].value)

        steps.break_plant("turn_knob", steps.first, "700")
        time.sleep(0.2)
        steps.step("as it was read last", read(600_000.0), 2.5)
        steps.step("as the drive has it", read(0.0), 7.0)
        steps.step("as it was read then", read(600_000.0), 7.0)


def end_is_announced(steps: Steps) -> None:
    seen: list[tuple[str, Any]] = []
    followed = {"level": "i=2267", "state": "i=2259", "seconds": "i=2992", "reason": "i=2993"}
    with logged_in(steps, "anna", locale="de") as anna:
        made = anna.client.createSubscription(50)
        for what, where in followed.items():
            note = lambda value, what=what: seen.append((what, plain(value)))  # noqa: E731
            anna.client.monitor(where, note, 50, subscription=made, queueSize=10)
        while len(seen) < len(followed):
            time.sleep(0.05)
        steps.step("service level", ("level", 255) in seen, True)
        seen.clear()
        steps.say(waiting="end")
        while ("level", 0) not in seen or not any(what == "reason" for what, _ in seen):
            time.sleep(0.02)
        first = dict(reversed(seen))
        steps.step("state", first["state"], 4)
        steps.step("seconds till shutdown", first["seconds"], 2)
        steps.step("reason", first["reason"], ("de", "die Bridge wird angehalten"))
        point = f"{steps.first}/fu1/status/status_word"
        reads = [anna.value(point)]
        while isinstance(reads[-1], int):
            time.sleep(0.1)
            try:
                reads.append(anna.value(point))
            except RuntimeError:
                reads.append("closed")
        steps.step("served until the end", len(reads) > 5, True)
        steps.step("no Bad before the end", {type(one) for one in reads[:-1]}, {int})
        steps.step("counted down", [value for what, value in seen if what == "seconds"][:2], [2, 1])
