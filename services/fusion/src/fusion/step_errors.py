"""What errs in a foot's step: its own part, and the part that all steps of the foot share."""

from collections import Counter

from bootprint.clock import NS_PER_S
from bootprint.messages import FootStep
from fusion.config import FeetConfig
from fusion.feet import COARSE_STEP
from fusion.models import foot_step, shared_errors
from fusion.models.shared_errors import StepError, shares_of


class StepErrors:
    """By what steps state themselves, and what is known of steps in general."""

    def __init__(self, config: FeetConfig, counters: Counter[str]) -> None:
        self._config = config
        self._counters = counters

    def of(self, step: FootStep) -> StepError:
        """The step's own covariance and its shares of what the foot's steps have in common."""
        covariance = foot_step.step_covariance(step.covariance)
        if covariance is None:
            self._counters["bad_covariances"] += 1
            covariance = COARSE_STEP
        shares = shares_of(step)
        own = None if shares is None else shares.own(covariance)
        if own is None:
            unmodelled = foot_step.unmodelled(step.displacement_m, _duration_s(step), self._config)
            return StepError(covariance + unmodelled, None)
        return StepError(own, shares)

    def kept(self, step: FootStep) -> float:
        """How much of the shared errors is still the same after this step."""
        return shared_errors.kept(_duration_s(step), self._config.common_lifetime_s)


def _duration_s(step: FootStep) -> float:
    return (step.time_ns - step.start_time_ns) / NS_PER_S
