"""Which way a step leads: unit against walk, compass, gyro, and what disturbs them."""
