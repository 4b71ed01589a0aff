"""Pedestrian dead reckoning for one soldier: the boots' inertial units in, foot steps and poses out."""
