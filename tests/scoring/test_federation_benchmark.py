"""`bootprint benchmark federation` counts what real routers deliver."""

from proving_ground.performance.federation_benchmark import measure


def test_every_frame_reaches_every_other_post() -> None:
    row = measure(3, rounds=4)
    assert (row.posts, row.links, row.frames_sent) == (3, 3, 12)
    assert row.frames_heard == 24  # each of 12 frames at two others
    assert row.cpu_us_per_delivery > 0.0
