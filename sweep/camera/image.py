"""Light of a lamp on the pixels around it, and the weights of these pixels in the channels: two sparse matrices.

A pixel is the sum of a few parts, each the light of one place through the filter of one channel. Pixels of equal parts
are one element, whatever their case (a sampling phase): its electrons are computed and read once. Where the readout is
linear, or each pixel sees its own filter alone in a field without structure, elements are the channels themselves.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..base.types import Array, Float, FloatArray, IndexArray, Int

Rates = Float[Array, "rows functions columns"]
"""Light behind the filters of some channels, of each function of an image."""
_Elements = Float[Array, "elements columns"]
_Cases = Int[IndexArray, " subset"]
_SEED = 1


@dataclass(frozen=True, eq=False)
class Pixels:
    """Elements that are pixels.

    `values`: light at each place relative to a uniform field, as functions, whose `shares` in the wavelengths are left
    out where all are equal; `place`, `through`: place and channel of each part of an element, first its own; `row`,
    `element`, `weight`: element and weight of each entry of the mean of a case and channel, `row`, in the order of the
    cases; `bounds`: first entry of each case.
    """

    values: Float[Array, "places functions"]
    shares: Float[Array, "functions wavelengths"] | None
    place: Int[IndexArray, "parts elements"]
    through: Int[IndexArray, "parts elements"]
    row: Int[IndexArray, " entries"]
    element: Int[IndexArray, " entries"]
    weight: Float[Array, " entries"]
    bounds: Int[IndexArray, " bounds"]
    n_channels: int

    @classmethod
    def of(
        cls,
        light: tuple[Float[Array, "places functions"], Float[Array, "functions wavelengths"] | None],
        place: Int[IndexArray, "parts pixels"],
        through: Int[IndexArray, "parts pixels"],
        case: Int[IndexArray, " pixels"],
        weight: Float[Array, " pixels"],
        n_cases: int,
        n_channels: int,
    ) -> Pixels:
        """Return the image of pixels, in the order of their cases."""
        # A random number for each pixel, by which all its neighbors count the same: of two that differ, one in 2^64
        # pairs has the same.
        numbers = np.random.default_rng(_SEED).integers(0, 2**64, (2, n_channels, len(light[0])), dtype=np.uint64)
        key = numbers[0][through[0], place[0]] + numbers[1][through[1:], place[1:]].sum(axis=0, dtype=np.uint64)
        _, first, element = np.unique(key, return_index=True, return_inverse=True)
        bounds = np.searchsorted(case, np.arange(n_cases + 1))
        row = case * n_channels + through[0]
        return cls(*light, place[:, first], through[:, first], row, element.ravel(), weight, bounds, n_channels)

    @property
    def n_cases(self) -> int:
        """Number of cases."""
        return self.bounds.size - 1

    @property
    def channel(self) -> Int[IndexArray, " elements"]:
        """Channel of each element."""
        return np.asarray(self.through[0])

    def lit(self, rates: Rates, channels: Sequence[int], crosstalk: float) -> _Elements:
        """Return the light of the elements from that behind the filters of some channels."""
        return self._gathered(self.values @ rates, self.place, channels, crosstalk)

    def uniform(self, rates: Float[Array, "rows columns"], channels: Sequence[int], crosstalk: float) -> _Elements:
        """Return the light of the elements in a uniform field."""
        return self._gathered(rates[:, None], np.zeros_like(self.place), channels, crosstalk)

    def _gathered(
        self,
        light: Float[Array, "rows _places columns"],
        place: Int[IndexArray, "parts elements"],
        channels: Sequence[int],
        crosstalk: float,
    ) -> _Elements:
        from .pixel_kernels import gather  # noqa: PLC0415  (compiled: kept off the start-up path)

        row = np.full(self.n_channels, -1)
        row[list(channels)] = np.arange(len(channels))
        n_parts, n_elements = place.shape
        shares = np.full(n_parts, crosstalk / 4)
        shares[0] = 1 - crosstalk
        out = np.zeros((n_elements, light.shape[2]))
        gather(np.ascontiguousarray(light), shares, place, row[self.through], out)
        return out

    def folded(self, values: Float[Array, "elements ..."]) -> Float[Array, "cases channels ..."]:
        """Return the means of the channels in each case."""
        return self._folded(values, self.weight)

    def spread(self, variances: Float[Array, "elements ..."]) -> Float[Array, "cases channels ..."]:
        """Return the variances of the channels in each case."""
        return self._folded(variances, self.weight**2)

    def _folded(
        self, values: Float[Array, "elements ..."], weight: Float[Array, " entries"]
    ) -> Float[Array, "cases channels ..."]:
        from .pixel_kernels import fold  # noqa: PLC0415  (compiled: kept off the start-up path)

        flat = np.ascontiguousarray(values).reshape(len(values), -1)
        out = np.zeros((self.n_cases * self.n_channels, flat.shape[1]))
        fold(flat, self.row, self.element, weight, out)
        return out.reshape(self.n_cases, self.n_channels, *values.shape[1:])

    def subset(self, cases: _Cases) -> tuple[Pixels, Int[IndexArray, " used"]]:
        """Return the image of some cases, and the numbers of its elements."""
        entries = np.concatenate([np.arange(self.bounds[case], self.bounds[case + 1]) for case in cases])
        used, element = np.unique(self.element[entries], return_inverse=True)
        sizes = self.bounds[cases + 1] - self.bounds[cases]
        row = self.row[entries] + self.n_channels * np.repeat(np.arange(cases.size) - cases, sizes)
        bounds, parts = np.append(0, np.cumsum(sizes)), (self.place[:, used], self.through[:, used])
        place, through = map(np.ascontiguousarray, parts)
        of_light, weight = (self.values, self.shares, place, through), self.weight[entries]
        return Pixels(*of_light, row, element.ravel(), weight, bounds, self.n_channels), used

    def of_case(
        self, case: int
    ) -> tuple[Int[IndexArray, " used"], Float[Array, "used channels"], Float[Array, "used channels"], int]:
        """Return the elements of a case, their weights in mean and variance of the channels, and how many pixels."""
        entries = slice(self.bounds[case], self.bounds[case + 1])
        used, at = np.unique(self.element[entries], return_inverse=True)
        cells, weight = at.ravel() * self.n_channels + self.row[entries] % self.n_channels, self.weight[entries]
        size = used.size * self.n_channels
        mean, spread = np.zeros(size), np.zeros(size)
        np.add.at(mean, cells, weight)
        np.add.at(spread, cells, weight**2)
        return used, mean.reshape(used.size, -1), spread.reshape(used.size, -1), weight.size

    def pixels_of_channels(self) -> list[Int[IndexArray, " _pixels"]]:
        """Return the element of each pixel of each channel, in the first case."""
        first = slice(self.bounds[1])
        return [self.element[first][self.row[first] == channel] for channel in range(self.n_channels)]


@dataclass(frozen=True, eq=False)
class Channels:
    """Elements that are the channels of each case, as `Pixels` otherwise.

    `light`, `background`: light of each element behind the filter of each channel, and in a uniform field; `counts`:
    pixels of each element, for its variance.
    """

    light: Float[Array, "channels elements functions"]
    background: Float[Array, "channels elements"]
    shares: Float[Array, "functions wavelengths"] | None
    counts: Int[IndexArray, " elements"]

    @classmethod
    def of(cls, parts: Iterable[Pixels], crosstalk: float) -> Channels:
        """Return the means of the channels of images of some cases each."""
        light, background, shares = list[FloatArray](), list[FloatArray](), None
        for pixels in parts:
            every, one, shares = np.eye(pixels.values.shape[1])[None], np.ones((1, 1)), pixels.shares
            shape = pixels.n_channels * pixels.n_cases, -1
            channels = range(pixels.n_channels)
            lit = [pixels.folded(pixels.lit(every, [channel], crosstalk)).reshape(shape) for channel in channels]
            uniform = [pixels.folded(pixels.uniform(one, [channel], crosstalk)).ravel() for channel in channels]
            light.append(np.stack(lit))
            background.append(np.stack(uniform))
        whole = np.concatenate(light, axis=1)
        return cls(whole, np.concatenate(background, axis=1), shares, np.ones(whole.shape[1], dtype=np.intp))

    @property
    def n_channels(self) -> int:
        """Number of channels."""
        return len(self.light)

    @property
    def n_cases(self) -> int:
        """Number of cases."""
        return int(self.light.shape[1] // self.n_channels)

    @property
    def channel(self) -> Int[IndexArray, " elements"]:
        """Channel of each element."""
        return np.tile(np.arange(self.n_channels), self.n_cases)

    def lit(self, rates: Rates, channels: Sequence[int], crosstalk: float) -> _Elements:  # noqa: ARG002
        """Return the light of the elements from that behind the filters of some channels."""
        total = np.zeros((self.light.shape[1], rates.shape[2]))
        for channel, rate in zip(channels, rates, strict=True):
            total += self.light[channel] @ rate
        return total

    def uniform(
        self,
        rates: Float[Array, "rows columns"],
        channels: Sequence[int],
        crosstalk: float,  # noqa: ARG002
    ) -> _Elements:
        """Return the light of the elements in a uniform field."""
        return np.asarray(self.background[list(channels)].T @ rates)

    def folded(self, values: Float[Array, "elements ..."]) -> Float[Array, "cases channels ..."]:
        """Return the means of the channels in each case: the values."""
        return values.reshape(self.n_cases, self.n_channels, *values.shape[1:])

    def spread(self, variances: Float[Array, "elements ..."]) -> Float[Array, "cases channels ..."]:
        """Return the variances of the channels in each case."""
        return self.folded(variances / self.counts.reshape(-1, *(1,) * (variances.ndim - 1)))

    def subset(self, cases: _Cases) -> tuple[Channels, Int[IndexArray, " used"]]:
        """Return the image of some cases, and the numbers of its elements."""
        used = (cases[:, None] * self.n_channels + np.arange(self.n_channels)).ravel()
        return replace(
            self, light=self.light[:, used], background=self.background[:, used], counts=self.counts[used]
        ), used

    def of_case(
        self, case: int
    ) -> tuple[Int[IndexArray, " used"], Float[Array, "used channels"], Float[Array, "used channels"], int]:
        """Return the elements of a case, their weights in mean and variance of the channels, and how many pixels."""
        used = case * self.n_channels + np.arange(self.n_channels)
        return used, np.eye(used.size), np.diag(1 / self.counts[used]), int(self.counts[used].sum())

    def pixels_of_channels(self) -> list[Int[IndexArray, " _pixels"]]:
        """Return the element of each pixel of each channel, in the first case."""
        return [np.repeat(channel, self.counts[channel]) for channel in range(self.n_channels)]


Image = Pixels | Channels


def in_cases(
    folded: Float[Array, "places channels rows moments signals"],
) -> Float[Array, "rows cases signals channels"]:
    """Return folded values of designs, or of a design and its derivatives, case by case."""
    ordered = np.transpose(folded, (2, 0, 3, 4, 1))
    return np.ascontiguousarray(ordered.reshape(len(ordered), -1, *ordered.shape[3:]))
