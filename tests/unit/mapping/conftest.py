"""The folder of mappings that tests of one file beside others share."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support.mapping_folder import BASE, Folder


@pytest.fixture
def folder(tmp_path: Path) -> Folder:
    folder = Folder(tmp_path)
    folder.add("acme/base", BASE)
    return folder
