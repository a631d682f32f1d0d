"""The modules of a coupler: which there are, and which elements they bring."""

from __future__ import annotations

import pytest

from bridge.base.errors import FileFaults
from bridge.eds import Description, read_device
from tests.support.couplers import (
    EMPTY,
    INPUTS,
    MODULES,
    ONBOARD,
    connected,
    coupler,
    extension,
    module,
)
from tests.support.devices import DEVICES
from tests.support.invented_eds import U16

DI8, DI4, DO8, AI2 = "AC-DI8", "AC-DI4", "AC-DO8", "AC-AI2"


def elements(description: Description, index: int = 0x6000) -> list[int]:
    one = description.object(index)
    return [entry.sub for entry in one.entries if entry.sub] if one else []


def with_modules(*modules: str, content: bytes | None = None) -> Description:
    return read_device(content or coupler(), "coupler.eds", modules)


@pytest.mark.parametrize(
    ("modules", "subs"),
    [
        ([DI8], [1]),
        ([DI8, DI8, DI8], [1, 2, 3]),
        ([DO8, DI8, AI2, DI8], [1, 2]),
        ([DO8], []),
        ([DI4], [1]),
        ([DI4, DI4], [1]),
        ([DI4, DI4, DI4], [1, 2]),
        ([DI4, DI8, DI4], [1, 2, 3]),
    ],
)
def test_elements_follow_each_other_in_the_order_of_the_modules(modules: list[str], subs: list[int]) -> None:
    """Two modules of four bits share an element of eight; whole elements begin anew."""
    description = with_modules(*modules)
    assert elements(description) == subs
    assert description.number(0x6000, 0) == (subs[-1] if subs else None)
    assert not [
        one for one in description.findings if "6000" in str(one.said) and " maps " not in str(one.said)
    ]


@pytest.mark.parametrize(
    ("count", "more", "modules", "places"),
    [
        ("2", "", 2, [(0x6000, 1), (0x6000, 2), (0x6000, 3), (0x6000, 4)]),
        ("3", "ObjExtend=4", 2, [*((0x6000, sub) for sub in (1, 2, 3, 4)), (0x6001, 1), (0x6001, 2)]),
        ("0;16", "", 1, [(0x6000, 1), (0x6000, 2)]),
        ("0;2", "", 5, [(0x6000, 1), (0x6000, 2)]),
        ("200", "", 2, [(0x6000, sub) for sub in range(1, 255)]),
        (" 1 ", "ObjExtend=0", 1, [(0x6000, 1)]),
        ("0", "", 3, []),
    ],
)
def test_how_many_elements_a_module_brings(
    count: str, more: str, modules: int, places: list[tuple[int, int]]
) -> None:
    one = module(1, "Inputs", "IN", extension("6000", INPUTS, count, more=more))
    description = with_modules(*["IN"] * modules, content=coupler(modules=(one,)))
    assert sorted(description.extended) == places


@pytest.mark.parametrize(("kind", "subs"), [(U16, [1, 2]), ("0x18", [1]), ("0x1", [*range(1, 25)])])
def test_how_many_bits_share_an_element_its_type_says(kind: str, subs: list[int]) -> None:
    """Sixteen, forty, and one: a boolean is a bit."""
    one = module(1, "Inputs", "IN", extension("6100", INPUTS, "0;8", kind=kind))
    description = with_modules("IN", "IN", "IN", content=coupler(modules=(one,)))
    assert elements(description, 0x6100) == subs


@pytest.mark.parametrize(
    ("own", "subs"), [(None, [1, 2]), (EMPTY, [1, 2]), (ONBOARD, [1, 2, 3])], ids=["none", "empty", "own"]
)
def test_they_follow_what_the_coupler_has_itself(
    own: dict[str, dict[str, str]] | None, subs: list[int]
) -> None:
    description = with_modules(DI8, DI8, content=coupler(own))
    assert elements(description) == subs
    assert description.number(0x6000, 0) == subs[-1]


def test_an_element_says_what_the_module_says_and_has_a_name_of_its_own() -> None:
    description = with_modules(DI8, DI8)
    first, second = (description.entry(0x6000, sub) for sub in (1, 2))
    assert first and second
    assert (first.name, second.name) == ("Digital inputs 1", "Digital inputs 2")
    assert first.pdo_mappable and not first.access.writable
    assert first.line > 0


