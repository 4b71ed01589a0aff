"""What is wrong in a scenario, with the key at fault; the loader adds the file and the line."""


class ScenarioFault(Exception):  # noqa: N818 - never leaves the package: the loader turns it into a ConfigError
    """``key`` is the path of what is wrong (``site.buildings[0].doors[2]``), the message says why."""

    def __init__(self, key: str, reason: str) -> None:
        super().__init__(reason)
        self.key = key
        self.reason = reason
