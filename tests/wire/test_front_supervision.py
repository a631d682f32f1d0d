"""What becomes of a front that does not start, does not come up, or hangs."""

from __future__ import annotations

import asyncio
import contextlib
import gc
import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from pymodbus.client import ModbusTcpClient

from bridge.base.errors import OperationFailed
from bridge.base.notify import Notifier
from bridge.service import front_process, parts
from bridge.service.front_process import Front, give_signs
from tests.support import sites
from tests.support.process import REPOSITORY, Process, drivebridge, running, until
from tests.support.zenoh_peer import until as until_in_loop
from tests.wire.test_fronts import children, ports, start, starts, wait_for_front

__all__ = ["ports"]
HUNG_S = 6.0
NOISE_S = 10.0


class Spawns:
    """Stands for ``python -m bridge``: each start is what ``next`` says."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, *scripts: str | Exception) -> None:
        self.count = 0
        self._scripts = scripts
        self._spawn = asyncio.create_subprocess_exec
        monkeypatch.setattr(front_process.asyncio, "create_subprocess_exec", self)

    async def __call__(self, *arguments: str, **options: object) -> asyncio.subprocess.Process:
        script = self._scripts[min(self.count, len(self._scripts) - 1)]
        self.count += 1
        if isinstance(script, Exception):
            raise script
        return await self._spawn(sys.executable, "-c", script, *arguments, **options)  # type: ignore[arg-type]


class Kept:
    """A front that the parts of a service keep going."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, front: Front) -> None:
        monkeypatch.setattr(parts, "_FIRST_PAUSE_S", 0.01)
        self.plant = sites.plant_of(sites.site(sites.bus(sites.node(sites.drive("fu1", "modbus", 1000)))))
        self.events: list[str] = []
        self.plant.on_event(lambda event: self.events.append(event.message))
        self.supervisor = parts.Supervisor(self.plant, Notifier(), time.monotonic, "1 drive on 1 bus")
        self.supervisor.expect([front])
        self.running = asyncio.create_task(self.supervisor.keep(front))

    @property
    def failing(self) -> object:
        return self.plant.image.read("bridge/fronts_failing").value

    async def end(self) -> None:
        assert not self.running.done()
        self.running.cancel()
        await asyncio.gather(self.running, return_exceptions=True)


