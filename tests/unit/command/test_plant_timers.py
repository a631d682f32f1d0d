"""When the plant wants to be asked again: no timer is late because not all are looked at each time."""

from __future__ import annotations

import pytest

from bridge.command import Action, Plant, Request, Write
from bridge.command.drive_link import NodeState
from bridge.image import Quality, Value
from tests.support import sites
from tests.support.node_states import hand_over, node_goes, run_timers
from tests.support.rig import PLC, READY
from tests.unit.command.test_plant import SITE, Hall

QUIET = SITE.replace("fieldbus_timeout_ms = 200", "fieldbus_timeout_ms = 0")


def plant_of(nodes: int) -> Plant:
    """Two drives on each."""
    drives = [sites.drive(slot, "modbus", 0, "") for slot in ("fu1", "fu2")]
    all_of_them = [sites.node(*drives, name=f"n{n}", node_id=n) for n in range(1, nodes + 1)]
    return sites.plant_of(sites.site(sites.bus(*all_of_them), sites.modbus()))


@pytest.mark.landing(2)
@pytest.mark.parametrize("nodes", [1, 30])
def test_a_drive_that_was_heard_again_is_stale_at_its_next_deadline(nodes: int) -> None:
    plant = plant_of(nodes)
    drive = plant.drives["n1/fu1"]
    drive.channel.link.pdo_deadline_s = 0.1
    node_goes(plant, plant.nodes["n1"], NodeState.OPERATIONAL, 100.0)
    drive.on_process_data((READY, 0, 0, 0), 100.0)
    run_timers(plant, 100.1)
    assert drive.quality is Quality.STALE
    run_timers(plant, 100.2)
    drive.on_unchanged_data(100.2)
    assert drive.quality is Quality.GOOD
    now, times = 100.2, 0
    while (due := plant.next_deadline(now)) is not None and due <= 100.31:
        now = max(now, due)
        run_timers(plant, now)
        times += 1
        assert drive.quality is (Quality.GOOD if now < 100.3 else Quality.STALE)
    assert drive.quality is Quality.STALE
    assert times <= 3, "and it is not asked again and again"


@pytest.fixture
def quiet() -> Hall:
    """An enabled drive. No time-out runs, and it sends changes alone."""
    hall = Hall(QUIET)
    hall.run()
    hall.drive.channel.link.pdo_deadline_s = None
    for drive in hall.plant.drives.values():
        hand_over(hall.plant, drive, hall.now)
    hall.at(hall.now)
    return hall


def test_what_a_drive_says_may_bring_a_deadline_forward() -> None:
    """It has taken the last position, and gets the next one now: it has 1 s to take that."""
    mapping = "cia402/profile-position"
    node = sites.node(sites.drive("drive", "modbus", 0, ""), mapping=mapping)
    plant = sites.plant_of(sites.site(sites.bus(node)), mapping)
    (drive,) = plant.drives.values()
    ready, enabled, taken = 0x0231, 0x0237, 0x1000
    node_goes(plant, plant.nodes["conveyor"], NodeState.OPERATIONAL, 100.0)

    def says(word: int) -> None:
        drive.on_process_data([word, *drive.words[1:]], 100.0)

    def write(**values: Value) -> None:
        plant.submit(Request(PLC, drive.name, Write(values)), 100.0, lambda outcome: None)

    says(ready)
    write(control_word=0x0006)
    write(control_word=0x002F)
    says(enabled | taken)
    write(position=5000)
    hand_over(plant, drive, 100.0)
    before = plant.next_deadline(100.0)
    assert before is None
    says(enabled)
    assert plant.next_deadline(100.0) == 101.0


def test_a_stop_that_is_handed_over_begins_its_time(quiet: Hall) -> None:
    quiet.submit(Action.STOP)
    before = quiet.plant.next_deadline(quiet.now)
    hand_over(quiet.plant, quiet.drive, quiet.now)
    after = quiet.plant.next_deadline(quiet.now)
    assert before is None
    assert after is not None
    assert after > quiet.now
