"""The kinds of values in a site file: words to choose from, names, addresses, times."""

from __future__ import annotations

import contextlib
import ipaddress
import re
from typing import Annotated, Final, Literal, cast

from pydantic import AfterValidator, BaseModel, BeforeValidator, Field

from bridge.canopen.pdo import MOST_BITS, PdoEntry
from bridge.config.point_patterns import is_pattern
from bridge.text import Text
from bridge.tomlfile import Unfit

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
_MAPPED: Final = re.compile(r"([0-9A-Fa-f]{4}):([0-9A-Fa-f]{2})/([0-9]{1,2})")
_MOST_COUNTER: Final = 240
_SHORTEST_REASON: Final = 10
_LOCATOR: Final = re.compile(r"[a-z][a-z0-9-]*/.+")
_HOST_NAME: Final = re.compile(r"[A-Za-z0-9_-]{1,63}(\.[A-Za-z0-9_-]{1,63})*")
_OPCUA_URL: Final = re.compile(r"opc\.tcp://(\[[0-9A-Fa-f:.]+\]|[A-Za-z0-9.-]+):[0-9]{1,5}(/[!-~]*)?")
_URI: Final = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*:[!-~]+")


def _regular_expression(text: str) -> str:
    try:
        re.compile(text)
    except re.error as error:
        raise Unfit(Text.of("site.regular_expression", why=str(error))) from None
    return text


def _point_pattern(text: str) -> str:
    if not is_pattern(text):
        raise Unfit(Text.of("site.point_pattern"))
    return text


def _reason(text: str) -> str:
    if len(text.strip()) < _SHORTEST_REASON:
        raise Unfit(Text.of("site.reason", least=_SHORTEST_REASON))
    return text


def _name(text: str) -> str:
    if not _NAME.fullmatch(text):
        raise Unfit(Text.of("site.name"))
    return text


def _prefix(text: str) -> str:
    if not _PREFIX.fullmatch(text):
        raise Unfit(Text.of("site.prefix"))
    return text


def _endpoint(text: str) -> str:
    host, colon, port = text.rpartition(":")
    if not colon or not port.isdigit() or not 0 <= int(port) <= 65535:
        raise Unfit(Text.of("site.endpoint"))
    try:
        ipaddress.ip_address(host.strip("[]"))
    except ValueError:
        raise Unfit(Text.of("site.endpoint_address")) from None
    return text


def _gateway(text: str) -> str:
    if text == "socket":
        return text
    try:
        host = _endpoint(text).rpartition(":")[0].strip("[]")
    except ValueError:
        raise Unfit(Text.of("site.gateway")) from None
    if not ipaddress.ip_address(host).is_loopback:
        raise Unfit(Text.of("site.gateway_loopback"))
    return text


def _network(text: str) -> str:
    try:
        ipaddress.ip_network(text, strict=True)
    except ValueError as error:
        raise Unfit(Text.of("site.network", why=str(error))) from None
    return text


def _downtime(seconds: float) -> float:
    if seconds in (IGNORE_ALL_S, 0) or 0.1 <= seconds <= 100.0:
        return seconds
    raise Unfit(Text.of("site.downtime"))


def _counter(value: int) -> int:
    if value == 0 or 2 <= value <= _MOST_COUNTER:
        return value
    raise Unfit(Text.of("site.sync_counter"))


def _range(limits: list[int]) -> list[int]:
    if len(limits) != 2 or limits[0] > limits[1]:
        raise Unfit(Text.of("site.timeout_range"))
    return limits


def _locator(text: str) -> str:
    if not _LOCATOR.fullmatch(text):
        raise Unfit(Text.of("site.locator"))
    return text


def _host_name(text: str) -> str:
    with contextlib.suppress(ValueError):
        return str(ipaddress.ip_address(text))
    if not _HOST_NAME.fullmatch(text):
        raise Unfit(Text.of("site.host_name"))
    return text


def _uri(text: str) -> str:
    if not _URI.fullmatch(text):
        raise Unfit(Text.of("site.uri"))
    return text


def _opcua_url(text: str) -> str:
    if not _OPCUA_URL.fullmatch(text):
        raise Unfit(Text.of("site.opcua_url"))
    return text


def _controller(text: str) -> str:
    if not _CONTROLLER.fullmatch(text) or text == "anonymous":
        raise Unfit(Text.of("site.controller"))
    return text


def _plain(value: object) -> object:
    if not isinstance(value, bool | int | float | str):
        raise Unfit(Text.of("site.plain_value"))
    return value


def listed(value: object) -> object:
    """A single table counts as a list of one."""
    return [cast("object", value)] if isinstance(value, dict | BaseModel) else value


def _object(text: str) -> str:
    if not _OBJECT.fullmatch(text):
        raise Unfit(Text.of("site.object"))
    return text


def _mapped(text: object) -> object:
    if isinstance(text, PdoEntry):
        return text
    match = _MAPPED.fullmatch(text) if isinstance(text, str) else None
    if not match or not 1 <= int(match[3]) <= MOST_BITS:
        raise Unfit(Text.of("site.mapped_object"))
    return PdoEntry(int(match[1], 16), int(match[2], 16), int(match[3]))


def _fits(objects: list[PdoEntry]) -> list[PdoEntry]:
    bits = sum(mapped.bits for mapped in objects)
    if bits > MOST_BITS:
        raise Unfit(Text.of("site.pdo_bits", bits=bits, most=MOST_BITS))
    return objects


Name = Annotated[str, AfterValidator(_name)]
RegularExpression = Annotated[str, AfterValidator(_regular_expression)]
PlainValue = Annotated[bool | int | float | str, BeforeValidator(_plain)]
ObjectName = Annotated[str, AfterValidator(_object)]
PdoMapping = Annotated[list[Annotated[PdoEntry, BeforeValidator(_mapped)]], AfterValidator(_fits)]
Endpoint = Annotated[str, AfterValidator(_endpoint)]
Gateway = Annotated[str, AfterValidator(_gateway)]
Network = Annotated[str, AfterValidator(_network)]
Locator = Annotated[str, AfterValidator(_locator)]
HostName = Annotated[str, AfterValidator(_host_name)]
Uri = Annotated[str, AfterValidator(_uri)]
OpcUaUrl = Annotated[str, AfterValidator(_opcua_url)]
ControllerName = Annotated[str, AfterValidator(_controller)]
Timeout = Annotated[int, Field(ge=0, le=LONGEST_TIMEOUT_MS)]
Full = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Reason = Annotated[str, AfterValidator(_reason)]
PointPattern = Annotated[str, AfterValidator(_point_pattern)]
Prefix = Annotated[str, AfterValidator(_prefix)]
Downtime = Annotated[float, AfterValidator(_downtime)]
SyncCounter = Annotated[int, AfterValidator(_counter)]
TimeoutRange = Annotated[list[Timeout], AfterValidator(_range)]
