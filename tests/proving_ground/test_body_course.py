"""The four-direction course of METHODS A3: steps' classes and the closing error, by the simulator's people."""

import pytest

from proving_ground.evaluation.body.course import COURSE_M, run_course


@pytest.mark.parametrize("person", ["average", "tall", "heavy"])
def test_every_step_of_the_course_has_its_class(person: str) -> None:
    score = run_course(person, "forward first", seed=1)
    assert score.steps > 200
    assert score.right / score.steps > 0.975
    assert score.closing_m < 0.03 * COURSE_M  # one course; the table tells the mean
    assert 4.0 < score.rotation_deg < 13.0  # 8.6° in truth, met by the noise of a few steps
