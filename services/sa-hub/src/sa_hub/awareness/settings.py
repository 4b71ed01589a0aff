"""``[hub.warnings]``: when a hub warns of friendlies in danger. Metres and seconds of event time.

.. code-block:: toml

    [hub.warnings]
    near_m = 15.0        # a friendly within this distance
    half_width_m = 5.0   # or this near to the line of our weapon, on either side,
    range_m = 300.0      # and no farther along it
"""

from typing import Annotated

import msgspec

from bootprint.config import Config

Positive = Annotated[float, msgspec.Meta(gt=0.0)]
Share = Annotated[float, msgspec.Meta(gt=0.0, lt=1.0)]


class WarningSettings(Config, frozen=True):
    """What is dangerous, and how sure of it the hub must be.

    A warning begins when its probability reaches ``begins_at``, and ends when it has been below half of that for
    ``hold_s``. What we face is a guess at where we would shoot, and people who walk together are near each other:
    warnings for these two reasons end after ``familiar_s``, until the reason has been gone for as long.
    ``facing`` off: only an `Aim` makes a line. ``target_s``: how long an observed target draws a line to it.
    """

    on: bool = True
    near_m: Positive = 15.0
    half_width_m: Positive = 5.0
    range_m: Positive = 300.0
    begins_at: Share = 0.1
    hold_s: Annotated[float, msgspec.Meta(ge=0.5)] = 1.0
    familiar_s: Positive = 60.0
    facing: bool = True
    target_s: Positive = 120.0
