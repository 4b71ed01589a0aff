"""The times inside messages: shifting them, and when a message can be known at all."""

import msgspec

from bootprint.messages import CameraMotion, ImuBatch, Message


def due_ns(message: Message) -> int:
    """When everything in the message has been measured: for a batch, its last sample's time."""
    return int(message.times[-1]) if isinstance(message, ImuBatch) else message.time_ns


def restamped(message: Message, shift_ns: int, sequence: int) -> Message:
    """The same message with every time in it shifted, and with this sequence number."""
    time_ns = message.time_ns + shift_ns
    if isinstance(message, ImuBatch):
        times = (message.times + shift_ns).astype("<i8").tobytes()
        return msgspec.structs.replace(message, time_ns=time_ns, sample_time_ns=times, sequence=sequence)
    if isinstance(message, CameraMotion):
        start_ns = message.start_time_ns + shift_ns
        return msgspec.structs.replace(message, time_ns=time_ns, start_time_ns=start_ns, sequence=sequence)
    return msgspec.structs.replace(message, time_ns=time_ns, sequence=sequence)
