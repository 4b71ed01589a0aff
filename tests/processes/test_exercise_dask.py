"""A sweep on a real Dask scheduler with real workers gives what the local processors give."""

import pytest
from distributed import LocalCluster

from bootprint.errors import ConfigError
from proving_ground.exercises.sweep import play_seed, sweep_on_dask

pytestmark = [pytest.mark.processes, pytest.mark.xdist_group("processes"), pytest.mark.timeout(180)]
GRID = [{"net.loss": 0.0}, {"net.loss": 0.3}]


def test_workers_play_what_this_process_plays() -> None:
    shares: list[float] = []
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        found = sweep_on_dask("four-walks", [1, 2], GRID, cluster.scheduler_address, shares.append)
        with pytest.raises(ConfigError, match="seed 1 failed on a worker: no scenario 'four-wlks'"):
            sweep_on_dask("four-wlks", [1], GRID, cluster.scheduler_address, shares.append)
    assert sorted(found) == [1, 2]
    assert found[2] == play_seed("four-walks", 2, GRID)
    assert shares == [0.5, 1.0]


def test_a_scheduler_that_is_not_there_is_told_in_a_line() -> None:
    with pytest.raises(ConfigError, match=r"--dask tcp://127\.0\.0\.1:9: no scheduler answers"):
        sweep_on_dask("four-walks", [1], GRID, "tcp://127.0.0.1:9", lambda _share: None)
