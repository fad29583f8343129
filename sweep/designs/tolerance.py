"""Production errors of a filter: shifted edges, films of another thickness, and broader bands of colorants."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from ..base.types import PerWavelength

SHIFTS = (-1.0, -0.5, 0.0, 0.5, 1.0)
"""Where in the range of a tolerance the worst case is looked for, in units of its half width."""
_WIDTHS = (0.0, 1.0)
"""Points in the range of broadening at which it is looked for."""


class ProductionError(NamedTuple):
    """Production error: a feature designed at l nm is at l (1 + thickness) + shift_nm."""

    shift_nm: float = 0.0
    thickness: float = 0.0
    broadening: float = 0.0

    def nominal_nm(self, wavelength_nm: PerWavelength) -> PerWavelength:
        """Return the designed wavelengths of features."""
        moved = wavelength_nm - self.shift_nm
        return moved / (1 + self.thickness) if self.thickness else moved


AS_DESIGNED = ProductionError()


@dataclass(frozen=True)
class Tolerance:
    """Tolerance of production.

    `thickness`: largest relative error of the thickness of all films, which moves every wavelength of an interference
    filter; `broadening`: largest relative excess of the width of the bands of colorants.
    """

    edge_shift_nm: float = 0.0
    thickness: float = 0.0
    broadening: float = 0.0

    def __bool__(self) -> bool:
        return self.edge_shift_nm > 0 or self.thickness > 0 or self.broadening > 0

    def scaled(self, factor: float) -> Tolerance:
        """Return a tolerance that is larger by a factor."""
        return Tolerance(factor * self.edge_shift_nm, factor * self.thickness, factor * self.broadening)

    def at(self, edge: float, film: float, width: float = 0.0) -> ProductionError:
        """Return a production error within the tolerance.

        `edge`, `film`: shift and thickness error, -1 to 1 times their tolerance; `width`: broadening, 0 to 1 times its
        tolerance.
        """
        moved = edge * self.edge_shift_nm + 0.0, film * self.thickness + 0.0  # no negative zeros
        return ProductionError(*moved, width * self.broadening)

    @property
    def places(self) -> tuple[ProductionError, ...]:
        """Production errors of the worst case: from end to end, and corners; with and without broadening."""
        mixed = ((-1.0, 1.0), (1.0, -1.0)) if self.edge_shift_nm > 0 and self.thickness > 0 else ()
        errors = (*((s, s) for s in SHIFTS), *mixed)
        return tuple(dict.fromkeys(self.at(edge, film, width) for width in _WIDTHS for edge, film in errors))


NONE = Tolerance()
