"""The faults that the house is held to: what a person sees of each, what it costs, and the tests that inject it."""

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True)
class FaultRow:
    """``kinds`` are those of exercises that play it; ``tests`` are ``folder/file::function`` below tests/."""

    fault: str
    sees: str
    lost: str
    tests: tuple[str, ...]
    kinds: tuple[str, ...] = ()


_NOTHING: Final = "nothing"
_UNTIL: Final = "what nobody measured or heard meanwhile; nothing recorded"

ROWS: Final = (
    FaultRow(
        "kill -9 of pdr-engine",
        "the soldier's position holds, then catches up; `process ended` in the log of `up`",
        "nothing: it goes on from its saved state with the samples that the bus tells again, to the bit",
        (
            "processes/test_engine_killed.py::test_a_corner_is_gone_round_by_two_engines_as_by_one",
            "pdr_engine/test_engine_memory.py::test_a_restart_tells_the_same_steps_to_the_bit",
            "proving_ground/test_fault_storm.py::"
            "test_a_line_whose_engine_is_killed_in_the_corner_tells_the_same_steps_and_ends_at_the_same_place",
        ),
        ("process_killed pdr-engine",),
    ),
    FaultRow(
        "kill -9 of fusion",
        "the track coasts, then goes on",
        "nothing: it goes on from its saved state and is told the newest steps again",
        (
            "fusion/test_fusion_memory.py::test_a_restart_goes_on_within_a_second",
            "processes/test_up.py::test_everything_runs_is_kept_running_and_leaves_nothing",
        ),
        ("process_killed fusion",),
    ),
    FaultRow(
        "kill -9 of sa-hub",
        "that computer's tracks stop; others see its soldier age until it speaks again",
        "reports of the time between; no nonce comes twice, no frame is taken twice",
        (
            "sa_hub/test_radio_seal.py::test_no_counter_comes_twice_over_restarts_and_power_cuts",
            "sa_hub/test_radio_seal.py::test_after_a_power_cut_nothing_heard_is_taken_again_and_little_else_refused",
        ),
        ("process_killed sa-hub",),
    ),
    FaultRow(
        "kill -9 of sensor-gateway",
        "`coasting`, then a step that says it was realigned; the doubt has grown",
        "the samples of the time between, and with them what the heading did",
        (
            "sensor_gateway/test_gateway_service.py::"
            "test_a_gateway_that_is_started_in_the_middle_of_a_walk_sends_what_is_still_to_come",
        ),
        ("process_killed sensor-gateway",),
    ),
    FaultRow(
        "a service stands still (SIGSTOP, swapping): a slow consumer",
        "its health is silent; `up` ends it after 15 s; inlets that overflow are counted (`bus_overruns`)",
        "the oldest samples of a stream that overflowed; events are asked for again",
        (
            "proving_ground/test_process_faults.py::test_a_process_that_stands_still_goes_on",
            "service/test_zenoh_bus.py::test_a_full_inlet_is_counted_and_goes_on_with_the_newest",
            "sa_hub/test_hub_companions.py::test_a_slow_sink_holds_nobody_up_and_what_is_lost_is_counted",
        ),
        ("process_stopped",),
    ),
    FaultRow(
        "router killed and started again",
        "`router lost`, `router back`, `router_losses` in health",
        "poses and satellite fixes of the time between; events and eight seconds of inertial samples come again",
        (
            "service/test_zenoh_bus.py::test_inertial_samples_that_no_router_carried_come_later_and_in_order",
            "service/test_zenoh_bus.py::test_events_survive_a_router_that_is_replaced",
            "service/test_scaffold.py::test_a_router_that_was_gone_is_told_of",
        ),
        ("router_killed",),
    ),
    FaultRow(
        "power cut: everything of a computer at once",
        "the soldier ages in everybody's picture, and comes back where they were, with more doubt",
        "what was not measured; recordings and databases keep all that was flushed or acknowledged",
        (
            "proving_ground/test_fault_storm.py::test_a_power_cut_takes_the_samples_too_and_the_line_goes_on",
            "shared/test_shared_recording_damage.py::test_cut_anywhere_it_keeps_every_whole_chunk",
            "sa_hub/test_history_killed.py::test_nothing_that_was_acknowledged_is_lost",
            "shared/test_saved_state.py::"
            "test_whoever_is_killed_while_writing_leaves_the_newest_or_the_one_before",
        ),
        ("power_cut",),
    ),
    FaultRow(
        "network partition",
        "each side sees the other age, stale, then lost",
        _UNTIL,
        ("proving_ground/test_fault_storm.py::test_a_net_in_two_parts_carries_nothing_between_them",),
        ("net_parted",),
    ),
    FaultRow(
        "radio gone for minutes",
        "the soldier is stale, then lost; at home the position goes on",
        "reports of the time between; alerts and observations wait and are sent",
        (
            "proving_ground/test_exercise_inprocess.py::test_silences_begin_with_the_exercise",
            "sa_hub/test_radio_seal.py::test_a_sender_is_heard_again_after_many_lost_frames",
        ),
        ("radio_gone",),
    ),
    FaultRow(
        "sensor unplugged",
        "`silent: left_foot` in health, degraded; the other foot or the body carries",
        "that sensor's samples",
        ("sensor_gateway/test_gateway_serial.py::test_unplugged_and_replugged",),
        ("sensor_unplugged",),
    ),
    FaultRow(
        "sensor frozen, saturated, NaN",
        "`degraded` where sensors contradict each other; steps realigned or refused; the doubt grows",
        "that sensor's steps",
        (
            "proving_ground/test_exercise_sensors.py::test_a_frozen_sensor_repeats_its_last_value",
            "proving_ground/test_exercise_sensors.py::test_a_saturated_unit_sticks_at_the_ends_of_its_ranges",
            "pdr_engine/test_foot_garbage.py::test_garbage_is_survived_and_told_in_finite_messages",
        ),
        ("sensor_frozen", "sensor_saturated", "sensor_nan"),
    ),
    FaultRow(
        "a computer's clock jumps by an hour",
        "a note of how wrong the clock is; the others go on showing the soldier at the right age",
        _NOTHING,
        (
            "sa_hub/test_hub_clocks.py::test_a_hub_whose_clock_is_set_back_an_hour_speaks_on_within_its_budget",
            "sensor_gateway/test_gateway_service.py::test_a_receiver_tells_how_wrong_the_computer_s_clock_is",
            "fusion/test_fusion_faults.py::test_a_clock_set_back_in_the_middle_of_a_walk_is_followed",
        ),
        ("clock_jump",),
    ),
    FaultRow(
        "GPS week roll-over",
        "nothing: a receiver's date before 2026 is not believed",
        _NOTHING,
        (
            "sensor_gateway/test_gateway_host_utc.py::"
            "test_single_wrong_words_and_a_wrapped_week_counter_are_not_believed",
        ),
    ),
    FaultRow(
        "disk full, disk read-only",
        "`state is not saved: No space left on device` in health; a recording ends with one line; "
        "the archive keeps its queue and tries again",
        "what would have been written; nothing that was",
        (
            "sa_hub/test_full_disk.py::"
            "test_state_is_the_last_that_found_room_and_goes_on_when_there_is_room_again",
            "sa_hub/test_full_disk.py::test_a_read_only_disk_still_gives_the_state_that_is_on_it",
            "sa_hub/test_full_disk.py::"
            "test_a_recording_that_finds_no_room_says_so_and_what_was_flushed_is_whole",
            "sa_hub/test_full_disk.py::"
            "test_an_archive_loses_nothing_that_it_took_and_takes_again_when_there_is_room",
            "shared/test_logs_full_disk.py::test_a_full_disk_behind_the_log_stops_nobody",
        ),
        ("disk_full",),
    ),
    FaultRow(
        "memory pressure",
        "`handler_errors` in health, or the process ends and is started again",
        "as when it is killed",
        (
            "proving_ground/test_process_faults.py::"
            "test_who_is_killed_or_dies_of_want_of_memory_is_started_again",
        ),
        ("memory_short",),
    ),
    FaultRow(
        "ten times as many messages on the bus",
        "`bus_rejected`, `other_places` in health",
        _NOTHING,
        (
            "service/test_zenoh_bus.py::test_garbage_on_a_key_is_counted_and_survived",
            "sa_hub/test_radio_seal.py::test_a_flood_of_garbage_is_cheap_and_does_not_keep_good_frames_out",
        ),
        ("bus_flood",),
    ),
    FaultRow(
        "damaged configuration",
        "one line: what, where, what would be right; exit 2, and `up` does not try again",
        _NOTHING,
        ("processes/test_up.py::test_what_cannot_run_as_configured_ends_all_with_its_reason",),
    ),
    FaultRow(
        "damaged saved state",
        "`saved state refused, starting afresh` with the reason; `memory_unreadable` in health",
        "the memory",
        (
            "shared/test_saved_state.py::test_no_damage_is_taken_for_state",
            "pdr_engine/test_engine_memory.py::test_a_record_that_contradicts_itself_is_left_aside",
        ),
    ),
    FaultRow(
        "wrong keys",
        "`forged` counted on the link of everybody else; the soldier is not in their picture",
        "nothing of others",
        (
            "sa_hub/test_radio_seal.py::test_frames_of_another_key_net_or_tag_are_forged_here",
            "sa_hub/test_hub_settings.py::test_a_wrong_key_file_is_refused_in_one_line",
        ),
    ),
    FaultRow(
        "two computers with one identity",
        "each counts the other's frames as `own_echo`; receivers keep to the newer epoch and count replays",
        "the older one's reports",
        (
            "sa_hub/test_radio_seal.py::test_frames_of_an_earlier_epoch_are_replays",
            "sa_hub/test_radio_seal.py::test_two_processes_on_one_file_never_share_a_counter",
        ),
    ),
)
