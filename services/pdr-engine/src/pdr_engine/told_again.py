"""Samples that the process before this one has had: the bus tells them again, and they are passed over."""

from dataclasses import dataclass

from bootprint.messages import ImuBatch


@dataclass(slots=True)
class Had:
    """What a unit has had: batches up to this time (UTC ns) and number; ``until_ns`` None is for nothing to ask."""

    until_ns: int | None = None
    batch: int = -1

    def is_new(self, batch: ImuBatch) -> bool:
        """Whether a batch is to be taken in; from the first one on that is, all are.

        What was had has both an old number and an old time: a gateway that began anew counts from 0, but later, and
        one whose clock was set back counts on.
        """
        if self.until_ns is None:
            return True
        if batch.sequence <= self.batch and int(batch.times[-1]) <= self.until_ns:
            return False
        self.until_ns = None
        return True
