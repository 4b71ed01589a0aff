"""After a restart of the hub the page shows what it showed: places, alerts and who saw them, observations."""

from pathlib import Path

import pytest

from sa_hub.history.archive import Archive
from sa_hub.page.audit import Audit
from sa_hub.page.desk import Desk
from sa_hub.page.restart import RECALLED_NS, recall
from support.hub_squad import S
from support.page_post import PostAir, browser, walked

API = "/api/v1"


@pytest.fixture
def air(tmp_path: Path) -> PostAir:
    """A soldier has walked, two alerts were given, of which one was seen, and something was observed."""
    found = walked(PostAir(tmp_path, Archive(f"sqlite:///{tmp_path}/history.db")))
    with browser(found) as client:
        seen = client.post(f"{API}/alerts", json={"kind": "fire"}).json()
        found.now_ns += S
        client.post(f"{API}/alerts", json={"kind": "help"})
        client.post(f"{API}/alerts/{seen['id']}/acknowledgement")
        where = {"latitude_deg": 59.35, "longitude_deg": 18.07, "code": "drone"}
        client.post(f"{API}/observations", json=where)
    found.desk.catch_up()
    return found


def restarted(air: PostAir, folder: Path, later_ns: int = 0) -> Desk:
    air.now_ns += later_ns
    desk = Desk(air.desk.post, Audit(folder / "audit.jsonl"), archive=air.desk.archive)
    recall(desk)
    return desk


def test_the_picture_after_a_restart_is_the_one_before(air: PostAir, tmp_path: Path) -> None:
    before, after = air.desk.picture, restarted(air, tmp_path).picture
    for kind in ("tracks", "alerts", "observations"):
        assert after.all(kind) == before.all(kind)
        assert after.all(kind)
    seen = {alert.kind: alert.acknowledged_by for alert in after.all("alerts").values()}  # type: ignore[attr-defined]
    assert seen == {"fire": "local", "help": None}


def test_of_yesterday_nothing_is_shown(air: PostAir, tmp_path: Path) -> None:
    assert restarted(air, tmp_path, RECALLED_NS + 60 * S).picture.revision == 0


def test_without_an_archive_the_page_begins_empty(air: PostAir, tmp_path: Path) -> None:
    desk = Desk(air.desk.post, Audit(tmp_path / "audit.jsonl"))
    recall(desk)
    assert desk.picture.revision == 0
