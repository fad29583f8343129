"""Field positions of a scene, from the center of the sensor to its corner, and their chief ray angles."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from ..base.types import Section

PLACES = 9
"""Places of the sensor where a study does not say how many."""
_MOST = 1000
_Cra = Annotated[float, Field(ge=0, le=60)]
_Height = Annotated[float, Field(ge=0, le=1)]
_Count = Annotated[int, Field(ge=2, le=100)]
LINEAR = "linear"


def _places(value: object) -> object:
    """Check `any` or a count."""
    if value != "any" and (isinstance(value, bool) or not isinstance(value, int) or not 2 <= value <= 100):
        raise ValueError("field positions are `any`, or a whole number from 2 to 100")
    return value


def _listed(value: object) -> object:
    """Convert a list to a tuple, so that a scene is hashable."""
    if value is not None and not (isinstance(value, list | tuple) and 2 <= len(value) <= _MOST):
        raise ValueError(f"a list of 2 to {_MOST} numbers")
    return value if value is None else tuple(value)


_SIZE = Field(min_length=2, max_length=_MOST)


class SensorField(Section):
    """Field positions from the center of the sensor to its corner, of which the worst counts.

    The chief ray angle grows linearly to `cra_max_deg` in the corner, or is linear between the rows of a file
    (`profile: FILE`) or of a list (`cra_deg`). A scene's `off_axis_deg` is then the field angle of the corner.
    """

    cra_max_deg: _Cra | None = None
    """Chief ray angle in the corner, degrees."""
    profile: Annotated[str, Field(min_length=1, max_length=4096)] | None = None
    """`linear`, or a file: image height (mm, percent, or relative to the corner) and chief ray angle, degrees."""
    corner_mm: Annotated[float, Field(ge=1e-3, le=1e4)] | None = None
    """Image height of the corner, mm; left out, the last row of the file."""
    heights: Annotated[
        tuple[_Height, ...] | None,
        BeforeValidator(_listed, json_schema_input_type=Annotated[list[_Height], _SIZE] | None),
    ] = None
    """Relative image heights of `cra_deg`; left out, in equal steps."""
    cra_deg: Annotated[
        tuple[_Cra, ...] | None, BeforeValidator(_listed, json_schema_input_type=Annotated[list[_Cra], _SIZE] | None)
    ] = None
    """Chief ray angles, degrees."""
    places: Annotated[
        Literal["any"] | int | None, BeforeValidator(_places, json_schema_input_type=Literal["any"] | _Count | None)
    ] = None
    """Number of positions in equal steps of image height (9, or those of `cra_deg`), or `any`: all of them."""

    @model_validator(mode="after")
    def _one_profile(self) -> SensorField:
        ways = (self.cra_max_deg is not None, self.cra_deg is not None, self.file is not None)
        if sum(ways) != 1 or (self.profile == LINEAR and not ways[0]):
            raise ValueError("a field has either `cra_max_deg`, a list `cra_deg`, or `profile: FILE`")
        if self.corner_mm is not None and self.file is None:
            raise ValueError("`corner_mm` goes with `profile: FILE`")
        if self.heights is not None:
            if self.cra_deg is None or len(self.heights) != len(self.cra_deg):
                raise ValueError("`heights` are those of a list `cra_deg`, as many as it has")
            if self.heights[0] != 0 or self.heights[-1] != 1 or min(np.diff(self.heights)) <= 0:
                raise ValueError("`heights` grow from 0, the middle of the sensor, to 1, its corner")
        return self

    @property
    def file(self) -> str | None:
        """File that is still to be read, relative to the study."""
        return None if self.profile == LINEAR else self.profile

    @property
    def everywhere(self) -> bool:
        """True if all field positions count."""
        return self.places == "any"

    @property
    def knots(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """Relative image heights and their chief ray angles, degrees; linear in between."""
        if self.cra_deg is None:
            assert self.cra_max_deg is not None  # a file's rows take its place when a study is loaded
            return (0.0, 1.0), (0.0, self.cra_max_deg)
        steps = len(self.cra_deg) - 1
        heights = [place / steps for place in range(steps + 1)] if self.heights is None else self.heights
        return tuple(heights), tuple(self.cra_deg)

    @property
    def counted_heights(self) -> tuple[float, ...]:
        """Image heights of counted positions; if all count, those at which the search for the worst begins."""
        if self.places is None and self.cra_deg is not None:
            return self.knots[0]
        count = self.places if isinstance(self.places, int) else PLACES
        return tuple(place / (count - 1) for place in range(count))

    def cra_at(self, height: float) -> float:
        """Return the chief ray angle at a relative image height, degrees."""
        return float(np.interp(height, *self.knots))

    @property
    def steepest_deg(self) -> float:
        """Largest chief ray angle of any position, degrees."""
        return max(self.knots[1])
