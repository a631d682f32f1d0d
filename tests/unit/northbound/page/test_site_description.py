"""The description of a site for the page: every point by the names of its place and nature."""

from __future__ import annotations

from bridge.northbound.page.site_description import described
from tests.support import sites

DRIVE, BUS = "conveyor/fu1", "bus/can0"
_SITE = sites.site(
    sites.bus(sites.node(sites.drive("fu1", "lease", 1000), sites.drive("fu2", "lease", 1000)))
)


def test_the_site_is_described_by_the_names_of_its_points() -> None:
    plant = sites.plant_of(_SITE)
    told = described(plant.image, plant.catalogue)
    assert [one["name"] for one in told["drives"]] == [DRIVE, "conveyor/fu2"]
    assert all(one["main"] == "frequency" and one["stops_in"] == "ready" for one in told["drives"])
    assert {one["reaction"]["code"] for one in told["drives"]} == {"reaction.disable_voltage"}
    names = {f"{place}/{leaf}" for place, kind in told["places"].items() for leaf in told["natures"][kind]}
    assert names == {point.name for point in plant.image.points}
    for drive in told["drives"]:
        assert f"actual/{drive['main']}" in told["natures"][told["places"][drive["name"]]]
    assert told["natures"][told["places"][DRIVE]]["parameter/p509"]["states"] == {
        "3": "system bus",
        "6": "CANopen",
    }
    assert all(told["natures"].count(one) == 1 for one in told["natures"]), "each kind is described once"
