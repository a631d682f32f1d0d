"""asyncua as the rest of this package sees it: names with types, where asyncua's own are partial.

asyncua's generated classes ask for ``UInt32`` and ``DateTime`` where they take ``int`` and
``datetime``, and ``asyncua.ua`` re-exports without saying so. That is put right here and only here.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, TypeVar

from asyncua import ua as ua
from asyncua.common.utils import ServiceError as ServiceError
from asyncua.crypto import uacrypto
from asyncua.ua.attribute_ids import AttributeIds as AttributeIds
from asyncua.ua.object_ids import ObjectIds as ObjectIds
from asyncua.ua.status_codes import StatusCodes as StatusCodes
from asyncua.ua.status_codes import get_name_and_doc
from asyncua.ua.uaerrors import UaError as UaError
from asyncua.ua.uaerrors import UaStatusCodeError as UaStatusCodeError

# Not `ua.DataChangeFilter`, which is a subclass that nothing decoded is an instance of.
from asyncua.ua.uaprotocol_auto import DataChangeFilter as DataChangeFilter
from cryptography import x509

status: Callable[[int], ua.StatusCode] = ua.StatusCode  # pyright: ignore[reportAssignmentType]
"""A status code from its number."""

variant: Callable[..., ua.Variant] = ua.Variant
data_value: Callable[..., ua.DataValue] = ua.DataValue
"""(value, status, source time, server time)"""

notification: Callable[[int, ua.DataValue], ua.MonitoredItemNotification] = ua.MonitoredItemNotification
"""(client handle, value)"""

extension: Callable[..., ua.ExtensionObject] = ua.ExtensionObject
"""(type, body)"""

node_id: Callable[..., ua.NodeId] = ua.NodeId
"""(identifier, namespace index)"""

GOOD: Final = status(StatusCodes.Good)

_T = TypeVar("_T")


class ExplainedFault(ServiceError):
    """Service that is refused; ``why`` is for who has asked for it to be explained."""

    def __init__(self, code: int, why: str) -> None:
        super().__init__(code)
        self.why = why


def make(structure: Callable[..., _T], **fields: object) -> _T:
    """A new one of asyncua's structures with these fields set."""
    return change(structure(), **fields)


def change(structure: _T, **fields: object) -> _T:
    """The same structure with these fields set."""
    for name, value in fields.items():
        setattr(structure, name, value)
    return structure


def get(structure: object, name: str) -> Any:
    """A field whose type asyncua does not tell."""
    return getattr(structure, name)


def first_certificate(content: bytes | None) -> x509.Certificate | None:
    """The first certificate of a chain in DER, None for nothing. Raises ValueError for anything else."""
    return get(uacrypto, "x509_from_der")(content)


InvalidSignature: type[Exception] = get(uacrypto, "InvalidSignature")


def describe_code(code: int) -> str:
    """Meaning of a status code, in English."""
    return get_name_and_doc(code)[1]


def text(words: str) -> ua.LocalizedText:
    return ua.LocalizedText(words, "en") if words else ua.LocalizedText()
