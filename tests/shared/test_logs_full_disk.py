"""A log on a full disk: its words are lost, nothing else."""

import subprocess
import sys
from pathlib import Path

SERVICE = """
import resource, structlog
from bootprint import logs
logs.configure()
structlog.get_logger().info("before")
resource.setrlimit(resource.RLIMIT_FSIZE, (0, resource.RLIM_INFINITY))
for _ in range(1000):
    structlog.get_logger().info("while full")
resource.setrlimit(resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
structlog.get_logger().info("after")
"""


def test_a_full_disk_behind_the_log_stops_nobody(tmp_path: Path) -> None:
    with (tmp_path / "log").open("w") as log:
        done = subprocess.run([sys.executable, "-c", SERVICE], stderr=log, check=False)
    assert done.returncode == 0
    text = (tmp_path / "log").read_text()
    assert "before" in text
    assert "after" in text