async def test_a_machine_without_processes_left_does_not_end_the_service(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    spawns = Spawns(monkeypatch, BlockingIOError(11, "Resource temporarily unavailable"))
    kept = Kept(monkeypatch, Front("opcua", [], watched=True))
    await asyncio.sleep(0.5)
    assert 3 <= spawns.count <= 7, "it backs off"
    await kept.end()
    [told] = kept.events
    assert told.startswith("the opcua front cannot be started: ")
    assert "temporarily unavailable" in told


@pytest.mark.parametrize("code", [1, 2, 3])
async def test_a_front_that_fails_at_each_start_is_tried_again_and_comes_back(
    monkeypatch: pytest.MonkeyPatch, code: int
) -> None:
    fails = f"import os, sys; os.write(int(sys.argv[-1]), b'!no room'); raise SystemExit({code})"
    serves = "import os, sys, time; os.write(int(sys.argv[-1]), b'.'); time.sleep(60)"
    spawns = Spawns(monkeypatch, fails, fails, fails, serves)
    kept = Kept(monkeypatch, Front("opcua", [], watched=True))
    await asyncio.wait_for(kept.supervisor.all_known(), 10)
    assert kept.failing == f"opcua: ended (exit status {code}): no room"
    assert kept.supervisor.status == f"1 drive on 1 bus; not served: {kept.failing}"
    await until_in_loop(lambda: not kept.failing, "it serves")
    assert spawns.count == 4
    assert kept.supervisor.status == "1 drive on 1 bus"
    await kept.end()
    assert len(kept.events) == 2, "told once a minute"
    assert kept.events[1] == "the opcua front serves again"


async def test_one_that_does_not_stay_up_is_told_once_a_minute(monkeypatch: pytest.MonkeyPatch) -> None:
    once_alive = "import os, sys; os.write(int(sys.argv[-1]), b'.'); raise SystemExit(3)"
    spawns = Spawns(monkeypatch, once_alive)
    kept = Kept(monkeypatch, Front("opcua", [], watched=True))
    await until_in_loop(lambda: spawns.count >= 5, "some more starts")
    await kept.end()
    assert len(kept.events) <= 2


async def test_a_front_that_grows_too_large_is_killed(monkeypatch: pytest.MonkeyPatch) -> None:
    grows = (
        "import os, sys, time; os.write(int(sys.argv[-1]), b'.'); kept = b'x' * (300 << 20); time.sleep(60)"
    )
    Spawns(monkeypatch, grows)
    monkeypatch.setattr(front_process, "SIGN_PERIOD_S", 0.05)
    monkeypatch.setattr(front_process, "_SILENT_LOOKS", 1000)
    how = await Front("zenoh", [], watched=True, most_mb=200).run_once(lambda: None)
    assert re.fullmatch(r"held (2|3)\d\d MB of memory, more than 200 MB, and was killed", str(how)), how


def as_front(script: str) -> subprocess.CompletedProcess[str]:
    command = [
        sys.executable,
        "-c",
        f"from bridge.service.front_process import become_front, limit_memory; {script}",
    ]
    return subprocess.run(command, capture_output=True, text=True, check=False, cwd=REPOSITORY)


def test_a_front_that_grows_at_once_is_refused_the_memory() -> None:
    assert as_front("limit_memory(200); kept = b'x' * (300 << 20); print('has it')").stdout == "has it\n"
    refused = as_front("limit_memory(200); kept = b'x' * (500 << 20); print('has it')")
    assert refused.returncode == 1 and "MemoryError" in refused.stderr


def test_what_the_kernel_kills_where_memory_is_short_is_a_front() -> None:
    look = "print(open('/proc/self/oom_score_adj').read(), os.nice(0))"
    here = int(Path("/proc/self/oom_score_adj").read_text()), os.nice(0)
    adjusted, nice = as_front(f"import os; become_front(0); {look}").stdout.split()
    assert int(adjusted) == max(500, here[0])
    assert int(nice) == min(19, here[1] + 5), "ahead of it comes who stops drives"
    _, nice = as_front(f"import os; become_front(0, is_prompt=True); {look}").stdout.split()
    assert int(nice) == here[1], "its clients wait for each answer"


async def test_looking_after_a_front_for_long_keeps_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """A look a second, for years."""
    looks: list[int] = []
    Spawns(monkeypatch, "import time; time.sleep(60)")
    monkeypatch.setattr(front_process, "SIGN_PERIOD_S", 0.001)
    running_front = asyncio.create_task(Front("opcua", []).run_once(lambda: looks.append(len(looks))))
    await until_in_loop(lambda: len(looks) >= 50, "it has been looked after for a while")
    gc.collect()
    before = len(gc.get_objects())
    await until_in_loop(lambda: len(looks) >= 550, "it has been looked after for longer")
    gc.collect()
    grown = len(gc.get_objects()) - before
    running_front.cancel()
    with contextlib.suppress(asyncio.CancelledError):
        await running_front
    assert grown < 50


async def test_a_front_without_listener_ends() -> None:
    end, mouth = os.pipe()
    signs = asyncio.create_task(give_signs(mouth))
    await asyncio.sleep(0.05)
    assert os.read(end, 10) == b"."
    os.close(end)
    with pytest.raises(OperationFailed):
        await asyncio.wait_for(signs, 5)
    os.close(mouth)


@pytest.mark.landing
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


@pytest.mark.landing
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


class Notices:
    """What a process tells systemd (sd_notify(3)), in order."""

    def __init__(self, folder: Path) -> None:
        self.said: list[str] = []
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.bind(str(folder / "notify"))
        self._socket.setblocking(False)

    def read(self) -> list[str]:
        with contextlib.suppress(BlockingIOError):
            while True:
                self.said += self._socket.recv(4096).decode().split("\n")
        return self.said

    def until(self, text: str, limit_s: float = 40.0) -> None:
        until(lambda: any(text in line for line in self.read()), limit_s, text)


@pytest.fixture
def notices(tmp_path: Path) -> Iterator[Notices]:
    """Of what ``seen_and_notified`` starts."""
    notices = Notices(tmp_path)
    yield notices
    notices._socket.close()


@contextlib.contextmanager
def seen_and_notified(folder: Path, path: Path) -> Iterator[Process]:
    script = str(REPOSITORY / "tests" / "wire" / "peers" / "seen_bridge.py")
    command = (sys.executable, script, str(folder / "words"), "run", str(path))
    with running(folder, "run", "env", f"NOTIFY_SOCKET={folder}/notify", *command) as process:
        yield process


def test_a_taken_opcua_port_ends_a_run_that_needs_all_before_the_bus_is_opened(
    tmp_path: Path, ports: tuple[int, int], notices: Notices
) -> None:
    path = start(tmp_path, ports)
    text = path.read_text("utf-8").replace("[site]", "[site]\nall_ports = true", 1)
    path.write_text(text, "utf-8")
    with socket.create_server(("127.0.0.1", ports[1])), seen_and_notified(tmp_path, path) as run:
        assert run.popen.wait(30) == 3
        told = [line for line in run.output().splitlines() if str(ports[1]) in line]
        assert len(told) == 1, run.output()
        assert "opcua.listen" in told[0]
        assert "Traceback" not in run.output()
    assert not (tmp_path / "words").read_text(), "nothing was sent on the bus"
    assert not [line for line in notices.read() if line.startswith("READY")]


def test_a_state_folder_that_cannot_be_written_ends_run_before_the_bus_is_opened(
    tmp_path: Path, ports: tuple[int, int], notices: Notices
) -> None:
    path = start(tmp_path, ports)
    (tmp_path / "state").write_text("a file", "utf-8")
    with seen_and_notified(tmp_path, path) as run:
        assert run.popen.wait(30) == 3
        assert "state_dir" in run.output()
        assert "Traceback" not in run.output()
    assert not (tmp_path / "words").read_text()


@pytest.mark.landing
def test_ready_is_who_serves_and_a_front_that_fails_later_is_in_the_status_line(
    tmp_path: Path, ports: tuple[int, int], notices: Notices
) -> None:
    path = start(tmp_path, ports)
    key = tmp_path / "state" / "certificates" / "own" / "own_key.pem"
    with seen_and_notified(tmp_path, path) as run:
        notices.until("READY=1")
        assert starts(run) == 1, "OPC UA is served"
        assert "STATUS=1 drive on 1 bus" in notices.read()
        [front] = children(run.pid)
        # It cannot come up again: its key is damaged.
        content = key.read_bytes()
        key.write_text("-----BEGIN")
        os.kill(front, signal.SIGKILL)
        notices.until("STATUS=1 drive on 1 bus; not served: opcua: ended (exit status 2): ")
        plc = ModbusTcpClient("127.0.0.1", port=ports[0])
        with plc:
            assert not plc.write_registers(0, [0x047E, 0], device_id=1).isError(), "Modbus serves"
        key.write_bytes(content)
        notices.said.clear()
        until(lambda: starts(run) == 2, 40.0, "it is back")
        until(lambda: notices.read()[-1:] == ["STATUS=1 drive on 1 bus"], 5.0, "which is said")
        assert run.popen.poll() is None
        assert "hung" not in run.output()


@pytest.mark.landing
def test_a_port_is_ours_while_its_front_is_away(tmp_path: Path, ports: tuple[int, int]) -> None:
    path = start(tmp_path, ports)
    with drivebridge(tmp_path, "run", "run", str(path), notify=True) as bridge:
        bridge.wait_ready()
        [front] = children(bridge.pid)
        os.kill(front, signal.SIGKILL)
        with pytest.raises(OSError, match="in use"):
            socket.create_server(("127.0.0.1", ports[1]))
        until(lambda: starts(bridge) == 2, 40.0, "another one serves")
