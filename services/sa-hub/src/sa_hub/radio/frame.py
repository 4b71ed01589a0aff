"""Frame payloads, version 3: contents to bits and back, absolute anchors only, never against an earlier frame.

The tables of `layout` say where each bit stands, the functions of `quantise` bound every rounding. Decoding takes
any bytes and either gives contents that make valid messages or raises `FrameError`.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

from bootprint.config import Origin
from sa_hub.radio import control_codec, notice_codec
from sa_hub.radio.bits import BitReader, BitWriter
from sa_hub.radio.content import Content, Feedback, Reports, Update
from sa_hub.radio.control import Asked, Control
from sa_hub.radio.errors import FrameError
from sa_hub.radio.feedback_codec import decode_feedback, encode_feedback, read_feedback, write_feedback
from sa_hub.radio.grid import Grid
from sa_hub.radio.layout import KIND_BITS, Kind
from sa_hub.radio.quantise import tick_of
from sa_hub.radio.report_codec import Decoded, ReportCodec
from sa_hub.radio.update_codec import read_update, write_update


@dataclass(frozen=True, slots=True)
class Frame:
    """A payload decoded: whether it belongs to an exercise, what it says, and who is to acknowledge it."""

    exercise: bool
    content: Content
    asked: Asked | None = None


class Codec:
    """Contents to payloads and back, for one realm (near anchors lie around its origin)."""

    def __init__(self, origin: Origin, *, exercise: bool = False) -> None:
        self.grid = Grid(origin)
        self._exercise = exercise
        self._reports = ReportCodec(origin, exercise=exercise)
        self._others: dict[int, Callable[[BitReader, int], tuple[bool, Content, Asked | None]]] = {
            Kind.ALERT: notice_codec.decode_alert,
            Kind.OBSERVATION: notice_codec.decode_observation,
            Kind.STATUS: notice_codec.decode_status,
            Kind.ACKNOWLEDGEMENT: control_codec.decode_acknowledgement,
            Kind.REQUEST: control_codec.decode_request,
            Kind.FRAGMENT: control_codec.decode_fragment,
            Kind.FEEDBACK: decode_feedback,
        }
        self._squads: dict[int, Callable[[BitReader, int, int], Decoded]] = {
            Kind.SELF: self._reports.decode_self,
            Kind.SQUAD: self._reports.decode_squad,
        }

    def encode(
        self, sender: int, content: Content, resolution: int, limit_bytes: int, asked: Asked | None = None
    ) -> bytes:
        """The payload, its kind first; texts are cut to fit ``limit_bytes``, reports are not.

        ``asked``: who is to acknowledge an alert, an observation or a fragment.

        ValueError if reports span more than one frame can say: `squad.partition` makes groups that do not.
        """
        if isinstance(content, Reports):
            return self._encode_reports(sender, content, resolution)
        if isinstance(content, Update):
            return self._encode_update(sender, content)
        if isinstance(content, Feedback):
            return encode_feedback(content, exercise=self._exercise)
        if isinstance(content, Control):
            return control_codec.encode_control(content, exercise=self._exercise, asked=asked)
        return notice_codec.encode_notice(
            content, exercise=self._exercise, limit_bytes=limit_bytes, asked=asked
        )

    def _encode_reports(self, sender: int, content: Reports, resolution: int) -> bytes:
        writer, reports = BitWriter(), content.reports
        own = len(reports) == 1 and reports[0].number == sender and reports[0].hops == 0
        if own and content.tick in (None, tick_of(reports[0].time_ns)):
            writer.put(Kind.SELF, KIND_BITS)
            self._reports.write_self(writer, reports[0], resolution)
        else:
            writer.put(Kind.SQUAD, KIND_BITS)
            self._reports.write_squad(writer, reports, resolution, content.tick)
        write_feedback(writer, content.feedback)
        return writer.to_bytes()

    def _encode_update(self, sender: int, update: Update) -> bytes:
        writer = BitWriter()
        writer.put(Kind.SQUAD_UPDATE, KIND_BITS)
        write_update(writer, update, sender, exercise=self._exercise)
        write_feedback(writer, update.feedback)
        return writer.to_bytes()

    def decode(self, sender: int, payload: bytes, now_ns: int) -> Frame:
        """What a payload says; times are those nearest to ``now_ns``. Raises FrameError only."""
        reader = BitReader(payload)
        kind = reader.take(KIND_BITS)
        now_tick = tick_of(now_ns)
        if kind in self._squads:
            exercise, tick, reports = self._squads[kind](reader, sender, now_tick)
            frame = Frame(exercise, Reports(reports, read_feedback(reader), tick))
        elif kind == Kind.SQUAD_UPDATE:
            exercise, update = read_update(reader, sender)
            frame = Frame(exercise, replace(update, feedback=read_feedback(reader)))
        elif kind in self._others:
            frame = Frame(*self._others[kind](reader, now_tick))
        else:
            raise FrameError("kind", f"kind {kind} is not known")
        reader.finish()
        return frame
