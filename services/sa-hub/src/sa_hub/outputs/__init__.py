"""Positions for other programs: MAVLink for ground stations, NMEA 0183 for tools on the soldier's computer."""
