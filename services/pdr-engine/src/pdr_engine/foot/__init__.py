"""Foot-mounted inertial navigation with zero-velocity updates: samples of one shoe in, track and steps out."""

from pdr_engine.foot.navigator import FootEstimates, FootNavigator, warm_up
from pdr_engine.foot.settings import METHODS, FootSettings
from pdr_engine.foot.steps import FootStepEstimate

__all__ = ["METHODS", "FootEstimates", "FootNavigator", "FootSettings", "FootStepEstimate", "warm_up"]
