"""kill -9 of real hubs in the middle of writing, on SQLite and PostgreSQL; fifty times each is `make kills`."""

import random
from contextlib import closing
from pathlib import Path

import pytest

from support.killed_hub import Database, Trial, archive_url

pytestmark = pytest.mark.processes
KILLS = 2


@pytest.mark.parametrize("database", ["sqlite", "postgresql"])
def test_nothing_that_a_hub_has_acknowledged_is_lost(database: Database, tmp_path: Path) -> None:
    with (
        archive_url(database, tmp_path) as url,
        closing(Trial(tmp_path, url, random.Random(database))) as trial,
    ):
        for _ in range(KILLS):
            trial.kill_once()
    assert len(trial.alerts) >= KILLS
    assert len(trial.soldier.acknowledged) >= KILLS
    assert trial.statuses > 100
