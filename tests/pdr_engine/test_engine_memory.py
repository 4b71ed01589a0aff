"""An engine that is killed in a corner: the next one goes on from its saved state as if nothing had been."""

import pickle
from collections.abc import Iterable

import msgspec
import numpy as np
import pytest

from bootprint import wire
from bootprint.bus import Envelope
from bootprint.config import Origin
from bootprint.messages import BodyStep, FootPose, FootStep, GnssFix, ImuBatch, Message, Pressure
from bootprint.topics import CACHED_SAMPLES, Identity, Qos
from pdr_engine.body.methods import METHODS, settings_of
from pdr_engine.config import PdrConfig
from pdr_engine.engine import EngineCore
from pdr_engine.foot_record import condensed, restored
from pdr_engine.memory import Saved, kept_of, owner_of, understood
from pdr_engine.trunk_record import frozen, thawed
from support.foot_streams import Stream, walk
from support.walking_trunk import TrunkStream, trunk_walk

ME = Identity("bp", "alpha", "a1")
PLACE = Origin(latitude_deg=59.3, longitude_deg=18.1)
FEET = PdrConfig(places=("left_foot",))
BODY = PdrConfig(places=("body",))
AGAIN = CACHED_SAMPLES[Qos.RECENT]
LATE = 30  # batches between saving and dying, and between dying and the next start


def batches(stream: Stream | TrunkStream, place: str, size: int = 10) -> list[Envelope]:
    mag = getattr(stream, "mag", None)
    address = ME.address("imu", place)
    return [
        Envelope(
            address,
            ImuBatch.from_arrays(
                k // size,
                stream.time_ns[k : k + size],
                stream.accel[k : k + size],
                stream.gyro[k : k + size],
                None if mag is None else mag[k : k + size],
            ),
        )
        for k in range(0, len(stream.time_ns), size)
    ]


WALK = batches(walk(12), "left_foot")  # a quarter turn every five strides
TRUNK = batches(trunk_walk(30.0, azimuth=lambda t: np.clip((t - 10.0) / 3.0, 0.0, 1.5)), "body")
FIXED = Envelope(
    ME.address("gnss", "gnss"),
    GnssFix(
        time_ns=TRUNK[30].message.time_ns,
        fix_kind="3d",
        latitude_deg=59.3,
        longitude_deg=18.1,
        height_m=20.0,
        horizontal_accuracy_m=2.0,
        vertical_accuracy_m=3.0,
    ),
)
TRUNK[30:30] = [
    FIXED,
    Envelope(ME.address("pressure", "baro"), Pressure(time_ns=FIXED.message.time_ns, pressure_pa=1e5)),
]


def fed(core: EngineCore, inputs: Iterable[Envelope]) -> list[Message]:
    return [said.message for one in inputs for said in core.handle(one)]


def saved_after(config: PdrConfig, inputs: Iterable[Envelope]) -> Saved:
    """What is in the file of an engine that was fed this."""
    core = EngineCore(config, ME, PLACE)
    fed(core, inputs)
    kept = kept_of(core.remembered())
    assert kept is not None
    return understood(kept, owner_of(config, ME))


def before(config: PdrConfig, inputs: list[Envelope]) -> list[Message]:
    """What an engine that nobody kills says."""
    return fed(EngineCore(config, ME, PLACE), inputs)


EXPECTED = {"left_foot": before(FEET, WALK), "body": before(BODY, TRUNK)}


def steps_of(messages: Iterable[Message]) -> dict[int, bytes]:
    return {one.sequence: wire.encode(one) for one in messages if isinstance(one, FootStep | BodyStep)}


@pytest.mark.parametrize(("config", "inputs"), [(FEET, WALK), (BODY, TRUNK)], ids=["foot", "body"])
@pytest.mark.parametrize("share", np.linspace(0.12, 0.88, 5))
def test_a_restart_tells_the_same_steps_to_the_bit(
    config: PdrConfig, inputs: list[Envelope], share: float
) -> None:
    expected = steps_of(EXPECTED[config.places[0]])
    saved_at = round(share * len(inputs))
    back_at = min(saved_at + 2 * LATE, len(inputs))
    core = EngineCore(config, ME, PLACE, saved=saved_after(config, inputs[:saved_at]))
    again = inputs[max(0, back_at - AGAIN) : back_at]  # of these the bus tells inertial samples
    told = steps_of(fed(core, [one for one in again if one.address.subject == "imu"] + inputs[back_at:]))
    assert core.figures().counters["memory_gone_on_from"] == 1
    assert len(told) >= 5 or share > 0.6
    assert told == {sequence: expected[sequence] for sequence in told}
    assert {**steps_of(before(config, inputs[:saved_at])), **told} == expected


