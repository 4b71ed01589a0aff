"""Stereo odometry scored: recorded pairs, rendered walks, cameras with defects; its page of the manual."""
