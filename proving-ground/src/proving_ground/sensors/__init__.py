"""What sensors on moving people measure, with the errors that recordings show: one module a sensor.

Each takes a `Motion`, a `Mounting`, a quality class, the surroundings and a random generator, and returns a series
of `sensor_gateway.recordings.run`. Surroundings are shared by all soldiers and come of seeds of their own.
"""

from proving_ground.sensors.air import (
    BAROMETER_CLASSES,
    Air,
    BarometerQuality,
    DoorSlam,
    LiftShaft,
    measure_pressure,
)
from proving_ground.sensors.camera_folder import write_camera_folder
from proving_ground.sensors.camera_motion import OdometryQuality, measure_camera
from proving_ground.sensors.camera_render import StereoCamera, render_pair
from proving_ground.sensors.camera_world import CameraWorld, Figure, LightZone, Slab
from proving_ground.sensors.gnss import GNSS_CLASSES, GnssQuality, measure_gnss
from proving_ground.sensors.gnss_conditions import GnssConditions, Zone
from proving_ground.sensors.imu import measure_imu
from proving_ground.sensors.imu_quality import IMU_CLASSES, ImuClass, imu_class
from proving_ground.sensors.magnetics import (
    DeviceIron,
    Dipoles,
    Magnetics,
    iron_row,
    lift_shaft,
    spread_iron,
    storey_iron,
)
from proving_ground.sensors.mounting import Mounting
from proving_ground.sensors.places import Area, Walls
from proving_ground.sensors.ranges import RANGE_CLASSES, Peer, RangeQuality, Ranging, measure_ranges
from proving_ground.sensors.run_writer import write_run_folder

__all__ = [
    "BAROMETER_CLASSES",
    "GNSS_CLASSES",
    "IMU_CLASSES",
    "RANGE_CLASSES",
    "Air",
    "Area",
    "BarometerQuality",
    "CameraWorld",
    "DeviceIron",
    "Dipoles",
    "DoorSlam",
    "Figure",
    "GnssConditions",
    "GnssQuality",
    "ImuClass",
    "LiftShaft",
    "LightZone",
    "Magnetics",
    "Mounting",
    "OdometryQuality",
    "Peer",
    "RangeQuality",
    "Ranging",
    "Slab",
    "StereoCamera",
    "Walls",
    "Zone",
    "imu_class",
    "iron_row",
    "lift_shaft",
    "measure_camera",
    "measure_gnss",
    "measure_imu",
    "measure_pressure",
    "measure_ranges",
    "render_pair",
    "spread_iron",
    "storey_iron",
    "write_camera_folder",
    "write_run_folder",
]
