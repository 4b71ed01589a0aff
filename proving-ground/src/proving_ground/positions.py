"""Positions as a fusion would tell them, of soldiers whose places are known: for hubs that are played alone."""

from collections.abc import Sequence

from bootprint.messages import Mode, Position, Vector3


def position_at(
    time_ns: int,
    enu_m: Sequence[float],
    geodetic: Sequence[float],
    variances_m2: Vector3,
    *,
    mode: Mode = "boots",
    velocity_m_s: Sequence[float] = (0.0, 0.0),
    speed_m_s: float = 0.0,
    sequence: int = 0,
    floor: int | None = None,
    sources: tuple[str, ...] = (),
) -> Position:
    """At ``enu_m`` (east, north, up), which is ``geodetic`` (degrees, degrees, m); velocity is east and north.

    ``variances_m2`` of east, north and up, which err apart.
    """
    latitude_deg, longitude_deg, height_m = geodetic
    east_m, north_m, up_m = enu_m
    east_m2, north_m2, up_m2 = variances_m2
    east_m_s, north_m_s = velocity_m_s
    return Position(
        time_ns=time_ns,
        sequence=sequence,
        mode=mode,
        latitude_deg=latitude_deg,
        longitude_deg=longitude_deg,
        height_m=height_m,
        east_m=east_m,
        north_m=north_m,
        up_m=up_m,
        covariance_m2=(east_m2, 0.0, 0.0, north_m2, 0.0, up_m2),
        velocity_m_s=(east_m_s, north_m_s, 0.0),
        speed_m_s=speed_m_s,
        floor=floor,
        sources=sources,
    )
