"""The common vocabulary of bootprint: what travels (messages, topics), how (bus), and what every service needs.

Frames and units, everywhere: local east-north-up (ENU) metres around the realm's origin, WGS84 degrees with
ellipsoidal heights, azimuths in radians clockwise from true north, times in nanoseconds of UTC since 1970.
"""

from bootprint import plain_structlog

plain_structlog.load()
