"""Abstract metrics: base classes of `columns`, by their input: designs, readouts, noise, pulses or images."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import ClassVar

from ..base.types import Array, DesignCurves, DesignParameters, DesignSignals, Float, MemberNumbers
from ..camera.forward import ForwardModel
from ..camera.readout import NoisyReadout
from ..camera.setup import Setup
from ..designs.block import Block
from ..designs.family import Family
from ..spectra.lights import Pair
from ..vision.section import Vision
from .brightness import BrightnessCurves
from .quantity import Columns, Quantity, RequestedQuantities


class Metric(ABC):
    """Columns that are computed together; a class in `metrics/columns/`. `order` is their position in the table."""

    order: ClassVar[int]

    @abstractmethod
    def quantities(self, requested: RequestedQuantities) -> Sequence[Quantity]:
        """Return the columns in a study.

        Parameters
        ----------
        requested : RequestedQuantities
            Requested quantities.

        Returns
        -------
        sequence of Quantity
            Columns; none if they are not requested.
        """


class DesignMetric(Metric):
    """Metric of designs without light."""

    @abstractmethod
    def of_designs(self, setup: Setup, block: Block) -> Columns:
        """Compute the columns.

        Parameters
        ----------
        setup : Setup
            Scene and camera.
        block : Block
            Designs.

        Returns
        -------
        dict of str to ndarray of shape (n_designs,)
            Column name -> values.
        """


class ReadoutMetric(Metric):
    """Metric of the digital numbers of a scene."""

    @abstractmethod
    def of_readout(self, setup: Setup, response: DesignSignals, unlit: Float[Array, "designs channels"]) -> Columns:
        """Compute the columns at one sampling phase and moment; the worst of all counts.

        Parameters
        ----------
        setup : Setup
            Scene and camera.
        response : ndarray of shape (n_designs, n_signals, n_channels)
            Readout, DN.
        unlit : ndarray of shape (n_designs, n_channels)
            Response without the lamps, DN.

        Returns
        -------
        dict of str to ndarray of shape (n_designs,)
            Column name -> values.
        """


class NoiseMetric(Metric):
    """Metric of mean and variance of a noisy scene; `extra`: only if a study requests probabilities."""

    extra: ClassVar[bool] = False

    @abstractmethod
    def of_noise(
        self, model: ForwardModel, curves: DesignCurves, read: NoisyReadout, members: Mapping[str, MemberNumbers]
    ) -> Columns:
        """Compute the columns, the worst over all phases and moments.

        Parameters
        ----------
        imager : ForwardModel
            Model of the scene.
        curves : ndarray of shape (n_designs, n_modified, n_wavelengths)
            QE of the modified channels.
        read : NoisyReadout
            Readout of these designs.
        members : mapping of str to ndarray of int
            Signals of each state.

        Returns
        -------
        dict of str to ndarray of shape (n_designs,)
            Column name -> values.
        """


class LampMetric(Metric):
    """Metric of lamps of unknown brightness; `of_states`: only if a study names states that noise may confuse."""

    of_states: ClassVar[bool] = False

    @abstractmethod
    def of_lamps(
        self, cases: Sequence[BrightnessCurves], members: Mapping[str, MemberNumbers], pairs: Sequence[Pair]
    ) -> dict[str, float]:
        """Compute the columns of one design, the worst over all phases and moments.

        Parameters
        ----------
        cases : sequence of BrightnessCurves
            Readings of the lamps over their brightness in each case.
        members : mapping of str to ndarray of int
            Signals of each type.
        pairs : sequence of tuple of str
            Two signal types each.

        Returns
        -------
        dict of str to float
            Column name -> value.
        """


class PulseMetric(Metric):
    """Metric of a pulsed lamp in an HDR pixel; `names`: of its columns."""

    names: ClassVar[tuple[str, ...]]

    @abstractmethod
    def of_pulses(self, model: ForwardModel, curves: DesignCurves) -> Columns:
        """Compute the columns over all phases of a pulse.

        Parameters
        ----------
        model : ForwardModel
            Model of the scene.
        curves : ndarray of shape (n_designs, n_modified, n_wavelengths)
            QE of the modified channels.

        Returns
        -------
        dict of str to ndarray of shape (n_designs,)
            Column name -> values.
        """


class VisionMetric(Metric):
    """Metric of images of signal heads."""

    @abstractmethod
    def of_images(self, setup: Setup, curves: DesignCurves, vision: Vision, seed: int) -> Columns:
        """Compute the columns.

        Parameters
        ----------
        setup : Setup
            Scene and camera.
        curves : ndarray of shape (n_designs, n_modified, n_wavelengths)
            QE of the modified channels.
        vision : Vision
            Benchmark.
        seed : int
            Seed of the study.

        Returns
        -------
        dict of str to ndarray of shape (n_designs,)
            Column name -> values.
        """


class FamilyMetric(Metric):
    """Metric of the parameters of a family."""

    @abstractmethod
    def of_parameters(self, family: Family | None, points: DesignParameters) -> Columns:
        """Compute the columns.

        Parameters
        ----------
        family : Family or None
            Family.
        points : ndarray of shape (n_designs, n_parameters)
            Parameters.

        Returns
        -------
        dict of str to ndarray of shape (n_designs,)
            Column name -> values.
        """
