"""Where sensors enter: bytes from serial ports, UDP and recordings become typed messages in UTC and SI units."""
