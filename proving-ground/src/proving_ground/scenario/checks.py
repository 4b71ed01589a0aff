"""Names that one table of a scenario takes from another: zones in buildings, faults of soldiers, floors."""

from collections.abc import Collection

from proving_ground.scenario.cast import Cast
from proving_ground.scenario.faulty import ScenarioFault
from proving_ground.scenario.schema.faults import Fault, NetParted, RadioGone, SensorFault
from proving_ground.scenario.schema.people import Kit
from proving_ground.scenario.schema.scenario import ScenarioFile
from proving_ground.scenario.site import OUTSIDE, Site
from proving_ground.scenario.site_builder import known


def check_names(file: ScenarioFile, site: Site, cast: Cast) -> None:
    """ScenarioFault at the first name that nothing has."""
    buildings = {building.name for building in file.site.buildings}
    for index, zone in enumerate(file.zones):
        key = f"zones[{index}]"
        if zone.building is not None:
            known(zone.building, buildings, f"{key}.building", "building")
        if zone.room is not None:
            known(zone.room, site.spaces.keys() - {OUTSIDE}, f"{key}.room", "room")
        _check_floors(zone.floors, site, f"{key}.floors")
    for index, body in enumerate(file.magnetic):
        _check_floors([body.floor], site, f"magnetic[{index}].floor")
    for index, fault in enumerate(file.faults):
        _check_fault(fault, cast, f"faults[{index}]")


def _check_floors(levels: Collection[int], site: Site, key: str) -> None:
    for level in levels:
        if level not in site.heights_m:
            raise ScenarioFault(key, f"there is no floor {level}; add it to site.floors")


def _check_fault(fault: Fault, cast: Cast, key: str) -> None:
    kits = {soldier.id: soldier.kit for soldier in cast.soldiers}
    targets = set(kits)
    if not isinstance(fault, SensorFault):
        targets |= {post.id for post in cast.posts}
    nets = {name: members for name, _, members in cast.nets}
    if isinstance(fault, RadioGone):
        targets |= set(nets)
    if isinstance(fault, NetParted):
        targets = set(nets)
    known(fault.target, targets, f"{key}.target", "soldier" if isinstance(fault, SensorFault) else "target")
    if isinstance(fault, SensorFault):
        known(fault.sensor, sensors_of(kits[fault.target]), f"{key}.sensor", f"sensor of {fault.target}")
    if isinstance(fault, NetParted):
        for member in fault.apart:
            known(member, nets[fault.target], f"{key}.apart", f"member of {fault.target}")


def sensors_of(kit: Kit) -> list[str]:
    """Names of a kit's sensors, as faults and topics call them."""
    return [
        *(imu.place for imu in kit.imus),
        *(["gnss"] if kit.gnss != "none" else []),
        *(["pressure"] if kit.barometer != "none" else []),
        *(["camera"] if kit.camera != "none" else []),
        *(["range"] if kit.uwb or kit.foot_ranging else []),
    ]
