"""Bits to bytes and back, most significant bit first; the rest of the last byte is zero."""

from sa_hub.radio.errors import FrameError


class BitWriter:
    """Gathers unsigned numbers of any width."""

    def __init__(self) -> None:
        self._value = 0
        self._bits = 0

    def put(self, value: int, bits: int) -> None:
        """Append ``value`` as ``bits`` bits; ValueError if it does not fit, for that is a fault of the caller."""
        if not 0 <= value < 1 << bits:
            raise ValueError(f"{value} does not fit in {bits} bits")
        self._value = self._value << bits | value
        self._bits += bits

    def put_bytes(self, data: bytes) -> None:
        """Append whole bytes, at any bit position."""
        self.put(int.from_bytes(data), 8 * len(data))

    def put_rice(self, value: int, parameter: int) -> None:
        """Append a number, small ones in few bits: so many ones, a zero, then the low ``parameter`` bits."""
        for _ in range(value >> parameter):
            self.put(1, 1)
        self.put(0, 1)
        self.put(value & ((1 << parameter) - 1), parameter)

    def put_all(self, other: "BitWriter") -> None:
        """Append all that another has gathered."""
        self.put(other._value, other._bits)

    @property
    def padding(self) -> int:
        """Zeros that would fill up the last byte."""
        return -self._bits % 8

    def to_bytes(self) -> bytes:
        """All bits so far, filled up with zeros to a whole byte."""
        padding = self.padding
        return (self._value << padding).to_bytes((self._bits + padding) // 8)


class BitReader:
    """Takes unsigned numbers out of bytes; FrameError when they are used up."""

    def __init__(self, data: bytes) -> None:
        self._value = int.from_bytes(data)
        self._left = 8 * len(data)

    def take(self, bits: int) -> int:
        """The next ``bits`` bits as an unsigned number."""
        if bits > self._left:
            raise FrameError("short", f"wanted {bits} bits, {self._left} are left")
        self._left -= bits
        return (self._value >> self._left) & ((1 << bits) - 1)

    def take_rice(self, parameter: int) -> int:
        """The next number that `BitWriter.put_rice` wrote."""
        zeros = ~self._value & ((1 << self._left) - 1)
        # All ones at once: one by one, a long payload of nothing else would take seconds.
        ones = self._left - zeros.bit_length()
        self.take(ones + 1)
        return ones << parameter | self.take(parameter)

    @property
    def left(self) -> int:
        """Bits that are not taken yet."""
        return self._left

    def take_bytes(self, count: int) -> bytes:
        """The next ``count`` bytes, from any bit position."""
        return self.take(8 * count).to_bytes(count)

    def finish(self) -> None:
        """FrameError unless less than a byte is left, and that is zero."""
        if self._left >= 8:
            raise FrameError("long", f"{self._left} bits after the end")
        if self.take(self._left):
            raise FrameError("padding", "the bits after the end are not zero")
