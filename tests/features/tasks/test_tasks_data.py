"""The spectra of tasks: shipped ones are what their cards say, surrogates lie inside their regulations' color regions."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from sweep.features.tasks import task_sets
from sweep.features.tasks.spectra import SHIPPED
from sweep.spectra.builtin import spectra, surrogate_spectra
from sweep.spectra.builtin.groups import spectra_of_group
from sweep.spectra.color import chromaticity
from sweep.spectra.spectrum import WavelengthGrid

from ...make_spectra import OUT, made

GRID = WavelengthGrid()


def test_the_data_file_equals_the_output_of_its_script() -> None:
    found = importlib.util.find_spec("earthlib")
    if found is None or found.origin is None:
        pytest.skip("earthlib is not installed: pip install --no-deps earthlib==1.1.0")
    table = made(Path(found.origin).parent)
    shipped = pq.read_table(OUT)
    assert table.to_pylist() == shipped.to_pylist()
    assert table.schema.metadata == shipped.schema.metadata


def test_every_set_has_the_digest_that_its_card_was_written_with() -> None:
    told = json.loads(pq.read_schema(OUT).metadata[b"cards"])
    cards = {card.name: card for card in spectra.cards()}
    assert {name: card.sha256 for name, card in cards.items()} == {name: own["sha256"] for name, own in told.items()}


@pytest.mark.parametrize("group", list(surrogate_spectra.SURROGATES))
def test_a_surrogate_lies_inside_its_color_region(group: str) -> None:
    light = task_sets.illuminant(GRID, "d65") if surrogate_spectra.is_sheeting(group) else 1.0
    xy = chromaticity(GRID, spectra_of_group(GRID, group) * light)
    assert (surrogate_spectra.region(group).violation(xy) <= 0).all()


def test_white_lamps_of_the_task_are_white() -> None:
    """LED-B1 and the filament lie in the regulation's white, a sodium lamp does not."""
    own = surrogate_spectra.LAMP_REGIONS["white"]
    lamps = [spectra.gridded(GRID, spectra.spectrum_of("cie_illuminants", name)) for name in ("A", "LED-B1", "HP1")]
    assert (own.violation(chromaticity(GRID, np.stack(lamps))) <= 0).tolist() == [True, True, False]


@pytest.mark.parametrize("name", list(SHIPPED))
def test_a_task_has_equal_photons_or_one_lux(name: str) -> None:
    task = task_sets.shipped(GRID, name)
    assert task.columns.name == name
    if task.photons is not None:
        np.testing.assert_allclose(GRID.integrate(task.photons), 1, rtol=1e-12)
        assert len(task.photons) == len(task.columns.lights)
        one, other = task.pairs
        kinds = np.asarray(task.types)
        sizes = np.unique(kinds, return_counts=True)[1]
        assert len(one) == (sizes.sum() ** 2 - (sizes**2).sum()) / 2
        assert (kinds[one] != kinds[other]).all()
    if task.chart is not None:
        np.testing.assert_allclose(task.chart.white[:, 1], 1, rtol=1e-12)
