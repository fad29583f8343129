"""What production does to a filter: edges that come out elsewhere, and films that are too thick."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from ..base.types import FloatArray

SHIFTS = (-1.0, -0.5, 0.0, 0.5, 1.0)
"""Where in the range of a tolerance the worst case is looked for, in units of its half width."""


class Off(NamedTuple):
    """How a filter came out: what should be at l nm is at l (1 + thickness) + shift_nm."""

    shift_nm: float = 0.0
    thickness: float = 0.0

    def nominal_nm(self, wavelength_nm: FloatArray) -> FloatArray:
        """Where what is at these wavelengths should be, ndarray[n_wavelengths]."""
        moved = wavelength_nm - self.shift_nm
        return moved / (1 + self.thickness) if self.thickness else moved


AS_DESIGNED = Off()


@dataclass(frozen=True)
class Tolerance:
    """How far off a filter may come out: edges by up to `edge_shift_nm` to either side, and all films too thick or too
    thin by up to the share `thickness`, which moves every wavelength of an interference filter by that share.
    """

    edge_shift_nm: float = 0.0
    thickness: float = 0.0

    def __bool__(self) -> bool:
        return self.edge_shift_nm > 0 or self.thickness > 0

    def scaled(self, factor: float) -> Tolerance:
        """So many times as far off."""
        return Tolerance(factor * self.edge_shift_nm, factor * self.thickness)

    def at(self, edge: float, film: float) -> Off:
        """Edges and films so many times their tolerance off, -1 to 1."""
        return Off(edge * self.edge_shift_nm + 0.0, film * self.thickness + 0.0)  # no negative zeros

    @property
    def places(self) -> tuple[Off, ...]:
        """Where the worst case is looked for: from all at the one end to all at the other, and, where there are both,
        with edges at one end and films at the other.
        """
        if not self:
            return (AS_DESIGNED,)
        both = self.edge_shift_nm > 0 and self.thickness > 0
        return (*(self.at(s, s) for s in SHIFTS), *((self.at(s, -s) for s in (-1.0, 1.0)) if both else ()))
