"""The body module's methods by name: a step length model, an azimuth source and a way of de-noising the gyro."""

import msgspec

from pdr_engine.body.settings import (
    Azimuth,
    BodySettings,
    Denoising,
    HeadingSettings,
    LengthSettings,
    StepLength,
)

DEFAULT = "default"
PNS_GPS = "c4"


class _Parts(msgspec.Struct, frozen=True):
    step_length: StepLength = BodySettings().step_length
    azimuth: Azimuth = BodySettings().azimuth
    denoising: Denoising = HeadingSettings().denoising
    turn_shortening_s: float = LengthSettings().turn_shortening_s
    classes: bool = BodySettings().classes
    online_calibration: bool = BodySettings().online_calibration
    retrace: bool = BodySettings().retrace


_PARTS: dict[str, _Parts] = {
    DEFAULT: _Parts(),
    # Step length models, with the default's azimuth.
    "pendulum": _Parts("pendulum"),
    "a1": _Parts("frequency"),
    "weinberg": _Parts("weinberg"),
    "c2": _Parts("network"),
    # Azimuth sources, with the default's step length.
    "gyro-only": _Parts(azimuth="gyro"),
    "compass-only": _Parts(azimuth="compass"),
    "c3": _Parts(azimuth="two-axis"),
    "b2": _Parts(azimuth="cascade"),
    "a7": _Parts(azimuth="bridge"),
    "a7-direct": _Parts(azimuth="bridge-direct"),
    "a7-weighted": _Parts(azimuth="bridge-weighted"),
    "b3-stride": _Parts(denoising="stride"),
    "b3-wavelet": _Parts(denoising="wavelet"),
    # The default without one of its parts.
    "without-a3": _Parts(classes=False),
    "without-a5": _Parts(online_calibration=False),
    "without-b6": _Parts(turn_shortening_s=0.0, retrace=False),
    # The default's steps without any fix; who adds them up lets `track.pns_gps` have the fixes.
    PNS_GPS: _Parts(),
    # The textbook's pedometers.
    "weinberg-compass": _Parts("weinberg", "compass", turn_shortening_s=0.0),
    "weinberg-gyro": _Parts("weinberg", "gyro", turn_shortening_s=0.0),
    "a1-compass": _Parts("frequency", "compass", turn_shortening_s=0.0),
    "a1-gyro": _Parts("frequency", "gyro", turn_shortening_s=0.0),
}
METHODS: tuple[str, ...] = tuple(_PARTS)


def settings_of(method: str) -> BodySettings:
    """The settings of a method; KeyError if there is no such."""
    parts = _PARTS[method]
    return BodySettings(
        step_length=parts.step_length,
        azimuth=parts.azimuth,
        heading=HeadingSettings(denoising=parts.denoising),
        length=LengthSettings(turn_shortening_s=parts.turn_shortening_s),
        classes=parts.classes,
        online_calibration=parts.online_calibration,
        retrace=parts.retrace,
    )
