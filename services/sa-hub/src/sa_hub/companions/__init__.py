"""What accompanies a hub's core: the archive, TAK, MAVLink and NMEA, each in a thread of its own.

The core's thread only lays envelopes into bounded queues, so a slow disk, server or cable never holds it up.
"""
