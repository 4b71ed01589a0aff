"""Stereo visual odometry: rectified pairs of images in, camera motion with its covariance or a verdict out.

Brings OpenCV: imported only where a camera is configured or a recording of one is read.
"""

from sensor_gateway.stereo.calibration import StereoCalibration
from sensor_gateway.stereo.health import Condition, Verdict
from sensor_gateway.stereo.inertial import InertialOdometry, Sample
from sensor_gateway.stereo.odometry import StereoOdometry
from sensor_gateway.stereo.settings import OdometrySettings

__all__ = [
    "Condition",
    "InertialOdometry",
    "OdometrySettings",
    "Sample",
    "StereoCalibration",
    "StereoOdometry",
    "Verdict",
]
