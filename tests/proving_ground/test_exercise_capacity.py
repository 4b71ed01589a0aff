"""An exercise that this machine cannot carry is refused before it is built, in words that help."""

import re

import pytest

from bootprint.errors import ConfigError
from proving_ground.exercises.processes.capacity import check_memory


def test_a_platoon_fits_where_a_company_does_not() -> None:
    check_memory(40, free_gb=12.0)
    refusal = "133 soldiers are 532 processes and want about 26 GB of memory, 12 GB are free here"
    with pytest.raises(ConfigError, match=re.escape(refusal)):
        check_memory(133, free_gb=12.0)


def test_without_being_told_it_asks_the_machine() -> None:
    check_memory(1)
    with pytest.raises(ConfigError, match="free here"):
        check_memory(1_000_000)