def test_a_fixed_object_is_there_once_and_only_with_its_module() -> None:
    assert with_modules(AI2, AI2).entry(0x6423) is not None
    assert with_modules(DI8).entry(0x6423) is None
    assert not [one for one in with_modules(AI2).findings if "6423" in str(one.said)]


@pytest.mark.parametrize("name", ["AC-DI8", "ac-di8", " AC - DI8 ", "8 digital inputs", "1"])
def test_a_module_is_named_by_its_order_code_its_name_or_its_number(name: str) -> None:
    assert with_modules(name).plugged == (1,)


def test_a_module_that_the_file_does_not_have_is_named_with_those_that_it_has() -> None:
    with pytest.raises(FileFaults) as caught:
        with_modules("AC-DI16")
    (fault,) = caught.value.faults
    assert fault.message == "the device has no module AC-DI16"
    assert "1 (AC-DI8, 8 digital inputs), 2 (AC-DI4" in fault.hint


def test_a_device_without_modules_says_so() -> None:
    with pytest.raises(FileFaults) as caught:
        with_modules(DI8, content=coupler(modules=()))
    assert caught.value.faults[0].hint == "it has no modules"


def test_what_the_file_itself_connects_is_plugged_in() -> None:
    description = read_device(coupler(more=connected(1, 3, 1)), "coupler.dcf")
    assert description.plugged == (1, 3, 1)
    assert elements(description) == [1, 2]
    assert with_modules(DI8, content=coupler(more=connected(1, 1, 1))).plugged == (1,), "the site counts"


def test_a_file_that_was_made_for_its_modules_has_their_elements_already() -> None:
    description = read_device(coupler(ONBOARD, more=connected(1, 1)), "coupler.dcf")
    assert elements(description) == [1]


def test_a_module_that_is_connected_and_not_described_is_told() -> None:
    description = read_device(coupler(more=connected(1, 9)), "coupler.dcf")
    assert description.plugged == (1,)
    assert "module 9 is connected and not described" in [str(one.said) for one in description.findings]


def test_that_none_is_plugged_in_is_told() -> None:
    description = read_device(coupler(), "coupler.eds")
    assert [str(one.said) for one in description.findings if "modules" in str(one.said)] == [
        f"{len(MODULES)} modules are described and none is plugged in: their objects are missing"
    ]
    assert [one.order_code for one in description.modules] == [DI8, DI4, DO8, AI2]


@pytest.mark.parametrize("count", ["", "many", "-1", "1;2;3"])
def test_a_count_that_is_none_is_told_and_left_out(count: str) -> None:
    one = module(1, "Inputs", "IN", extension("6000", INPUTS, count))
    description = with_modules("IN", content=coupler(modules=(one,)))
    assert elements(description) == []
    assert [str(one.said) for one in description.findings if "its elements are left out" in str(one.said)]


@pytest.mark.landing
def test_no_more_elements_than_any_device_has_are_made() -> None:
    one = module(1, "Inputs", "IN", extension("6000", INPUTS, "254", more="ObjExtend=254"))
    description = with_modules(*["IN"] * 60, content=coupler(modules=(one,)))
    assert len(description.extended) == 10_000
    assert "the modules have too many elements: left out" in [str(one.said) for one in description.findings]


@pytest.mark.parametrize("change", [str.lower, str.upper], ids=["lower", "upper"])
def test_the_names_of_sections_and_keys_may_be_spelt_in_any_way(change: object) -> None:
    text = coupler(EMPTY).decode()
    lines = [change(line) if line.startswith("[") else line for line in text.splitlines()]  # type: ignore[operator]
    assert elements(with_modules(DI8, DI4, content="\n".join(lines).encode())) == [1, 2]


def test_the_file_that_the_docs_show_is_this_one() -> None:
    assert (DEVICES / "coupler.eds").read_bytes() == coupler(EMPTY)


def test_an_xdd_has_no_modules_here() -> None:
    with pytest.raises(FileFaults) as caught:
        read_device(b"<?xml version='1.0'?><ISO15745ProfileContainer/>", "coupler.xdd", [DI8])
    assert caught.value.faults[0].message == "an XDD describes no modules here"
