"""`bootprint calibrate`: sensors calibrated from recordings. It stands here because it reads every kind of them."""
