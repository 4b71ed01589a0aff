"""What was heard of a sender's frames, to bits and back: at the end of a report's frame, or alone in one."""

from typing import Final

from sa_hub.radio.bits import BitReader, BitWriter
from sa_hub.radio.content import Feedback
from sa_hub.radio.control import Asked
from sa_hub.radio.layout import FEEDBACK, FEEDBACK_ALONE, KIND_BITS, Kind, read_fields, write_fields

SPAN_STEP: Final = 4
LONGEST_SPAN: Final = 8 * SPAN_STEP
COUNTER_MODULUS: Final = 256


def encode_feedback(feedback: Feedback, *, exercise: bool) -> bytes:
    """The payload of a frame that tells nothing else."""
    writer = BitWriter()
    writer.put(Kind.FEEDBACK, KIND_BITS)
    write_fields(writer, FEEDBACK_ALONE, {"exercise": int(exercise)})
    write_feedback(writer, feedback)
    return writer.to_bytes()


def decode_feedback(reader: BitReader, _now_tick: int) -> tuple[bool, Feedback, Asked | None]:
    """Whether it is exercise, and what was heard."""
    exercise = bool(read_fields(reader, FEEDBACK_ALONE, {})["exercise"])
    return exercise, _read(reader), None


def write_feedback(writer: BitWriter, feedback: Feedback | None) -> None:
    """Append what was heard of somebody's frames, if anything is to be told."""
    if feedback is None:
        return
    values = {
        "about": feedback.about,
        "newest": feedback.newest % COUNTER_MODULUS,
        "span": feedback.span // SPAN_STEP - 1,
        "heard": feedback.heard,
        "4 · span + 4": feedback.span,
    }
    write_fields(writer, FEEDBACK, values)


def read_feedback(reader: BitReader) -> Feedback | None:
    """What is told of our or others' frames; None if the payload ends here."""
    return None if reader.left < 8 else _read(reader)


def _read(reader: BitReader) -> Feedback:
    values = read_fields(reader, FEEDBACK[:3], {})
    values["4 · span + 4"] = SPAN_STEP * (values["span"] + 1)
    values = read_fields(reader, FEEDBACK[3:], values)
    return Feedback(values["about"], values["newest"], values["4 · span + 4"], values["heard"])
