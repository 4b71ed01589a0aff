"""From raw samples to steps: what is usable, level, regular, and a step."""
