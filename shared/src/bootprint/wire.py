"""Messages to bytes and back: MessagePack maps, typed and checked by the topic they travel under."""

import msgspec
import numpy as np

from bootprint.errors import WireError
from bootprint.messages import Message
from bootprint.topics import BY_SUBJECT

MAX_MESSAGE_BYTES = 1 << 20


def _plain(value: object) -> object:
    """NumPy's scalars as Python's: filters compute with them, and forgetting a float() must not stop a process."""
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"a {type(value).__name__} cannot travel on the bus")


_ENCODER = msgspec.msgpack.Encoder(order="deterministic", enc_hook=_plain)


# All built here, before any thread: two threads that build decoders of one struct at once crash msgspec 0.22.
_DECODERS: dict[str, msgspec.msgpack.Decoder[Message]] = {
    subject: msgspec.msgpack.Decoder(topic.message) for subject, topic in BY_SUBJECT.items()
}


def encode(message: Message) -> bytes:
    """The message as a MessagePack map; the same message always gives the same bytes."""
    return _ENCODER.encode(message)


def decode(subject: str, payload: bytes) -> Message:
    """The message of a subject; unknown fields are ignored, anything wrong raises WireError."""
    if len(payload) > MAX_MESSAGE_BYTES:
        raise WireError(f"{subject}: {len(payload)} bytes, more than {MAX_MESSAGE_BYTES}")
    try:
        return _DECODERS[subject].decode(payload)
    except (msgspec.DecodeError, msgspec.ValidationError, ValueError, RecursionError) as error:
        raise WireError(f"{subject}: {error}") from error
