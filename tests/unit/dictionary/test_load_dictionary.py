"""Object dictionary for canopen by a name: a family, a mapping file, a device description."""

from __future__ import annotations

import pytest

from bridge.base.errors import FileFaults
from bridge.dictionary import load_dictionary


@pytest.mark.parametrize("name", ["nord/none", "none.eds", "none.toml", "nord/drive"])
def test_what_is_not_there_is_named(name: str) -> None:
    with pytest.raises(FileFaults, match=name.removesuffix(".toml")):
        load_dictionary(name)
