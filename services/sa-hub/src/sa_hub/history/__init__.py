"""What the command post keeps: tracks, alerts, observations and health in a database that outlives the power."""
