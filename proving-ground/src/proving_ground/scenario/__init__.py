"""Scenarios: TOML files that say where, who, what they do, and what is in the way; `load_scenario` reads one.

`build.build` makes an exercise of it; it stands in its own module because it needs all sensors.
"""

from proving_ground.scenario.loading import LIBRARY, library, load_scenario
from proving_ground.scenario.scenario import Play, Scenario

__all__ = ["LIBRARY", "Play", "Scenario", "library", "load_scenario"]
