"""One Hypothesis profile for all rooms: the same examples every time, and no deadline on a shared machine."""

from hypothesis import settings

settings.register_profile("house", deadline=None, derandomize=True)
settings.load_profile("house")
