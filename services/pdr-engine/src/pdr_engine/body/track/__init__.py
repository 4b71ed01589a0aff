"""Steps as a track: the way back, satellites, and how far it can be relied on."""
