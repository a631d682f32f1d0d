"""Whoever leaves something behind is failed: what ``tests/support/leaks.py`` promises."""

from __future__ import annotations

import pytest

from tests.support.process import REPOSITORY, called

CONFTEST = f"""
import os, sys
sys.path.insert(0, {str(REPOSITORY)!r})
from tests.support import leaks
from tests.support.leaks import leaves_nothing, module_leaves_nothing
leaks.PATIENCE_S = 0.3
os.environ["COLUMNS"] = "400"  # a line is not cut
"""
TESTS = """
import asyncio, socket, subprocess, threading
import pytest

kept = []

def test_thread():
    stop = threading.Event()
    kept.append(stop)
    threading.Thread(target=stop.wait, name="forgotten", daemon=True).start()

def test_process():
    kept.append(subprocess.Popen(["sleep", "20"]))

def test_socket():
    kept.append(socket.socket())

def test_task():
    async def forget():
        kept.append(asyncio.create_task(asyncio.sleep(60), name="forgotten task"))
    asyncio.run(forget())

def test_nothing():
    async def wait():
        await asyncio.to_thread(int)
    with socket.socket():
        subprocess.run(["true"], check=True)
    thread = threading.Thread(target=int)
    thread.start()
    asyncio.run(wait())

@pytest.fixture(scope="module")
def server():
    with socket.socket() as server:
        yield server

def test_what_its_module_has(server):
    pass

@pytest.fixture(scope="module")
def forgetful():
    kept.append(socket.socket())

def test_what_its_module_forgets(forgetful):
    for one in kept:
        if isinstance(one, subprocess.Popen):
            one.kill()
            one.wait()
"""
LEFT = {
    "test_thread": "thread forgotten",
    "test_process": "sleep 20",
    "test_socket": "AF_INET",
    "test_task": "task forgotten task",
    "test_what_its_module_forgets": "AF_INET",
}


@pytest.fixture(scope="module")
def told(tmp_path_factory: pytest.TempPathFactory) -> str:
    folder = tmp_path_factory.mktemp("leaks")
    (folder / "conftest.py").write_text(CONFTEST, encoding="utf-8")
    (folder / "test_of_leaks.py").write_text(TESTS, encoding="utf-8")
    return called("-m", "pytest", "-p", "no:cacheprovider", "--rootdir", str(folder), str(folder)).stdout


@pytest.mark.landing(5)
@pytest.mark.parametrize("name", LEFT)
def test_what_is_left_is_told_of_the_test_that_leaves_it(told: str, name: str) -> None:
    [line] = [
        line for line in told.splitlines() if line.startswith("ERROR") and line.split(" - ")[0].endswith(name)
    ]
    assert LEFT[name] in line


def test_who_leaves_nothing_passes(told: str) -> None:
    assert "7 passed, 5 errors" in told
