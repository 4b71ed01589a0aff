"""Lines and words on a terminal: a canvas of Braille dots, two by four to a character, coloured by layer."""

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import numpy.typing as npt
from rich.text import Text

FloatArray = npt.NDArray[np.float64]
_DOTS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])
_BRAILLE = 0x2800
_NARROWEST = 30  # columns, so that words find room


@dataclass
class Canvas:
    """Covers ``bounds`` (west, south, east, north) m with at most ``columns`` by ``rows`` characters.

    ``styles`` are the layers' colours, from layer 1 on.
    """

    bounds: tuple[float, float, float, float]
    columns: int
    rows: int
    styles: tuple[str, ...]
    _pitch_m: float = field(init=False)  # from dot to dot
    _layers: npt.NDArray[np.uint8] = field(init=False)
    _words: dict[tuple[int, int], tuple[str, str]] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        wide_m, high_m = self.bounds[2] - self.bounds[0], self.bounds[3] - self.bounds[1]
        self._pitch_m = max(wide_m / (2 * self.columns - 1), high_m / (4 * self.rows - 1), 1e-3)
        self.rows = int(high_m / self._pitch_m) // 4 + 1
        self.columns = min(self.columns, max(_NARROWEST, int(wide_m / self._pitch_m) // 2 + 1))
        self._layers = np.zeros((self.rows * 4, self.columns * 2), dtype=np.uint8)

    def _dot(self, at_m: npt.ArrayLike) -> npt.NDArray[np.int64]:
        """(row, column) of dots at points (..., 2)."""
        east, north = np.moveaxis(np.asarray(at_m, dtype=np.float64), -1, 0)
        row, column = (self.bounds[3] - north) / self._pitch_m, (east - self.bounds[0]) / self._pitch_m
        return np.stack([np.round(row), np.round(column)], axis=-1).astype(np.int64)

    def line(self, points_m: npt.ArrayLike, layer: int) -> None:
        """A polyline (k, 2); what is outside is left out, the higher layer stays on top."""
        for start, end in pairwise(np.asarray(points_m, dtype=np.float64)[:, :2]):
            count = int(np.hypot(*(end - start)) / self._pitch_m * 2.0) + 2
            dots = self._dot(start + np.linspace(0.0, 1.0, count)[:, None] * (end - start))
            inside = ((dots >= 0) & (dots < self._layers.shape)).all(axis=1)
            row, column = dots[inside].T
            self._layers[row, column] = np.maximum(self._layers[row, column], layer)

    def write(self, at_m: tuple[float, float], word: str, style: str = "bold") -> None:
        """A word around a point, if there is room between other words."""
        row, column = self._dot(at_m) // (4, 2)
        first = int(column) - len(word) // 2
        cells = [(int(row), first + index) for index in range(len(word))]
        fits = 0 <= row < self.rows and first >= 0 and first + len(word) <= self.columns
        if fits and not any(cell in self._words for cell in cells):
            self._words |= {cell: (letter, style) for cell, letter in zip(cells, word, strict=True)}

    def render(self) -> Text:
        """The picture."""
        text = Text(no_wrap=True)
        cells = self._layers.reshape(self.rows, 4, self.columns, 2).swapaxes(1, 2)
        for row, line in enumerate(cells):
            for column, cell in enumerate(line):
                letter, style = self._words.get((row, column), ("", ""))
                top = int(cell.max())
                dots = chr(_BRAILLE + int(_DOTS[cell > 0].sum())) if top else " "
                text.append(letter or dots, style if letter else self.styles[top - 1] if top else "")
            text.append("\n")
        return text
