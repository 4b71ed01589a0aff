"""One radio net as this hub sees it: hears sealed frames, speaks within the budget; no sockets.

Notices go before reports, and while one waits for its bits nothing else is sent. Some bits are kept for alerts and
what belongs to them, so that these never wait. A frame is built from the newest reports only when the bucket can
pay for it, so nothing stale ever queues.
"""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import Final

from bootprint.clock import NS_PER_S
from bootprint.errors import BootprintError
from bootprint.messages import LinkReport
from sa_hub.radio.budget import TokenBucket
from sa_hub.radio.content import (
    AlertNotice,
    Content,
    Feedback,
    Notice,
    ObservationNotice,
    Report,
    Reports,
    Update,
)
from sa_hub.radio.control import MOST_FRAGMENTS, Acknowledgement, Asked, Request
from sa_hub.radio.correspondence import Correspondence, Station, Told
from sa_hub.radio.errors import FrameError
from sa_hub.radio.fragments import HEAD_BYTES, Cutter
from sa_hub.radio.frame import Codec
from sa_hub.radio.header import Header, read_header
from sa_hub.radio.layout import FULL_HEADER_BYTES
from sa_hub.radio.link_profile import SMALLEST_MTU_BYTES, LinkProfile
from sa_hub.radio.meter import LinkMeter
from sa_hub.radio.quantise import resolution_for
from sa_hub.radio.reception import Reception
from sa_hub.radio.relevance import Relevance
from sa_hub.radio.room import Room
from sa_hub.radio.scheduler import Policy, Scheduler
from sa_hub.radio.seal import Opened, Opener, Sealer

_AMPLE: Final = 0.75
"""A bucket fuller than this has bits to spare: the pacing of reports aims at half."""
_MOST_FRAMES_AT_ONCE: Final = 8
_UNOPENED_AT_LEAST: Final = 3  # frames; the first ones of a sender may have been missed
_REQUEST_BYTES: Final = 12
_FEEDBACK_BYTES: Final = 18
_RESERVED_FRAMES: Final = 3
_RESERVED_FRAME_BYTES: Final = 24
_NAMES_BYTES: Final = 9
"""What naming those who are asked adds to a notice at most."""


