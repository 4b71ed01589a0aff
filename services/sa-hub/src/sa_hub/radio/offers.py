"""Which frame buys the most: whom to take along, how wide a modulus, for receivers that missed how much.

A soldier goes along when telling is worth more than the bits at the going price; a frame is sent when what is left
over pays for its header and tag. (The value per bit of a study over patrols, building clearing and recorded walks.)
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from sa_hub.radio.ground import FloatArray
from sa_hub.radio.history import allowed_cells
from sa_hub.radio.layout import LATTICES, MISSES
from sa_hub.radio.picture import IntArray
from sa_hub.radio.squad import MAX_SOLDIERS
from sa_hub.radio.update_codec import MAX_ENTRIES

UPDATE_HEAD_BITS: Final = 28
SQUAD_HEAD_BITS: Final = 80
MOTION_BITS: Final = 6
LEAST_ENTRY_BITS: Final = 8.0
RESOLUTIONS: Final = tuple(sorted({resolution for resolution, _ in LATTICES}))
_GAP_BITS: Final = 2
_SQUAD_ENTRY_BITS: Final = 8


_REACHES: Final = {
    resolution: np.array([reach for each, reach in LATTICES if each == resolution])
    for resolution in RESOLUTIONS
}
_ALLOWED: Final = {
    resolution: np.array([allowed_cells(resolution, int(reach)) for reach in reaches])
    for resolution, reaches in _REACHES.items()
}


@dataclass(frozen=True)
class Wares:
    """What there is to tell of n soldiers. ``worth`` (rows, n): of telling, by receiver; ``behind`` likewise.

    ``bits`` (n,) beside the place; ``changes_bits`` (n, DEPTH) of what has changed, by how much may be missed;
    ``off_cells`` (n, DEPTH) see `History.cells_off`; ``span_cells``: how far the soldiers lie apart.
    """

    worth: FloatArray
    behind: IntArray
    bits: FloatArray
    changes_bits: FloatArray
    off_cells: FloatArray
    refresh: FloatArray
    span_cells: float
    resolution: int


@dataclass(frozen=True)
class Terms:
    """What bits cost: ``price`` per bit in the frame, ``frame_price`` of sending one at all, and room for how many.

    ``delivered`` is the share of frames that are heard, ``least_misses`` what an update must allow for.
    """

    price: float
    frame_price: float
    room_bits: float
    delivered: float
    least_misses: int


@dataclass(frozen=True)
class Offer:
    """A frame: its soldiers (indices into the wares), most urgent first, its bits; ``misses`` None: in full."""

    surplus: float
    picked: IntArray
    bits: float = 0.0
    reach_bits: int = 0
    misses: int | None = None


def best_offer(wares: Wares, terms: Terms) -> Offer | None:
    """The frame with the largest surplus; None if no frame is worth its bits."""
    offers = [_in_full(wares, terms)]
    offers += [_update(wares, terms, misses) for misses in _allowances(wares, terms)]
    best = max(offers, key=lambda offer: offer.surplus)
    return best if best.surplus > 0.0 else None


def _allowances(wares: Wares, terms: Terms) -> list[int]:
    """What an update may allow to be missed: up to the first that leaves out nobody who can be reached at all."""
    most = int(np.max(np.where(wares.behind <= MISSES[-1], wares.behind, 0), initial=terms.least_misses))
    enough = next(misses for misses in MISSES if misses >= most)
    return [misses for misses in MISSES if terms.least_misses <= misses <= enough]


def _update(wares: Wares, terms: Terms, misses: int) -> Offer:
    """The best modulus for an update that allows so much to be missed."""
    gain = terms.delivered * np.where(wares.behind <= misses, wares.worth, 0.0).mean(axis=0)
    resolvable = wares.off_cells[:, misses] < _ALLOWED[wares.resolution][:, None]
    reaches = _REACHES[wares.resolution]
    bits = _GAP_BITS + wares.bits + wares.changes_bits[:, misses] + 2.0 * reaches[:, None]
    surplus = np.where(resolvable, gain - terms.price * bits, -1.0)
    totals = np.maximum(surplus, 0.0).sum(axis=1)
    best = int(np.argmax(totals))
    picked = _picked(surplus[best], bits[best], terms.room_bits - UPDATE_HEAD_BITS, MAX_ENTRIES)
    total = float(surplus[best][picked].sum()) - terms.frame_price - terms.price * UPDATE_HEAD_BITS
    size = UPDATE_HEAD_BITS + float(bits[best][picked].sum())
    return Offer(total if len(picked) else -1.0, picked, size, int(reaches[best]), misses)


def _in_full(wares: Wares, terms: Terms) -> Offer:
    """Everybody worth it against one anchor, which all can read."""
    gain = terms.delivered * wares.worth.mean(axis=0) + wares.refresh
    place_bits = 2.0 * np.ceil(np.log2(wares.span_cells + 1.0))
    bits = _SQUAD_ENTRY_BITS + place_bits + wares.bits
    surplus = gain - terms.price * bits
    picked = _picked(surplus, bits, terms.room_bits - SQUAD_HEAD_BITS, MAX_SOLDIERS)
    total = float(surplus[picked].sum()) - terms.frame_price - terms.price * SQUAD_HEAD_BITS
    return Offer(total if len(picked) else -1.0, picked, SQUAD_HEAD_BITS + float(bits[picked].sum()))


def _picked(surplus: FloatArray, bits: FloatArray, room_bits: float, most: int) -> IntArray:
    """The soldiers with a surplus, the largest first, as far as the frame's room goes; one always has room."""
    order = np.argsort(-surplus, kind="stable")
    order = order[: int(np.count_nonzero(surplus > 0.0))][:most]
    fits = np.cumsum(bits[order]) <= room_bits
    fits[:1] = True
    return order[fits]