def test_poses_go_on_where_they_were() -> None:
    poses = {one.time_ns: wire.encode(one) for one in EXPECTED["left_foot"] if isinstance(one, FootPose)}
    core = EngineCore(FEET, ME, PLACE, saved=saved_after(FEET, WALK[:100]))
    again = {one.time_ns: wire.encode(one) for one in fed(core, WALK[60:]) if isinstance(one, FootPose)}
    assert len(again) > 40
    assert again == {time_ns: poses[time_ns] for time_ns in again}


def test_a_gap_that_the_bus_cannot_fill_is_coasted_over_under_the_same_numbers() -> None:
    saved_at = 150
    known = steps_of(before(FEET, WALK[:saved_at]))
    core = EngineCore(FEET, ME, PLACE, saved=saved_after(FEET, WALK[:saved_at]))
    steps = [one for one in fed(core, WALK[saved_at + 45 :]) if isinstance(one, FootStep)]
    assert steps[0].sequence == max(known) + 1
    assert [step.realigned for step in steps].count(True) == 1
    assert [step.realigned for step in steps].index(
        True
    ) <= 1  # a step may have been waiting for its look-ahead


def test_state_of_another_time_is_left_aside() -> None:
    saved = saved_after(FEET, WALK[:100])
    for shift_s in (-66, 21):  # the first sample is 5 s before the state
        old = msgspec.structs.replace(saved, time_ns=saved.time_ns + shift_s * 1_000_000_000)
        core = EngineCore(FEET, ME, PLACE, saved=old)
        assert steps_of(fed(core, WALK)) == steps_of(EXPECTED["left_foot"])
        assert core.figures().counters["memory_refused"] == 1


def test_state_of_other_settings_is_refused() -> None:
    kept = kept_of(saved_after(FEET, WALK[:20]))
    assert kept is not None
    for config, who in ((PdrConfig(), ME), (FEET, Identity("bp", "alpha", "a2"))):
        with pytest.raises(ValueError, match="another soldier, other settings"):
            understood(kept, owner_of(config, who))


def test_a_record_that_contradicts_itself_is_left_aside() -> None:
    saved = saved_after(FEET, WALK[:100])
    boot = saved.boots["left_foot"]
    for record in (boot.record[:-1], bytes(len(boot.record) - 8) + b"\xff" * 8, b""):
        bad = msgspec.structs.replace(
            saved, boots={"left_foot": msgspec.structs.replace(boot, record=record)}
        )
        core = EngineCore(FEET, ME, PLACE, saved=bad)
        if record[-8:] == b"\xff" * 8:
            with pytest.raises(ValueError, match="contradict"):
                restored(record)
        fed(core, WALK[100:110])
        assert core.figures().counters["memory_refused"] == 1
        assert "saved state not gone on from: a foot's record" in core.figures().note


def test_a_record_holds_what_may_be_looked_at_and_little_more() -> None:
    core = EngineCore(FEET, ME, PLACE)
    fed(core, WALK)
    boot = core.remembered()
    assert boot is not None
    record = boot.boots["left_foot"].record
    assert len(record) < 150_000
    assert condensed(restored(record)) == record


def test_a_made_up_record_calls_nothing() -> None:
    class Wicked:
        def __reduce__(self) -> tuple[object, ...]:
            return (print, ("called",))

    router = (
        b"cbootprint.zenoh_bus\nEmbeddedRouter\n(S'tcp/127.0.0.1:0'\ntR."  # the house's own, and no estimator
    )
    for data in (
        pickle.dumps({"_navigator": Wicked()}),
        router,
        b"cos\nsystem\n(S'true'\ntR.",
        b"",
        b"\x80\x05].",
    ):
        with pytest.raises(ValueError, match="no body navigator"):
            thawed(data)


@pytest.mark.parametrize("method", METHODS)
def test_every_method_of_the_body_can_be_saved_and_gone_on_from(method: str) -> None:
    config = PdrConfig(places=("body",), body=settings_of(method))
    core = EngineCore(config, ME, PLACE, saved=saved_after(config, TRUNK[:120]))
    fed(core, TRUNK[120:130])
    assert core.figures().counters["memory_gone_on_from"] == 1, core.figures().note


def test_what_cannot_be_saved_is_said_and_stops_nobody() -> None:
    with pytest.raises(ValueError, match="cannot be saved"):
        frozen({"_navigator": lambda: None})