class RadioNet:
    """The radio side of one link; contents in and out, sealed frames out and in."""

    def __init__(
        self,
        profile: LinkProfile,
        policy: Policy,
        number: int,
        codec: Codec,
        sealer: Sealer,
        opener: Opener,
        relevance: Relevance | None = None,
        *,
        relays: bool = False,
    ) -> None:
        self.profile = profile
        self.opener = opener
        self.scheduler = Scheduler(policy, number, codec.grid, relevance)
        ask_s, feedback_s = (
            8 * profile.air_bytes(size) / profile.rate_bits_per_s
            for size in (_REQUEST_BYTES, _FEEDBACK_BYTES)
        )
        station = Station(profile.name, number, relays, ask_s)
        self.correspondence = Correspondence(station, sealer.full_headers, codec.decode)
        self.meter = LinkMeter(profile.medium)
        self.counter_faults = 0
        self.faults = 0
        self._number = number
        self._codec = codec
        self._sealer = sealer
        self._bucket = TokenBucket(profile.rate_bits_per_s, profile.depth_bits, profile.pace_bits_per_s)
        self._resolution = resolution_for(policy.threshold_m / 2.0)
        self._cutter = Cutter()
        self._reception = Reception(codec.grid, f"{profile.name}|{number}", feedback_s)
        self._payload_limits: dict[int, int] = {}
        self._epoch = sealer.next_epoch()

    # -- hearing ----------------------------------------------------------------------------------------------

    def hear(
        self, datagram: bytes, now_ns: int, known: Collection[int], *, exercise: bool
    ) -> tuple[int, Told] | None:
        """The sender and what it says to the hub; None if that is nothing.

        What is not a good frame from a known sender is counted by its cause.
        """
        self.meter.heard(self.profile.copy_bytes(len(datagram)))
        try:
            heard = self._open(datagram, now_ns, known, exercise=exercise)
        except FrameError as error:
            self.meter.rejected[error.cause] += 1
            return None
        self.meter.frames_received += 1
        return None if heard[1] is None else (heard[0], heard[1])

    @property
    def opens_nothing(self) -> bool:
        """Whether frames of the roster's senders are heard and not one of them could be opened."""
        sealed = self.meter.rejected["forged"] + self.meter.rejected["unknown_epoch"]
        return self.opener.opened == 0 and sealed >= _UNOPENED_AT_LEAST

    def _open(
        self, datagram: bytes, now_ns: int, known: Collection[int], *, exercise: bool
    ) -> tuple[int, Told | None]:
        header = read_header(datagram)
        if header.sender == self._number:
            raise FrameError("own_echo", "our own frame")
        if header.sender not in known:
            raise FrameError("unknown_sender", f"{header.sender} is not in the roster")
        opened = self._unseal(datagram, header, now_ns)
        frame = self._codec.decode(opened.sender, opened.payload, now_ns)
        if frame.exercise != exercise:
            raise FrameError("exercise", f"exercise is {frame.exercise}, ours is {exercise}")
        told = self.correspondence.heard(opened, frame, now_ns)
        return opened.sender, self._resolved(opened, frame.content, now_ns) or told

    def _unseal(self, datagram: bytes, header: Header, now_ns: int) -> Opened:
        self.opener.pass_time(now_ns)
        try:
            return self.opener.open(datagram, header)
        except FrameError as error:
            if header.full is None and error.cause in ("unknown_epoch", "forged"):
                self.correspondence.unread(header.sender, epoch_known=error.cause == "forged")
            raise

    def _resolved(self, opened: Opened, content: Content, now_ns: int) -> Reports | None:
        """An update as the reports that it means to us; takes in what the sender tells of our own frames."""
        self.scheduler.listeners.heard_from(opened.sender, now_ns)
        feedback = content.feedback if isinstance(content, Reports | Update) else content
        if isinstance(feedback, Feedback) and feedback.about == self._number:
            self.scheduler.told_what_was_heard(opened.sender, feedback, now_ns)
        return self._reception.heard(opened, content, now_ns)

    @property
    def unresolved(self) -> int:
        """Soldiers in updates that said nothing to us, since we had missed too much."""
        return self._reception.unresolved

    # -- speaking ---------------------------------------------------------------------------------------------

    def speak(self, candidates: Sequence[Report], now_ns: int) -> list[bytes]:
        """The frames to send now: due notices and the like, then due reports, as far as the budget goes."""
        frames: list[bytes] = []
        self._bucket.refused = False
        self._bucket.fill(now_ns)
        self._sealer.full_headers.ample = self._bucket.free_bits > _AMPLE * self._bucket.depth_bits
        self._sealer.full_headers.known = self.scheduler.listeners.all_hear
        try:
            if self._speak_notices(frames, now_ns):
                self._speak_reports(frames, candidates, now_ns)
                self._speak_feedback(frames, now_ns)
        except BootprintError:
            # Without fresh counters silence is the only safe thing; the next step tries again.
            self.counter_faults += 1
        return frames

    def _speak_notices(self, frames: list[bytes], now_ns: int) -> bool:
        """False if a notice is still waiting for its bits."""
        while sending := self.correspondence.due(now_ns):
            frame = self._transmit(sending.content, now_ns, sending.asked)
            if frame is None:
                return False
            frames.append(frame)
            sending.sent(now_ns, self._sealer.last_counter)
        return True

    def _speak_reports(self, frames: list[bytes], candidates: Sequence[Report], now_ns: int) -> None:
        scheduler = self.scheduler
        if not scheduler.is_due(now_ns):
            return
        scheduler.pass_time(self._room(now_ns), len(candidates), now_ns)
        if self._sealer.next_epoch() != self._epoch:
            # Receivers resolve updates by frames of the same epoch alone.
            self._epoch = self._sealer.next_epoch()
            scheduler.begin_again()
        for _ in range(_MOST_FRAMES_AT_ONCE):
            plan = scheduler.plan(candidates, self._room(now_ns), now_ns, urged=self._reception.urged)
            if plan is None:
                return
            feedback = self._reception.feedback(scheduler.telling_of, now_ns, cheap=scheduler.is_cheap)
            plan = self._fitting(replace(plan, feedback=feedback))
            frame = self._transmit(plan, now_ns)
            if frame is None:
                return
            if plan.feedback is not None:
                self._reception.fed_back(plan.feedback, now_ns, alone=False)
            frames.append(frame)

    def _speak_feedback(self, frames: list[bytes], now_ns: int) -> None:
        """What no report takes along, in a frame of its own."""
        feedback = self._reception.lone_feedback(self.scheduler.telling_of, now_ns)
        frame = None if feedback is None else self._transmit(feedback, now_ns)
        if feedback is not None and frame is not None:
            self._reception.fed_back(feedback, now_ns, alone=True)
            frames.append(frame)

    def _room(self, now_ns: int) -> Room:
        """What link and budget allow a report's frame now."""
        kept = self._kept_bits
        limit = self._payload_limit(self._reserved_bits)
        overhead = self._sealer.overhead_bytes(now_ns)
        empty, full = (8.0 * self.profile.air_bytes(overhead + more) for more in (0, limit))
        return Room(
            free_bits=max(0.0, self._bucket.free_bits - kept),
            depth_bits=float(self._bucket.depth_bits - self._reserved_bits),
            rate_bits_per_s=float(self.profile.rate_bits_per_s),
            payload_bits=8.0 * limit,
            frame_bits=empty,
            bits_per_bit=(full - empty) / (8.0 * limit),
        )

    def _fitting(self, plan: Reports | Update) -> Reports | Update:
        """As much of a plan as one frame can hold, the feedback given up first."""
        limit = self._payload_limit(self._reserved_bits)
        while True:
            payload, count = self._encode(plan), len(_told(plan))
            if len(payload) <= limit or (count == 1 and plan.feedback is None):
                return plan
            if plan.feedback is not None:
                plan = replace(plan, feedback=None)
            else:
                plan = _cut(plan, min(count - 1, count * limit // len(payload) + 1))

    @cached_property
    def _reserved_bits(self) -> int:
        """What only alerts, acknowledgements and requests may spend: some frames, of a shallow bucket a part."""
        depth_bits = self._bucket.depth_bits
        wanted = 8 * _RESERVED_FRAMES * self.profile.air_bytes(_RESERVED_FRAME_BYTES)
        spare = depth_bits - 8 * self.profile.air_bytes(SMALLEST_MTU_BYTES)
        return max(0, min(wanted, depth_bits // 4, spare))

    @property
    def _kept_bits(self) -> int:
        """What is kept now: the reserve grows from a quarter of what comes in, so that a start is not silent."""
        return min(self._reserved_bits, self._bucket.earned_bits // 4)

    def _kept_from(self, content: Content) -> int:
        """What this may not spend: answers to others' alerts leave half of the reserve to our own."""
        if isinstance(content, AlertNotice):
            return 0
        return self._kept_bits // 2 if _is_urgent(content) else self._kept_bits

    def _payload_limit(self, keep_bits: int) -> int:
        """Bytes left for a payload in the longest frame that link and bucket can ever let through."""
        limit = self._payload_limits.get(keep_bits)
        if limit is None:
            limit = self._payload_limits[keep_bits] = self._find_payload_limit(keep_bits)
        return limit

    def _find_payload_limit(self, keep_bits: int) -> int:
        longest = self.profile.longest_frame(self._bucket.depth_bits - keep_bits)
        return longest - FULL_HEADER_BYTES - self._sealer.tag_bytes

    def _encode(self, content: Content, asked: Asked | None = None) -> bytes:
        limit = self._payload_limit(0 if _is_urgent(content) else self._reserved_bits)
        return self._codec.encode(self._number, content, self._resolution, limit, asked)

    def _transmit(self, content: Content, now_ns: int, asked: Asked | None = None) -> bytes | None:
        """Seal and pay; None if the bucket cannot pay yet."""
        payload = self._encode(content, asked)
        air_bytes = self.profile.air_bytes(len(payload) + self._sealer.overhead_bytes(now_ns))
        if not self._bucket.take(air_bytes, now_ns, self._kept_from(content)):
            return None
        self.meter.sent(air_bytes, now_ns)
        frame = self._sealer.seal(payload, now_ns)
        # What receivers have from now on is what the frame says, rounded as it is.
        told = self._codec.decode(self._number, payload, now_ns).content
        self.scheduler.sent(self._sealer.last_counter, told, now_ns)
        return frame

    def hold(self, *, busy: bool) -> None:
        """Whether the link's modem can take a frame now; while it is busy, whatever is due is kept back unmade."""
        self._bucket.busy = busy

    def post(self, notice: Notice, now_ns: int) -> None:
        """Queue a notice for this net; a long observation goes in parts."""
        outbox = self.correspondence.outbox
        limit = self._payload_limit(self._reserved_bits)
        if isinstance(notice, ObservationNotice):
            most = MOST_FRAGMENTS * (limit - HEAD_BYTES)
            payload = self._codec.encode(self._number, notice, self._resolution, most)
            if len(payload) + _NAMES_BYTES > limit:
                for part in self._cutter.cut(payload, limit):
                    outbox.post(part, now_ns)
                return
        outbox.post(notice, now_ns)

    def set_back(self, by_ns: int) -> None:
        """The clock was set back by so much: all that is held in its time goes with it."""
        parts = self._bucket, self._sealer, self.scheduler, self.correspondence, self.meter, self._reception
        for part in parts:
            part.set_back(by_ns)

    # -- accounting -------------------------------------------------------------------------------------------

    def report(self, now_ns: int, ids: Mapping[int, str]) -> LinkReport:
        """What this link carried until now, and how good the net's picture is; ``ids`` of the roster by number."""
        meter = self.meter
        newest_ns, errors_m = self.scheduler.newest_ns(), self.scheduler.expected_errors_m()
        return LinkReport(
            time_ns=now_ns,
            link=self.profile.name,
            budget_bits_per_s=float(self.profile.rate_bits_per_s),
            bits_per_s=meter.bits_per_s(now_ns),
            frames_sent=meter.frames_sent,
            frames_received=meter.frames_received,
            frames_rejected=meter.rejected.total() - meter.rejected["own_echo"],
            frames_lost=max(0, self.opener.lost),
            bytes_sent=meter.bytes_sent,
            bytes_received=meter.bytes_received,
            drops=dict(meter.rejected),
            airtime_share=meter.airtime_share(now_ns),
            duty_left_s=meter.duty_left_s(now_ns),
            frames_waiting=int(self._bucket.refused),
            ages_s={ids[n]: max(0.0, (now_ns - at_ns) / NS_PER_S) for n, at_ns in newest_ns.items()},
            expected_errors_m={ids[n]: m if math.isfinite(m) else None for n, m in errors_m.items()},
        )


def _is_urgent(content: Content) -> bool:
    """What may spend of the reserve."""
    return isinstance(content, AlertNotice | Acknowledgement | Request)


def _told(plan: Reports | Update) -> Sequence[object]:
    return plan.reports if isinstance(plan, Reports) else plan.entries


def _cut(plan: Reports | Update, count: int) -> Reports | Update:
    """The same with its first soldiers only."""
    if isinstance(plan, Reports):
        return replace(plan, reports=plan.reports[:count])
    return replace(plan, entries=plan.entries[:count])
