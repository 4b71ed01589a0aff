"""A walk around blocks with iron put on, through the whole chain."""

from proving_ground.evaluation.body.worn_iron import worn_iron_deg


def test_a_compass_with_iron_put_on_calibrates_itself_and_the_azimuth_follows() -> None:
    (compass, azimuth), (calibrated, azimuth_then) = worn_iron_deg(seed=2, hard_ut=6.0)
    assert compass > 8.0
    assert calibrated < 0.5 * compass
    assert azimuth_then < 0.6 * azimuth
