"""Which frame buys the most: whom to take along, how wide a modulus, for receivers that missed how much.

A soldier goes along when telling is worth more than the bits at the going price; a frame is sent when what is left
over pays for its header and tag. (The value per bit of a study over patrols, building clearing and recorded walks.)
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from sa_hub.radio.ground import FloatArray
from sa_hub.radio.history import allowed_cells
from sa_hub.radio.layout import FAR_BITS, LATTICES, MISSES, NEAR_BITS, USUAL_LATTICES
from sa_hub.radio.listeners import LOSSLESS
from sa_hub.radio.picture import BoolArray, IntArray
from sa_hub.radio.squad import MAX_SOLDIERS
from sa_hub.radio.update_codec import MAX_ENTRIES

UPDATE_HEAD_BITS: Final = 26.5
"""Of a usual update, and the half byte that is filled up on the average."""
_UNUSUAL_BITS: Final = 10.0
"""What the head of an update takes more that is not usual."""
_DETAILED_BITS: Final = 3.0
"""What it takes more where details have changed; each entry takes a bit more then, too."""
SQUAD_HEAD_BITS: Final = 80
MOTION_BITS: Final = 6
LEAST_ENTRY_BITS: Final = 2.0 * (min(reach for _, reach in LATTICES) + NEAR_BITS) + 2.0
"""Of a steady entry in a frame that varies: its place by the narrowest modulus, and how it is told."""
RESOLUTIONS: Final = tuple(sorted({resolution for resolution, _ in LATTICES}))
_UNSURE: Final = 5e-5
_RICE_PARAMETERS: Final = (0, 2, 4, 6)
_SQUAD_ENTRY_BITS: Final = 8


@dataclass(frozen=True)
class _Allowed:
    """(R,) finest cells that a prediction may be off, by the reach of the frame: as it is, or varied by entry."""

    usual: FloatArray
    near: FloatArray
    far: FloatArray


def _allowed(resolution: int, reaches: IntArray) -> _Allowed:
    by_bits = (
        [allowed_cells(resolution, reach + more) for reach in reaches.tolist()]
        for more in (0, NEAR_BITS, FAR_BITS)
    )
    return _Allowed(*(np.array(cells) for cells in by_bits))


_REACHES: Final = {
    resolution: np.array([reach for each, reach in LATTICES if each == resolution])
    for resolution in RESOLUTIONS
}
_ALLOWED: Final = {resolution: _allowed(resolution, reaches) for resolution, reaches in _REACHES.items()}


@dataclass(frozen=True)
class Wares:
    """What there is to tell of n soldiers. ``worth`` (rows, n): of telling, by receiver; ``behind`` likewise.

    ``needs`` (n,): what an update must allow for so that hardly anyone refuses it.

    ``bits`` (n,) beside the place, ``velocity_bits`` of them need not be told where ``steady`` (n, DEPTH) holds for
    all that may be missed; ``changes_bits`` (n, DEPTH) of what has changed, by how much may be missed;
    ``off_cells`` (n, DEPTH) see `History.cells_off`; ``span_cells``: how far the soldiers lie apart; ``span``: how
    far their numbers do.
    """

    worth: FloatArray
    behind: IntArray
    needs: IntArray
    bits: FloatArray
    velocity_bits: FloatArray
    steady: BoolArray
    changes_bits: FloatArray
    off_cells: FloatArray
    refresh: FloatArray
    span_cells: float
    span: int
    resolution: int


@dataclass(frozen=True)
class Terms:
    """What bits cost: ``price`` per bit in the frame, ``frame_price`` of sending one at all, and room for how many.

    ``delivered`` is the share of frames that are heard, ``least_misses`` what an update must allow for,
    ``entry_share``: an entry pays so much of its bits' price.
    """

    price: float
    frame_price: float
    room_bits: float
    delivered: float
    least_misses: int
    entry_share: float = 1.0


@dataclass(frozen=True)
class Offer:
    """A frame: its soldiers (indices into the wares), most urgent first, its bits; ``misses`` None: in full.

    ``far`` and ``steady`` (n,), where entries vary: which of them need more bits of their place, and no velocity.
    """

    surplus: float
    picked: IntArray
    bits: float = 0.0
    reach_bits: int = 0
    misses: int | None = None
    far: BoolArray | None = None
    steady: BoolArray | None = None

    @property
    def varied(self) -> bool:
        """Whether each entry tells its own reach, and whether its velocity is as before."""
        return self.far is not None

    def how(self, picked: Sequence[int]) -> list[tuple[bool, bool]]:
        """Of each of these soldiers, whether it is far and steady."""
        if self.far is None or self.steady is None:
            return [(False, False)] * len(picked)
        return list(zip(self.far[picked].tolist(), self.steady[picked].tolist(), strict=True))


def most_surplus(gain: FloatArray, terms: Terms) -> float:
    """What could at most be left for a frame's price: a quick look, since most of the time it is too little."""
    least_price = terms.entry_share * terms.price * LEAST_ENTRY_BITS
    return float(np.maximum(gain - least_price, 0.0).sum())


def best_offer(wares: Wares, terms: Terms) -> Offer | None:
    """The frame with the largest surplus; None if no frame is worth its bits."""
    offers = [_in_full(wares, terms)]
    for misses in _allowances(wares, terms):
        offers += [_update(wares, terms, misses, varied=varied) for varied in (False, True)]
    best = max(offers, key=lambda offer: offer.surplus)
    return best if best.surplus > 0.0 else None


