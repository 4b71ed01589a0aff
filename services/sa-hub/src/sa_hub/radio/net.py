"""One radio net as this hub sees it: hears sealed frames, speaks within the budget; no sockets.

Notices go before reports, and while one waits for its bits nothing else is sent. A frame is built from the newest
reports only when the bucket can pay for it, so nothing stale ever queues.
"""

from collections.abc import Collection, Sequence
from typing import Final

from bootprint.errors import BootprintError
from bootprint.messages import LinkReport
from sa_hub.radio.budget import TokenBucket
from sa_hub.radio.content import Content, Notice, Report, Reports
from sa_hub.radio.errors import FrameError
from sa_hub.radio.frame import Codec
from sa_hub.radio.layout import FULL_HEADER_BYTES, Kind
from sa_hub.radio.meter import LinkMeter
from sa_hub.radio.outbox import Outbox
from sa_hub.radio.quantise import resolution_for
from sa_hub.radio.scheduler import Policy, Scheduler
from sa_hub.radio.seal import Opener, Sealer, read_header
from sa_hub.radio.squad import partition
from sa_hub.settings import LinkProfile

_UNOPENED_AT_LEAST: Final = 3  # frames; the first ones of a sender may have been missed


class RadioNet:
    """The radio side of one link; contents in and out, sealed frames out and in."""

    def __init__(
        self, profile: LinkProfile, policy: Policy, number: int, codec: Codec, sealer: Sealer, opener: Opener
    ) -> None:
        self.profile = profile
        self.opener = opener
        self.scheduler = Scheduler(policy, number)
        self.outbox = Outbox()
        self.meter = LinkMeter()
        self.counter_faults = 0
        self.faults = 0
        self._number = number
        self._codec = codec
        self._sealer = sealer
        self._bucket = TokenBucket(profile.rate_bits_per_s)
        self._resolution = resolution_for(policy.threshold_m / 2.0)

    # -- hearing ----------------------------------------------------------------------------------------------

    def hear(
        self, datagram: bytes, now_ns: int, known: Collection[int], *, exercise: bool
    ) -> tuple[int, Content] | None:
        """The sender and what it says; None, and counted, if the datagram is not a good frame from a known one."""
        self.meter.heard(len(datagram) + self.profile.header_bytes)
        try:
            heard = self._open(datagram, now_ns, known, exercise=exercise)
        except FrameError as error:
            self.meter.rejected[error.cause] += 1
            return None
        self.meter.frames_received += 1
        return heard

    @property
    def opens_nothing(self) -> bool:
        """Whether frames of the roster's senders are heard and not one of them could be opened."""
        sealed = self.meter.rejected["forged"] + self.meter.rejected["unknown_epoch"]
        return self.opener.opened == 0 and sealed >= _UNOPENED_AT_LEAST

    def _open(
        self, datagram: bytes, now_ns: int, known: Collection[int], *, exercise: bool
    ) -> tuple[int, Content]:
        header, _ = read_header(datagram)
        if header.sender == self._number:
            raise FrameError("own_echo", "our own frame")
        if header.sender not in known:
            raise FrameError("unknown_sender", f"{header.sender} is not in the roster")
        opened = self.opener.open(datagram)
        frame = self._codec.decode(opened.kind, opened.sender, opened.payload, now_ns)
        if frame.exercise != exercise:
            raise FrameError("exercise", f"exercise is {frame.exercise}, ours is {exercise}")
        return opened.sender, frame.content

    # -- speaking ---------------------------------------------------------------------------------------------

    def speak(self, candidates: Sequence[Report], now_ns: int) -> list[bytes]:
        """The frames to send now: due notices, then due reports, as far as the budget goes."""
        frames: list[bytes] = []
        self._bucket.fill(now_ns)
        try:
            if self._speak_notices(frames, now_ns):
                self._speak_reports(frames, candidates, now_ns)
        except BootprintError:
            # Without fresh counters silence is the only safe thing; the next step tries again.
            self.counter_faults += 1
        return frames

    def _speak_notices(self, frames: list[bytes], now_ns: int) -> bool:
        """False if a notice is still waiting for its bits."""
        while notice := self.outbox.due(now_ns):
            frame = self._transmit(notice, now_ns)
            if frame is None:
                return False
            frames.append(frame)
            self.outbox.sent(notice, now_ns)
        return True

    def _speak_reports(self, frames: list[bytes], candidates: Sequence[Report], now_ns: int) -> None:
        for group in partition(self.scheduler.due(candidates, now_ns), self._resolution):
            fitting = self._fitting(group)
            frame = self._transmit(Reports(tuple(fitting)), now_ns)
            if frame is None:
                return
            frames.append(frame)

    def _fitting(self, reports: list[Report]) -> list[Report]:
        """As many of the first reports as one frame can hold."""
        limit = self._payload_limit()
        while True:
            _, payload = self._encode(Reports(tuple(reports)))
            if len(payload) <= limit or len(reports) == 1:
                return reports
            reports = reports[: min(len(reports) - 1, len(reports) * limit // len(payload) + 1)]

    def _payload_limit(self) -> int:
        """Bytes left for a payload in the longest frame that link and bucket can ever let through."""
        by_bucket = self._bucket.depth_bits // (8 * self.profile.copies) - self.profile.header_bytes
        return min(self.profile.mtu_bytes, by_bucket) - FULL_HEADER_BYTES - self._sealer.tag_bytes

    def _encode(self, content: Content) -> tuple[Kind, bytes]:
        return self._codec.encode(self._number, content, self._resolution, self._payload_limit())

    def _transmit(self, content: Content, now_ns: int) -> bytes | None:
        """Seal and pay; None if the bucket cannot pay yet."""
        kind, payload = self._encode(content)
        air_bytes = self.profile.air_bytes(len(payload) + self._sealer.overhead_bytes(now_ns))
        if not self._bucket.take(air_bytes, now_ns):
            return None
        self.meter.sent(air_bytes, now_ns)
        if isinstance(content, Reports):
            self._believe(kind, payload, max(report.time_ns for report in content.reports))
        return self._sealer.seal(kind, payload, now_ns)

    def _believe(self, kind: Kind, payload: bytes, newest_ns: int) -> None:
        """Receivers now believe what the frame says, rounded as it is."""
        content = self._codec.decode(kind, self._number, payload, newest_ns).content
        if isinstance(content, Reports):
            for report in content.reports:
                self.scheduler.told(report)

    def post(self, notice: Notice, now_ns: int) -> None:
        """Queue a notice for this net."""
        self.outbox.post(notice, now_ns)

    def set_back(self, by_ns: int) -> None:
        """The clock was set back by so much: all that is held in its time goes with it."""
        for part in (self._bucket, self._sealer, self.scheduler, self.outbox, self.meter):
            part.set_back(by_ns)

    # -- accounting -------------------------------------------------------------------------------------------

    def report(self, now_ns: int) -> LinkReport:
        """What this link carried until now."""
        meter = self.meter
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
        )
