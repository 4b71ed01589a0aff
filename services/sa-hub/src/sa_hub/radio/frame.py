"""Frame payloads, version 1: contents to bits and back, absolute anchors only, never against an earlier frame.

The tables of `layout` say where each bit stands, the functions of `quantise` bound every rounding. Decoding takes
any bytes and either gives contents that make valid messages or raises `FrameError`.
"""

from collections.abc import Callable
from dataclasses import dataclass

from bootprint.config import Origin
from sa_hub.radio import notice_codec
from sa_hub.radio.bits import BitReader
from sa_hub.radio.content import Content, Notice, Report, Reports
from sa_hub.radio.errors import FrameError
from sa_hub.radio.layout import Kind
from sa_hub.radio.quantise import tick_of
from sa_hub.radio.report_codec import ReportCodec


@dataclass(frozen=True, slots=True)
class Frame:
    """A payload decoded: whether it belongs to an exercise, and what it says."""

    exercise: bool
    content: Content


class Codec:
    """Contents to payloads and back, for one realm (near anchors lie around its origin)."""

    def __init__(self, origin: Origin, *, exercise: bool = False) -> None:
        self._exercise = exercise
        self._reports = ReportCodec(origin, exercise=exercise)
        self._notices: dict[int, Callable[[BitReader, int], tuple[bool, Notice]]] = {
            Kind.ALERT: notice_codec.decode_alert,
            Kind.OBSERVATION: notice_codec.decode_observation,
            Kind.STATUS: notice_codec.decode_status,
        }
        self._squads: dict[int, Callable[[BitReader, int, int], tuple[bool, tuple[Report, ...]]]] = {
            Kind.SELF: self._reports.decode_self,
            Kind.SQUAD: self._reports.decode_squad,
        }

    def encode(self, sender: int, content: Content, resolution: int, limit_bytes: int) -> tuple[Kind, bytes]:
        """The payload and its kind; texts are cut to fit ``limit_bytes``, reports are not.

        ValueError if reports span more than one frame can say: `squad.partition` makes groups that do not.
        """
        if not isinstance(content, Reports):
            return notice_codec.encode_notice(content, exercise=self._exercise, limit_bytes=limit_bytes)
        reports = content.reports
        if len(reports) == 1 and reports[0].number == sender and reports[0].hops == 0:
            return Kind.SELF, self._reports.encode_self(reports[0], resolution)
        return Kind.SQUAD, self._reports.encode_squad(reports, resolution)

    def decode(self, kind: int, sender: int, payload: bytes, now_ns: int) -> Frame:
        """What a payload says; times are those nearest to ``now_ns``. Raises FrameError only."""
        reader = BitReader(payload)
        now_tick = tick_of(now_ns)
        if kind in self._squads:
            exercise, reports = self._squads[kind](reader, sender, now_tick)
            frame = Frame(exercise, Reports(reports))
        elif kind in self._notices:
            frame = Frame(*self._notices[kind](reader, now_tick))
        else:
            raise FrameError("kind", f"kind {kind} is not known")
        reader.finish()
        return frame