def _allowances(wares: Wares, terms: Terms) -> list[int]:
    """What an update may allow to be missed: up to the first that leaves out nobody who can be reached at all."""
    reachable = np.where(wares.behind <= MISSES[-1], wares.behind, 0)
    most = int(max(terms.least_misses, reachable.max(initial=0), wares.needs.max(initial=0)))
    enough = next(misses for misses in MISSES if misses >= most)
    return [misses for misses in MISSES if terms.least_misses <= misses <= enough]


def _update(wares: Wares, terms: Terms, misses: int, *, varied: bool) -> Offer:
    """The best modulus for an update that allows so much to be missed."""
    resolved = (wares.behind <= misses) & (wares.needs <= misses)
    gain = terms.delivered * np.where(resolved, wares.worth, 0.0).mean(axis=0)
    reaches, allowed = _REACHES[wares.resolution], _ALLOWED[wares.resolution]
    off_cells, changes_bits = wares.off_cells[:, misses], wares.changes_bits[:, misses]
    gap_bits, span_bits = _number_bits(wares.span, int(np.count_nonzero(gain > 0.0)))
    bits = gap_bits + wares.bits + changes_bits
    steady, far = wares.steady[:, misses], off_cells >= allowed.near[:, None]
    if varied:
        resolvable = off_cells < allowed.far[:, None]
        bits = bits + 2.0 - wares.velocity_bits * steady
        bits = bits + 2.0 * (reaches[:, None] + np.where(far, FAR_BITS, NEAR_BITS))
    else:
        resolvable = off_cells < allowed.usual[:, None]
        bits = bits + 2.0 * reaches[:, None]
    usual = _usual(wares.resolution, reaches) & (misses == 0 and not varied)
    head_bits = UPDATE_HEAD_BITS + span_bits + _UNUSUAL_BITS * ~usual
    surplus = np.where(resolvable, gain - terms.entry_share * terms.price * bits, -1.0)
    totals = np.maximum(surplus, 0.0).sum(axis=1) - terms.price * head_bits
    best = int(np.argmax(totals))
    plain = float(head_bits[best])
    heads = plain, plain + _DETAILED_BITS + _UNUSUAL_BITS * bool(usual[best])
    picked, head = _picked_for_update(surplus[best], bits[best], changes_bits > 0.0, heads, terms.room_bits)
    total = float(surplus[best][picked].sum()) - terms.frame_price - terms.price * head
    size = head + float(bits[best][picked].sum())
    variation = (far[best], steady) if varied else (None, None)
    return Offer(total if len(picked) else -1.0, picked, size, int(reaches[best]), misses, *variation)


def _usual(resolution: int, reaches: IntArray) -> BoolArray:
    """(R,) whether the lattice is one that a usual update can have."""
    return np.array([(resolution, reach) in USUAL_LATTICES for reach in reaches.tolist()], dtype=np.bool_)


def _number_bits(span: int, picked: int) -> tuple[float, float]:
    """What telling so many numbers out of a span takes: for each one more, and for all, whoever they are."""
    costs = {k: picked * (1 + k) + (span - picked) / 2**k for k in _RICE_PARAMETERS}
    k = min(costs, key=lambda each: costs[each])
    return 1 + k - 0.5**k, span / 2**k


def _in_full(wares: Wares, terms: Terms) -> Offer:
    """Everybody worth it against one anchor, which all can read."""
    gain = terms.delivered * wares.worth.mean(axis=0) + wares.refresh
    place_bits = 2.0 * np.ceil(np.log2(wares.span_cells + 1.0))
    bits = _SQUAD_ENTRY_BITS + place_bits + wares.bits
    surplus = gain - terms.entry_share * terms.price * bits
    picked = _picked(surplus, bits, terms.room_bits - SQUAD_HEAD_BITS, MAX_SOLDIERS)
    total = float(surplus[picked].sum()) - terms.frame_price - terms.price * SQUAD_HEAD_BITS
    return Offer(total if len(picked) else -1.0, picked, SQUAD_HEAD_BITS + float(bits[picked].sum()))


def _picked_for_update(
    surplus: FloatArray, bits: FloatArray, changed: BoolArray, heads: tuple[float, float], room_bits: float
) -> tuple[IntArray, float]:
    """Who goes along in an update, and the bits of its head: the first of ``heads``, or where details of anybody
    have ``changed`` the second and a bit for each entry."""
    plain, detailed = heads
    picked = _picked(surplus, bits, room_bits - plain, MAX_ENTRIES)
    if changed[picked].any():
        picked = _picked(surplus, bits + 1.0, room_bits - detailed, MAX_ENTRIES)
    return picked, detailed + len(picked) if changed[picked].any() else plain


def _picked(surplus: FloatArray, bits: FloatArray, room_bits: float, most: int) -> IntArray:
    """The soldiers with a surplus, the largest first, as far as the frame's room goes; one always has room."""
    order = np.argsort(-surplus, kind="stable")
    order = order[: int(np.count_nonzero(surplus > 0.0))][:most]
    fits = np.cumsum(bits[order]) <= room_bits
    fits[:1] = True
    return order[fits]


def least_misses(loss: float) -> int:
    """What an update must allow for so that hardly anyone is left behind by chance."""
    if loss < LOSSLESS:
        return 0
    return next((misses for misses in MISSES if loss ** (misses + 1) < _UNSURE), MISSES[-1])
