"""Units that are not of this realm's roster, as other systems (TAK) tell of them."""

from typing import Annotated, Literal

import msgspec

from bootprint.messages import Latitude, Longitude, Message, NonNegative, TimeNs

Affiliation = Literal["friend", "hostile", "neutral", "unknown"]
Text = Annotated[str, msgspec.Meta(max_length=200)]


class ForeignTrack(Message, frozen=True):
    """A unit of another system: where that system says that it was at ``time_ns``; to be doubted from ``stale_ns``.

    ``uid`` is the other system's name for it. ``cot_type`` and ``how`` are Cursor on Target's, e.g. ``a-f-G-U-C``
    and ``m-g``. Height above the ellipsoid; ``accuracy_m`` is one sigma, course clockwise from true north.
    """

    uid: Text
    affiliation: Affiliation
    cot_type: Text
    latitude_deg: Latitude
    longitude_deg: Longitude
    stale_ns: TimeNs
    how: Text = ""
    callsign: Text | None = None
    team: Text | None = None
    role: Text | None = None
    height_m: float | None = None
    accuracy_m: NonNegative | None = None
    course_rad: float | None = None
    speed_m_s: NonNegative | None = None
    exercise: bool = False
