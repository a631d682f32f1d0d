"""Parameters are changed, backed up, compared and put back on the page."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from tests.browser.hands import (
    asked,
    parameter,
    to,
)
from tests.support.desk import Desk
from tests.wire.test_page import DRIVE

EDS = """[FileInfo]
FileName=factory.eds
[DeviceInfo]
VendorName=somebody
[ManufacturerObjects]
SupportedObjects=1
1=0x2066
[2066]
ParameterName=acceleration time
ObjectType=0x8
SubNumber=2
[2066sub0]
ParameterName=entries
ObjectType=0x7
DataType=0x0005
AccessType=ro
DefaultValue=1
[2066sub1]
ParameterName=set 1
ObjectType=0x7
DataType=0x0003
AccessType=rw
DefaultValue=350
"""
"""Of P102.1 the factory setting 3.5 s."""


def change(page: Page, name: str, value: str) -> None:
    page.get_by_role("button", name=f"Change {name}", exact=True).click()
    page.get_by_label(f"New value of {name}").fill(value)
    page.get_by_role("button", name="Write", exact=True).click()


def is_quiet(page: Page, found: list[Any]) -> bool:
    """Whether nothing more is asked once what is on its way has been answered."""
    page.wait_for_timeout(150)
    count = len(found)
    page.wait_for_timeout(400)
    return len(found) == count


def test_a_parameter_is_found_changed_and_put_back_from_a_backup(desk: Desk, tmp_path: Path) -> None:
    with desk.sits("engineer") as page:
        to(page, f"parameters/{DRIVE}")
        expect(parameter(page, "P102.1")).to_contain_text("2\u202fs")
        with page.expect_download() as download:
            page.get_by_role("button", name="Back up to a file").click()
        file = tmp_path / download.value.suggested_filename
        download.value.save_as(file)
        assert '"P102.1" = 2.0' in file.read_text(encoding="utf-8")
        page.get_by_role("searchbox").fill("acceleration")
        change(page, "P102.1", "7.5")
        expect(page.locator(".editor")).to_contain_text("read back: 7.5")
        expect(page.locator(".editor")).to_contain_text("of 100,000")
        page.get_by_label("New value of P102.1").fill("321")
        page.get_by_role("button", name="Write", exact=True).click()
        assert not page.evaluate("document.querySelector('#value').validity.valid")
        page.get_by_label("Compare with").select_option("file")
        page.locator('input[type="file"]').set_input_files(file)
        page.get_by_role("button", name="Compare", exact=True).click()
        expect(page.locator(".differences tbody tr")).to_have_count(1)
        expect(page.locator(".differences")).to_contain_text("7.5")
        page.get_by_role("button", name="Write this one to the drive").click()
        expect(page.get_by_text("1 parameter written and read back.")).to_be_visible()
        expect(parameter(page, "P102.1")).to_contain_text("2\u202fs")


def test_the_makers_words_are_german_on_a_german_page(desk: Desk) -> None:
    with desk.sits("engineer") as page:
        to(page, f"parameters/{DRIVE}")
        expect(parameter(page, "P509")).to_contain_text("source of the control word")
        page.get_by_role("button", name="Deutsch").click()
        page.get_by_role("searchbox").fill("Systembus")
        expect(parameter(page, "P509")).to_contain_text("Quelle Steuerwort")
        page.get_by_role("button", name="P509 ändern", exact=True).click()
        expect(page.locator(".editor")).to_contain_text("3 (Systembus), 6 (CANopen)")
        # The drive takes the numbers that the manual does not explain, too.
        page.locator("#value").fill("10")
        assert page.evaluate("document.querySelector('#value').validity.valid")
        page.locator("#value").fill("11")
        assert not page.evaluate("document.querySelector('#value').validity.valid")


@pytest.mark.landing
def test_a_drive_is_compared_with_a_makers_file_and_a_wrong_file_is_told_by_line(
    desk: Desk, tmp_path: Path
) -> None:
    with desk.sits("operator") as page:
        to(page, f"parameters/{DRIVE}")
        page.get_by_label("Compare with").select_option("file")
        (tmp_path / "factory.eds").write_text(EDS, encoding="ascii")
        page.locator('input[type="file"]').set_input_files(tmp_path / "factory.eds")
        page.get_by_role("button", name="Compare", exact=True).click()
        expect(page.locator(".differences tbody tr")).to_have_count(1)
        expect(page.locator(".differences")).to_contain_text("3.5")
        expect(page.get_by_role("button", name="Write this one to the drive")).to_have_count(0)
        (tmp_path / "wrong.toml").write_text("format = 9\n", encoding="ascii")
        page.locator('input[type="file"]').set_input_files(tmp_path / "wrong.toml")
        page.get_by_role("button", name="Compare", exact=True).click()
        expect(page.get_by_role("alert")).to_contain_text("wrong.toml:1: format: must be 3")
        page.get_by_role("button", name="Deutsch").click()
        page.get_by_role("button", name="Vergleichen", exact=True).click()
        expect(page.get_by_role("alert")).to_contain_text("wrong.toml:1: format: muss 3 sein")
        desk.complaints[-2:] = []  # the browser's own lines on the answers 422


@pytest.mark.landing
def test_a_drive_is_compared_with_its_like_until_that_is_stopped_or_left(bench: Desk) -> None:
    with bench.sits("engineer") as page:
        read = asked(page, "read_parameter")
        to(page, "parameters/a/fu1")
        options = page.locator("#source option")
        files = ["factory settings (none known)", "a backup, EDS or XDD file"]
        expect(options).to_have_text([*files, "a/fu2", "b/fu1", "b/fu2"])
        expect(page.locator("td.value", has_text="…")).to_have_count(0)
        page.get_by_label("Compare with").select_option("drive b/fu1")
        compare = page.get_by_role("button", name="Compare", exact=True)
        compare.click()
        page.get_by_role("button", name="Stop reading").click()
        expect(page.get_by_role("status").filter(has_text="Ended before")).to_have_count(1)
        assert is_quiet(page, read)
        compare.click()
        expect(page.get_by_text("Reading b/fu1: 1")).to_be_visible()
        page.get_by_role("link", name="Plant", exact=True).click()
        assert is_quiet(page, read)
        to(page, "parameters/a/fu1")
        page.get_by_label("Compare with").select_option("drive b/fu1")
        compare.click()
        expect(page.get_by_text("0 parameters differ from b/fu1")).to_be_visible()


def test_a_double_click_writes_once(bench: Desk) -> None:
    with bench.sits("engineer") as page:
        written = asked(page, "write_parameter")
        to(page, "parameters/a/fu1")
        expect(parameter(page, "P102.1")).to_contain_text("2\u202fs")
        page.get_by_role("button", name="Change P102.1", exact=True).click()
        page.get_by_label("New value of P102.1").fill("2.01")
        page.get_by_role("button", name="Write", exact=True).dblclick()
        expect(page.locator(".editor")).to_contain_text("read back: 2.01")
        page.wait_for_timeout(300)
        assert written == [{"parameter": "P102.1", "value": 2.01}]
        page.get_by_role("button", name="Deutsch").click()
        expect(parameter(page, "P102.1")).to_contain_text("2,01\u202fs")
        expect(parameter(page, "P105.1")).to_contain_text("0,1 … 400 Hz")
