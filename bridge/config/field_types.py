"""The kinds of values in a site file: words to choose from, names, addresses, times."""

from __future__ import annotations

import contextlib
import ipaddress
import re
from typing import Annotated, Final, Literal, cast

from pydantic import AfterValidator, BaseModel, BeforeValidator, Field

OnLoss = Literal["restart", "stop_node", "stop_all", "nothing"]
OnFailedStart = Literal["reset_communication", "report"]
MandatoryMissing = Literal["go_on", "hold_all", "stop_all"]
Control = Literal["modbus", "opcua", "zenoh", "lease", "none"]
OnIgnoredStop = Literal["stop_node", "reset_node", "report"]
OnIntruder = Literal["stop_node", "stop_all", "report"]
ParameterRights = Literal["write", "read"]
WordOrder = Literal["ABCD", "CDAB", "BADC", "DCBA"]

LIFE_SIGN_MS: Final = 1000
"""Time in ms for which each token of a life sign is offered. A program that reads one at the last moment
brings back one that is this old."""
IGNORE_ALL_S: Final = -0.1
"""``telegram_downtime_s`` that reports communication errors and otherwise ignores them (P513 = -0.1)."""

LONGEST_TIMEOUT_MS: Final = 32767
"""Upper limit of P151 in ms (BU 2500 §7.1.1)."""

_NAME: Final = re.compile(r"[a-z][a-z0-9_]*")
_PREFIX: Final = re.compile(r"[\w.-]+(/[\w.-]+)*", re.ASCII)
_CONTROLLER: Final = re.compile(r"[A-Za-z0-9_.\-]{1,64}")
_OBJECT: Final = re.compile(r"([0-9A-Fa-f]{4}):([0-9A-Fa-f]{2})")
_MOST_COUNTER: Final = 240
_SHORTEST_REASON: Final = 10
_LOCATOR: Final = re.compile(r"[a-z][a-z0-9-]*/.+")
_HOST_NAME: Final = re.compile(r"[A-Za-z0-9_-]{1,63}(\.[A-Za-z0-9_-]{1,63})*")
_URI: Final = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*:[!-~]+")


def _regular_expression(text: str) -> str:
    try:
        re.compile(text)
    except re.error as error:
        raise ValueError(f"must be a regular expression: {error}") from None
    return text


def _reason(text: str) -> str:
    if len(text.strip()) < _SHORTEST_REASON:
        raise ValueError(f"must say why, in {_SHORTEST_REASON} characters or more")
    return text


def _name(text: str) -> str:
    if not _NAME.fullmatch(text):
        raise ValueError("must be lower_snake_case: a letter, then letters, digits and _")
    return text


def _prefix(text: str) -> str:
    if not _PREFIX.fullmatch(text):
        raise ValueError("must be words of letters, digits and _ . - with / between them")
    return text


def _endpoint(text: str) -> str:
    host, colon, port = text.rpartition(":")
    if not colon or not port.isdigit() or not 0 <= int(port) <= 65535:
        raise ValueError("must be an address and a port such as 127.0.0.1:4840")
    try:
        ipaddress.ip_address(host.strip("[]"))
    except ValueError:
        raise ValueError("must start with an IP address; 0.0.0.0 is every interface") from None
    return text


def _gateway(text: str) -> str:
    if text == "socket":
        return text
    try:
        host = _endpoint(text).rpartition(":")[0].strip("[]")
    except ValueError:
        raise ValueError(
            'must be "socket", or an address of this machine and a port, "127.0.0.1:7000"'
        ) from None
    if not ipaddress.ip_address(host).is_loopback:
        raise ValueError(
            "must be an address of this machine such as 127.0.0.1: the gateway asks nobody who he is"
        )
    return text


def _network(text: str) -> str:
    try:
        ipaddress.ip_network(text, strict=True)
    except ValueError as error:
        raise ValueError(f"must be a network such as 192.168.1.0/24: {error}") from None
    return text


def _downtime(seconds: float) -> float:
    if seconds in (IGNORE_ALL_S, 0) or 0.1 <= seconds <= 100.0:
        return seconds
    raise ValueError("must be -0.1 (ignore), 0 (off) or 0.1…100.0")


def _counter(value: int) -> int:
    if value == 0 or 2 <= value <= _MOST_COUNTER:
        return value
    raise ValueError("must be 0 (SYNC without a counter) or 2…240 (1019h)")


def _range(limits: list[int]) -> list[int]:
    if len(limits) != 2 or limits[0] > limits[1]:
        raise ValueError("must be the lowest and the highest time such as [100, 2000]")
    return limits


def _locator(text: str) -> str:
    if not _LOCATOR.fullmatch(text):
        raise ValueError("must be a protocol and an address such as tcp/192.168.1.10:7447")
    return text


def _host_name(text: str) -> str:
    with contextlib.suppress(ValueError):
        return str(ipaddress.ip_address(text))
    if not _HOST_NAME.fullmatch(text):
        raise ValueError("must be a host name such as bridge.plant.example, or an IP address")
    return text


def _uri(text: str) -> str:
    if not _URI.fullmatch(text):
        raise ValueError("must be a URI such as urn:hall-3:drivebridge")
    return text


def _controller(text: str) -> str:
    if not _CONTROLLER.fullmatch(text) or text == "anonymous":
        raise ValueError("must be a user's name of 1…64 letters, digits and _ . -")
    return text


def _plain(value: object) -> object:
    if not isinstance(value, bool | int | float | str):
        raise ValueError("must be a number, true or false, or a text in quotes")
    return value


def listed(value: object) -> object:
    """A single table counts as a list of one."""
    return [cast("object", value)] if isinstance(value, dict | BaseModel) else value


def _object(text: str) -> str:
    if not _OBJECT.fullmatch(text):
        raise ValueError('must be an object as "2097:01", index and sub-index in hexadecimal')
    return text


Name = Annotated[str, AfterValidator(_name)]
RegularExpression = Annotated[str, AfterValidator(_regular_expression)]
PlainValue = Annotated[bool | int | float | str, BeforeValidator(_plain)]
ObjectName = Annotated[str, AfterValidator(_object)]
Endpoint = Annotated[str, AfterValidator(_endpoint)]
Gateway = Annotated[str, AfterValidator(_gateway)]
Network = Annotated[str, AfterValidator(_network)]
Locator = Annotated[str, AfterValidator(_locator)]
HostName = Annotated[str, AfterValidator(_host_name)]
Uri = Annotated[str, AfterValidator(_uri)]
ControllerName = Annotated[str, AfterValidator(_controller)]
Timeout = Annotated[int, Field(ge=0, le=LONGEST_TIMEOUT_MS)]
Full = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Reason = Annotated[str, AfterValidator(_reason)]
Prefix = Annotated[str, AfterValidator(_prefix)]
Downtime = Annotated[float, AfterValidator(_downtime)]
SyncCounter = Annotated[int, AfterValidator(_counter)]
TimeoutRange = Annotated[list[Timeout], AfterValidator(_range)]
