"""Body-worn module: steps of a unit at belt, chest, back or hand, their lengths and azimuths."""

from pdr_engine.body.estimate import BodyStepEstimate
from pdr_engine.body.navigator import BodyNavigator
from pdr_engine.body.settings import BodySettings

__all__ = ["BodyNavigator", "BodySettings", "BodyStepEstimate"]
