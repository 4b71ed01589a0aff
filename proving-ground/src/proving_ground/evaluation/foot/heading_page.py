"""The section on heading over long walks in docs/foot-ins.md."""

from collections.abc import Mapping, Sequence

from pdr_engine.foot import FootSettings
from proving_ground.evaluation.foot.long_walks import Comparison, long_walks_table


def heading(long_walks: Mapping[str, Sequence[Comparison]]) -> str:
    """Magnetometer, stops, what was tried, and simulated walks with and without the magnetometer."""
    share = FootSettings().magnetometer.disturbed_share
    text = f"""## Heading over long walks

- **Magnetometer at stand-still.** Once a stance the mean field, calibrated and levelled, feeds a filter of six
  states (heading, drift, horizontal field, iron on the boot). How far the field's strength wanders from place to
  place is taken for its disturbance: above {100 * share:g} % of the horizontal part nothing is used, nor before
  some 15 m have shown it. The four recorded walks with a magnetometer (31, 33, 35, 39) lead over such floors
  (7 to 11 µT of 25): their tracks are the same to the last bit with it and without.
- **Stops.** What a stop verified still teaches of the gyro bias is taken out of the heading too (a
  zero-angular-rate update): simulated stops of 2 to 300 s turn the foot by 0.03 to 0.05° instead of 0.10 to
  0.20°. No recording has such a stop amid its way.
- **Tried without gain**, fitted on every other walk of foot-gcp and tested on those between, °/min: the vertical
  gyro's g-sensitivity 1.27 → 1.56 and 2.27 → 3.02; all gyros' 1.27 → 1.99 and 2.27 → 2.97; scale factors
  1.27 → 1.57 and 2.27 → 2.32. Straight stretches taken for straight: the best of four thresholds wins 5 mm of RMSE
  there, the worst loses 50 mm, and a street that bends by a radius of 400 m bends away (0.98 → 7.9 m): no
  threshold tells a bend from a drift.

Simulated walks of 900 m (12 min), a gyro whose bias wanders by 30 °/h, without → with the magnetometer
(`python -m proving_ground.evaluation.foot.long_walks`).
A simulated stance is perfect: only the comparison counts."""
    return "\n".join([text, "", *long_walks_table(long_walks)])
