"""What becomes of a front that does not start, does not come up, or hangs."""

from __future__ import annotations

import asyncio
import os
import signal
import socket
import sys
import time
from pathlib import Path

import pytest

from bridge import fronts
from bridge.errors import OperationFailed
from bridge.fronts import Front, FrontRefused, give_signs
from tests.support.process import drivebridge, until
from tests.support.zenoh_peer import until as until_in_loop
from tests.wire.test_fronts import children, ports, start, starts, wait_for_front

__all__ = ["ports"]
HUNG_S = 5.0
NOISE_S = 10.0


class Spawns:
    """Stands for ``python -m bridge``: each start is what ``next`` says."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, *scripts: str | Exception) -> None:
        self.count = 0
        self._scripts = scripts
        self._spawn = asyncio.create_subprocess_exec
        monkeypatch.setattr(fronts.asyncio, "create_subprocess_exec", self)

    async def __call__(self, *arguments: str, **options: object) -> asyncio.subprocess.Process:
        script = self._scripts[min(self.count, len(self._scripts) - 1)]
        self.count += 1
        if isinstance(script, Exception):
            raise script
        return await self._spawn(sys.executable, "-c", script, *arguments, **options)  # type: ignore[arg-type]


async def test_a_machine_without_processes_left_does_not_end_the_service(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(fronts, "_FIRST_PAUSE_S", 0.01)
    spawns = Spawns(monkeypatch, BlockingIOError(11, "Resource temporarily unavailable"))
    running = asyncio.create_task(Front("opcua", [], watched=True).run())
    await asyncio.sleep(0.5)
    assert not running.done()
    assert 3 <= spawns.count <= 7, "it backs off"
    running.cancel()
    await asyncio.gather(running, return_exceptions=True)
    [record] = caplog.records
    assert record.message.startswith("the opcua front cannot be started: ")
    assert "temporarily unavailable" in record.message


@pytest.mark.parametrize("code", [2, 3])
async def test_a_front_that_never_came_up_ends_the_service_with_its_exit_code(
    monkeypatch: pytest.MonkeyPatch, code: int
) -> None:
    Spawns(monkeypatch, f"raise SystemExit({code})")
    with pytest.raises(FrontRefused) as caught:
        await asyncio.wait_for(Front("opcua", [], watched=True).run(), 10)
    assert caught.value.exit_code == code
    assert str(caught.value) == "", "the front has told why"


async def test_one_that_had_come_up_is_started_again_whatever_its_exit_code(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(fronts, "_FIRST_PAUSE_S", 0.01)
    once_alive = "import os, sys; os.write(int(sys.argv[-1]), b'.'); raise SystemExit(3)"
    spawns = Spawns(monkeypatch, once_alive, "raise SystemExit(3)")
    running = asyncio.create_task(Front("opcua", [], watched=True).run())
    await until_in_loop(lambda: spawns.count >= 4 or running.done(), "some more starts")
    assert not running.done()
    running.cancel()
    await asyncio.gather(running, return_exceptions=True)
    assert len(caplog.records) == 1, "told once a minute"


async def test_a_front_without_listener_ends() -> None:
    end, mouth = os.pipe()
    signs = asyncio.create_task(give_signs(mouth))
    await asyncio.sleep(0.05)
    assert os.read(end, 10) == b"."
    os.close(end)
    with pytest.raises(OperationFailed):
        await asyncio.wait_for(signs, 5)
    os.close(mouth)


def test_a_hung_front_is_killed_and_comes_back(tmp_path: Path, ports: tuple[int, int]) -> None:
    path = start(tmp_path, ports)
    with drivebridge(tmp_path, "run", "run", str(path), notify=True) as bridge:
        bridge.wait_ready()
        wait_for_front(bridge)
        [front] = children(bridge.pid)
        time.sleep(2.5)  # some signs of life
        os.kill(front, signal.SIGSTOP)
        until(lambda: starts(bridge) == 2, HUNG_S + NOISE_S, "another one serves")
        assert not Path(f"/proc/{front}").exists()
        assert bridge.output().count("gave no sign of life for 5 s and was killed") == 1


def test_a_front_is_not_killed_for_a_pause_of_the_bus_process(tmp_path: Path, ports: tuple[int, int]) -> None:
    path = start(tmp_path, ports)
    with drivebridge(tmp_path, "run", "run", str(path), notify=True) as bridge:
        bridge.wait_ready()
        wait_for_front(bridge)
        [front] = children(bridge.pid)
        time.sleep(1.5)
        for number in (signal.SIGSTOP, signal.SIGCONT):
            os.kill(front, number)
            bridge.signal(number)
            time.sleep(6.5 if number == signal.SIGSTOP else 3.0)
        assert children(bridge.pid) == [front]


def test_a_taken_opcua_port_ends_run_with_exit_3_and_one_sentence(
    tmp_path: Path, ports: tuple[int, int]
) -> None:
    path = start(tmp_path, ports)
    with socket.create_server(("127.0.0.1", ports[1])), drivebridge(tmp_path, "run", "run", str(path)) as run:
        assert run.popen.wait(30) == 3
        told = [line for line in run.output().splitlines() if str(ports[1]) in line]
        assert len(told) == 1, run.output()
        assert "Traceback" not in run.output()


def test_a_state_folder_that_cannot_be_written_ends_run_with_exit_3(
    tmp_path: Path, ports: tuple[int, int]
) -> None:
    path = start(tmp_path, ports)
    (tmp_path / "state").write_text("a file", "utf-8")
    with drivebridge(tmp_path, "run", "run", str(path)) as run:
        assert run.popen.wait(30) == 3
        assert "state_dir" in run.output()
        assert "Traceback" not in run.output()
