"""End of an EDS: whole without a last line end, or broken off."""

from __future__ import annotations

import pytest

from bridge.eds import read_device

OBJECTS = """[DeviceInfo]
VendorName=Acme

[MandatoryObjects]
SupportedObjects=1
1=0x1000

[1000]
ParameterName=Device Type
ObjectType=0x7
DataType=0x0007
AccessType=ro
DefaultValue=0x00010192
PDOMapping=0

[ManufacturerObjects]
SupportedObjects=2
1=0x2000
2=0x2001

[2000]
ParameterName=Speed
ObjectType=0x7
DataType=0x0006
AccessType=rw
DefaultValue=1500
PDOMapping=0
"""
LAST = """
[2001]
ParameterName=Ramp
ObjectType=0x7
DataType=0x0006
AccessType=rw
DefaultValue=700
PDOMapping=0
"""
WHOLE = OBJECTS + LAST


def is_broken(text: str) -> bool:
    return read_device(text.encode(), "a.eds").broken_off_at is not None


@pytest.mark.parametrize(
    "text",
    [
        pytest.param(WHOLE.rstrip(), id="no line end"),
        pytest.param(WHOLE, id="line end"),
        pytest.param(WHOLE.rstrip() + "\x1a", id="an old editor"),
        pytest.param(OBJECTS.rstrip(), id="the last of the list is not described"),
        pytest.param(WHOLE + "// end of file", id="a remark of C"),
        pytest.param(WHOLE + "-- end --", id="dashes"),
        pytest.param(WHOLE + "*** EOF ***", id="stars"),
        pytest.param(WHOLE + "END", id="a word"),
        pytest.param(OBJECTS + "\n[Comments]\nLines=1\nLine1=made by nobody", id="comments at the end"),
        pytest.param(OBJECTS + "\n[DeviceComissioning]\nNodeID=5", id="node of a DCF at the end"),
        pytest.param(OBJECTS + "\n[Tool]\nOwner=nobody", id="a tool's section at the end"),
    ],
)
def test_a_whole_file_is_whole_however_it_ends(text: str) -> None:
    assert not is_broken(text)


@pytest.mark.parametrize(
    "text",
    [
        pytest.param(WHOLE.rstrip()[:-8], id="within a key"),
        pytest.param(OBJECTS.rstrip().replace("\nPDOMapping=0", ""), id="within a value"),
        pytest.param(OBJECTS.rstrip()[: OBJECTS.rindex("Speed") + 3], id="within a title"),
        pytest.param(OBJECTS + "\n[200", id="within a section"),
        pytest.param(OBJECTS[: OBJECTS.index("2=0x2001") + 6], id="within a list"),
        pytest.param(OBJECTS[: OBJECTS.index("2=0x2001") + 1], id="within a list's key"),
    ],
)
def test_a_file_that_was_cut_breaks_off(text: str) -> None:
    assert is_broken(text)


def test_wherever_the_last_described_object_is_cut_within_a_line_it_breaks_off() -> None:
    """But for what reads as a whole line of the file: no reader can tell that."""
    begin = OBJECTS.index("[2000]") + len("[2000]\n")
    lines = set(OBJECTS.splitlines())
    for end in range(begin, len(OBJECTS)):
        text = OBJECTS[:end]
        last = text.rpartition("\n")[2]
        if last and last not in lines:
            assert is_broken(text), last
