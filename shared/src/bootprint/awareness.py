"""Messages about where weapons point, who is in danger of one's own side, and who is known to whom."""

from typing import Annotated, Final, Literal, get_args

import msgspec

from bootprint.messages import Message, Name, NonNegative, Percent, TimeNs, TrackState

Reason = Literal["near", "in_aim", "in_facing", "in_target_line", "near_target"]
REASONS: Final[tuple[Reason, ...]] = get_args(Reason)
Positive = Annotated[float, msgspec.Meta(gt=0.0)]


class Aim(Message, frozen=True):
    """Where a soldier's weapon points, from a sensor on it or from a tool; it holds for ``valid_s``.

    Azimuth clockwise from true north, elevation up from the horizon (None: unknown), both with one sigma.
    ``range_m`` is how far it reaches, None for the hub's setting.
    """

    azimuth_rad: float
    azimuth_sigma_rad: NonNegative
    elevation_rad: Annotated[float, msgspec.Meta(ge=-1.571, le=1.571)] | None = None
    elevation_sigma_rad: NonNegative | None = None
    range_m: Positive | None = None
    valid_s: Positive = 2.0


class FriendlyWarning(Message, frozen=True):
    """A friendly is near us, or in the line of our weapon, or may be.

    ``reasons`` are in the order of `REASONS`; none means that the warning is over. ``in_aim`` is the line of an
    `Aim`, ``in_facing`` that of our body for want of one, ``in_target_line`` that from us to an observed target.
    ``probability_pct`` is of the likeliest reason, that the friendly is there. Distance, azimuth (from us,
    clockwise from true north) and ``sigma_m`` (one sigma for any direction, both soldiers' errors and the report's
    age counted) are of where the friendly is believed to be. With a ``state`` that is not fresh the friendly *may*
    be there: it was, ``age_s`` ago. Told again every 5 s while it lasts.
    """

    soldier: Name
    friendly: Name
    reasons: tuple[Reason, ...]
    probability_pct: Percent
    distance_m: NonNegative
    azimuth_rad: float
    sigma_m: NonNegative
    state: TrackState
    age_s: float
    up_m: float | None = None
    floor: int | None = None

    @property
    def is_over(self) -> bool:
        """Whether this clears what was warned of before."""
        return not self.reasons


class Contact(msgspec.Struct, kw_only=True, frozen=True):
    """One member as a hub hears it: the net, its newest frame, and whom it is proven to know.

    ``knows`` maps soldiers, by id, to the time since when the member has known them without a break.
    """

    soldier: Name
    link: Name
    heard_ns: TimeNs
    knows: dict[str, TimeNs] = msgspec.field(default_factory=dict)


class Contacts(Message, frozen=True):
    """Who is known to whom, as far as one hub can tell from what it hears.

    ``knows`` are the soldiers whom the hub itself knows freshly, by id, with the time since when without a break;
    ``members`` those whose own frames it hears. What a member knows beyond what its frames prove is not listed: a
    soldier who does not relay proves little, and yet may know everyone.
    """

    soldier: Name
    knows: dict[str, TimeNs] = msgspec.field(default_factory=dict)
    members: tuple[Contact, ...] = ()
