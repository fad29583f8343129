"""Section `vision` of a study: scenes, lamps, images and costs of answers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from ...base.types import Fraction, Meters, Seconds, Section
from ...camera.pixel import Optics
from ...camera.scene import DIAMETER_M, Target
from ...camera.setup import Feature

Illuminant = Literal["daylight", "LED street light", "sodium street light"]
Material = Literal["foliage", "sky", "gray", "dark gray", "black", "white", "canopy", "soil", "asphalt", "concrete"]
_Intensity = Annotated[float, Field(ge=1e-3, le=1e6)]
_Text = Annotated[str, Field(min_length=1, max_length=100)]
MOST_IMAGES, MOST_LEARNED = 100_000, 100_000_000
_RESERVED = ("all", "off", "unknown")
FEWEST_LAMPS = 3
"""Fewest lamps of each lens: one to train, one to check, one to test."""
MOST_BITS, MOST_WELL_E, MOST_READ_NOISE_DN = 12, 30_000.0, 100.0
MOST_READINGS, MOST_ROOTS = 8192, 200_000
"""Tables of larger pixels would not fit into a worker's memory."""


class LightLevel(Section):
    """Ambient light at the signal head, and exposure time."""

    illuminance_lx: float = Field(ge=0, le=1e6)
    """Illuminance of background, backplate and housing, lx."""
    light: Illuminant = "daylight"
    """Spectrum of the ambient light."""
    exposure_s: Seconds
    """Exposure time, s."""
    phantom_cd: float = Field(default=0.0, ge=0, le=1e6)
    """Intensity of an unlit lens in low sun, in half of the scenes, cd (EN 12368 classes its ratio to a lit lens:
    1 to 16); 0: no sun on the lens."""
    train_weight: float = Field(default=1.0, gt=0, le=1e6)
    """Weight of this level in the images from which readers learn."""


class Street(Section):
    """Images of a street: several heads at different distances among brake lamps and street lamps.

    Each stands at random in a cell of a grid, which has a width of `crop_px` and 12 pixels more. Lenses stand in the
    street's order. A reader says where lit lenses are, and of which signal type.
    """

    columns: int = Field(default=6, ge=1, le=80)
    """Cells side by side."""
    rows: int = Field(default=3, ge=1, le=50)
    """Cells one above the other."""
    heads: int = Field(default=3, ge=1, le=100)
    """Heads in each image."""
    brake_lamps: int = Field(default=4, ge=0, le=100)
    """Brake lamps in each image, of 60 to 260 cd (UN R7) and surrogate spectra."""
    street_lamps: int = Field(default=2, ge=0, le=100)
    """Street lamps in each image (LED and sodium, 500 to 5,000 cd); not lit in daylight."""
    veiling_glare: Fraction = 0.0
    """Share of the light that the lens spreads evenly over the image (integral of veiling glare, ISO 9358)."""
    train_images: int = Field(default=100, ge=20, le=MOST_IMAGES)
    """Training images of each seed and CFA."""
    check_images: int = Field(default=20, ge=20, le=MOST_IMAGES)
    """Images of each seed and CFA by which your own detector may be chosen."""
    test_images: int = Field(default=100, ge=20, le=MOST_IMAGES)
    """Test images of each seed and CFA."""

    @model_validator(mode="after")
    def _fits(self) -> Street:
        lamps = self.heads + self.brake_lamps + self.street_lamps
        if lamps > self.columns * self.rows:
            raise ValueError(f"{lamps} heads and lamps do not fit into {self.columns} x {self.rows} cells")
        return self


class Vision(Section):
    """Benchmark of vision: images of signal heads, read by the ideal observer and by a reader that learns.

    The observer reads raw pixels: on average over heads as they are drawn here, no reader errs less.
    """

    lenses: Annotated[list[_Text], Field(min_length=2, max_length=4)] = ["red", "yellow", "green"]
    """Signal types of the head's two to four lenses, from the top."""
    distances_m: Annotated[list[Meters], Field(min_length=1, max_length=20)]
    """Distances of the head, m."""
    levels: Annotated[dict[_Text, LightLevel], Field(min_length=1, max_length=10)]
    """Levels of ambient light by name."""
    intensities_cd: Annotated[list[_Intensity], Field(min_length=1, max_length=6)] = [20.0, 60.0, 200.0]
    """Intensities of a lit lamp, cd, all equally frequent."""
    backgrounds: Annotated[list[Material], Field(min_length=1)] = ["foliage", "sky", "gray"]
    """Materials behind the head, all equally frequent."""
    fov_deg: float = Field(default=60.0, ge=1e-6, le=360)
    """Horizontal field of view of the camera, degrees."""
    diameter_m: Meters = DIAMETER_M
    """Diameter of a lens of the head, m."""
    optics: Optics = Optics(f_number=2.0)
    """Lens of the camera."""
    crop_px: int = Field(default=24, ge=8, le=48)
    """Side of an image, pixels; even."""
    places_per_pixel: int = Field(default=2, ge=1, le=4)
    """Positions of the head along a pixel, over the CFA's tile."""
    seeds: int = Field(default=5, ge=2, le=20)
    """Seeds; each trains readers of its own."""
    train_images: int = Field(default=10_000, ge=50, le=MOST_IMAGES)
    """Images of each seed and CFA for your own detector to learn from, lenses in any order."""
    check_images: int = Field(default=400, ge=20, le=MOST_IMAGES)
    """Images of each seed and CFA by which the readers' confidence is calibrated, lenses in any order."""
    test_images: int = Field(default=400, ge=20, le=MOST_IMAGES)
    """Test images of each seed, order of lenses and CFA."""
    unknown_cost: Fraction = 0.2
    """Cost of the answer "unknown"; a wrong answer costs 1."""
    prototypes: bool = True
    """`false` leaves the prototype network out; the ideal observer always reads the images."""
    prototype_images: int = Field(default=300_000, ge=1000, le=MOST_LEARNED)
    """Images from which the prototype network learns, of each seed and CFA; each is seen once, and not held."""
    street: Street | None = None
    """Images of a street, too."""

    @model_validator(mode="after")
    def _fits(self) -> Vision:
        for key, names in (("lenses", self.lenses), ("levels", self.levels)):
            for name in names:
                if name in _RESERVED:
                    raise ValueError(f"{key}: {name!r} means something else; another name")
        if self.crop_px % 2:
            raise ValueError(f"crop_px {self.crop_px} must be even")
        for name in ("lenses", "distances_m", "intensities_cd", "backgrounds"):
            values = getattr(self, name)
            if len(set(values)) < len(values):
                raise ValueError(f"{name}: one is named twice")
        return self

    def images_of(self, split: str) -> int:
        """Return the number of heads of a split, of each seed, order and CFA."""
        return {"train": self.train_images, "check": self.check_images, "test": self.test_images}[split]

    def target(self, distance_m: float) -> Target:
        """Return a lens of the head at a distance as the target of a scene."""
        return Target(distance_m=distance_m, fov_deg=self.fov_deg, diameter_m=self.diameter_m)


@dataclass(frozen=True)
class SeededVision(Feature):
    """Benchmark of a study with its seed."""

    vision: Vision
    seed: int
    slow: ClassVar[bool] = True
