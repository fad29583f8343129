"""The bench that a study and a table of readings describe together."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from ...base.disk import is_file
from ...base.errors import DataError, ValidationIssue, nearest
from ...base.types import Array, Float, PerWavelength
from ...camera.model import scene_model
from ...camera.mosaic import Mosaic
from ...camera.pixel import Pixel
from ...camera.sampling import crosstalk_parts
from ...camera.setup import Setup
from ...spectra.formats import read_curves
from ...spectra.spectrum import energy_from_photons, equal_photons, photons_from_energy, resample
from ...spectra.units import used_as
from ...study import Study
from .bench import UNKNOWNS, Bench, tells_noise
from .readings import DARK

CAUSES = ("near full scale", "near 0 DN")
"""Why readings do not count."""
_LEAST_CUT = 1e-3
"""Transmission of a built-in IR cut below which the curve before it is not known."""
_CERTAIN = 5.0
"""Standard deviations of the noise that a reading which counts is away from both ends of the ADC."""
_OF_A_LIGHT = ["lamp", "scene", "irradiance_w_m2", "irradiance_photons"]
"""What tells lights apart: each has one brightness."""


def bench_of(
    study: Study,
    file: str,
    table: pd.DataFrame,
    cfa: str | None,
    hold: Sequence[str],
    known: Mapping[str, float] | None = None,
) -> Bench:
    """Return the bench of some readings. Raises DataError for lamps, places and scenes that are not known.

    `known`: numbers of the pixel by which readings near the ends of its range are left out, instead of the study's.
    """
    table = table.assign(scene=table["scene"].replace("", next(iter(study.scenarios))))
    _refuse_unknown(file, table, "scene", study.scenarios)
    setups = {name: _setup(study, file, table, cfa, name) for name in dict.fromkeys(table["scene"])}
    setup, pixels = next(iter(setups.values())), {repr(setup.camera.pixel) for setup in setups.values()}
    pixel, grid = setup.camera.pixel, study.grid
    if pixel.captures or len(pixels) > 1:
        allowed = "one pixel for all readings, which is read once"
        raise DataError(ValidationIssue("pixels of several readouts", file, 1, "scene", [*setups], allowed))
    places, own, around = _shares(setup.camera.mosaic)
    dark = table["lamp"].str.casefold() == DARK
    in_tile = table["row"].map("{:.0f}".format) + ", " + table["column"].map("{:.0f}".format)
    channel = table["channel"].where(table["channel"] != "", in_tile.where(~dark | table["row"].notna(), places[0]))
    table = table.assign(channel=channel)
    _refuse_unknown(file, table, "channel", places)
    spectra = _spectra(study, file, table[~dark])

    cause = _left_out(table, pixel.model_copy(update=known or {}))
    table = table.assign(place=[places.index(name) for name in channel], left_out=cause)
    counted, left_out = table[table["left_out"] == ""], table[table["left_out"] != ""]
    if not len(counted):
        raise DataError(ValidationIssue("all readings are near full scale or near 0 DN", file, 1, "dn"))
    keys = [*counted[_OF_A_LIGHT].fillna(0.0).itertuples(index=False, name=None)]
    lights = list(dict.fromkeys(key for key, is_dark in zip(keys, dark[counted.index], strict=True) if not is_dark))
    counted = counted.assign(light=[lights.index(key) if key in lights else -1 for key in keys])
    photons = np.array([spectra[lamp] for lamp, *_ in lights]).reshape(-1, grid.size)
    joules = grid.integrate(energy_from_photons(grid.nodes_nm, photons))
    stated = np.array([said or watts / joule for (*_, watts, said), joule in zip(lights, joules, strict=True)])
    bare, cut = _without_cut(study)
    of_study = pixel.offset_dn, pixel.dn_per_e, 0.0, pixel.crosstalk, pixel.read_noise_e**2
    named = [lamp for lamp, *_ in lights]
    fits = [name not in hold for name in UNKNOWNS]
    fits[2] &= bool((cut != 1).any())
    fits[4] &= bool(tells_noise(counted).any())
    return Bench(
        study,
        setup,
        counted,
        left_out,
        [lamp if named.count(lamp) == 1 else f"{lamp} {at}" for at, lamp in enumerate(named)],
        photons * grid.bins_nm,
        bare.setup_of(setup.camera.mosaic.name, next(iter(setups)), {}).camera.qe,
        np.array([_seen(bare, setups[scene], scene) for _, scene, *_ in lights]).reshape(-1, *setup.camera.qe.shape),
        cut,
        own,
        around,
        np.array([*of_study, *(stated * pixel.area_m2)]),
        np.array([*fits, *(stated == 0)]),
    )


def _setup(study: Study, file: str, table: pd.DataFrame, cfa: str | None, scene: str) -> Setup:
    """Return the setup of the CFA that is asked for, or of the first that has curves for all channels."""
    read = {*table["channel"]} - {""}
    if cfa is not None and cfa not in study.mosaics:
        near = nearest(cfa, study.mosaics)
        raise DataError(ValidationIssue("unknown CFA", None, None, "--cfa", cfa, ", ".join(study.mosaics), near))
    for name, mosaic in study.mosaics.items():
        curves = study.sensor.mosaic_curves(mosaic, study.section.cfas[name].curves)
        if cfa in (None, name) and read <= {*mosaic.channels} and study.sensor.qe.keys() >= {*curves}:
            return study.setup_of(name, scene, {})
    known = list(dict.fromkeys(channel for mosaic in study.mosaics.values() for channel in mosaic.channels))
    _refuse_unknown(file, table[table["channel"] != ""], "channel", known)
    problem = f"no CFA of the study has curves for the channels {', '.join(sorted(read))}"
    raise DataError(ValidationIssue(problem, file, 1, "channel", cfa, ", ".join(study.mosaics)))


def _shares(mosaic: Mosaic) -> tuple[list[str], Float[Array, "places channels"], Float[Array, "places channels"]]:
    """Return the places of readings, channels, then pixels of the tile, with the filters before them and around."""
    tile = mosaic.indices
    each = np.eye(len(mosaic.channels))[tile]
    parts = crosstalk_parts(1.0)
    beside = np.sum([share * np.roll(each, (-down, -right), (0, 1)) for share, down, right in parts], axis=0)
    pixels = each.reshape(tile.size, -1)
    of_channels = (pixels / mosaic.counts).T
    own, around = (np.concatenate([of_channels @ of, of]) for of in (pixels, beside.reshape(tile.size, -1)))
    return [*mosaic.channels, *(f"{row}, {column}" for row, column in np.ndindex(tile.shape))], own, around


def _left_out(table: pd.DataFrame, pixel: Pixel) -> list[str]:
    """Return why each reading does not count; empty for those that do."""
    dn = table["dn"].to_numpy()
    gain, top_dn = pixel.dn_per_e, pixel.saturation_e * pixel.dn_per_e + pixel.offset_dn
    expected = gain * np.maximum(dn - pixel.offset_dn, 0) + (gain * pixel.read_noise_e) ** 2 + 1 / 12
    reach = _CERTAIN * np.fmax(table["sigma_dn"].to_numpy(), np.sqrt(expected))
    return [*np.where(dn + reach >= top_dn, CAUSES[0], np.where(dn <= reach, CAUSES[1], ""))]


def _without_cut(study: Study) -> tuple[Study, PerWavelength]:
    """Return the study without the IR cut of its sensor, and the transmission of that, 1 where none is known."""
    sensor, cut = study.sensor, study.sensor.ir_cut
    if sensor.bare is not None:
        sensor, cut = sensor.bare
    elif cut is not None:
        sensor = replace(sensor, qe={name: curve / np.maximum(cut, _LEAST_CUT) for name, curve in sensor.qe.items()})
    return replace(study, sensor=sensor), np.ones(study.grid.size) if cut is None else cut


def _seen(bare: Study, setup: Setup, scene: str) -> Float[Array, "channels wavelengths"]:
    """Return the curves in the cone of rays of a scene."""
    qe = bare.setup_of(setup.camera.mosaic.name, scene, {}).camera.qe
    return scene_model(setup).position(0.0).angular.curves(qe, range(len(qe))) if setup.moves else qe


def _spectra(study: Study, file: str, table: pd.DataFrame) -> dict[str, PerWavelength]:
    """Return the photons of each lamp: one of the study, or a column of a file."""
    lights, grid, found = study.lights, study.grid, {}
    _refuse_unknown(file, table[~table["lamp"].str.contains(":")], "lamp", lights.names)
    for name in dict.fromkeys(table["lamp"]):
        if name in lights.names:
            found[name] = lights.photons[lights.names.index(name)]
            continue
        source, _, column = name.rpartition(":")
        places = [place for place in (Path(file).parent / source, Path(source)) if is_file(place)]
        if not places:
            _refuse_unknown(file, table[table["lamp"] == name], "lamp", lights.names)
        curves = read_curves(places[0])
        if column not in curves.values:
            known, near = ", ".join(curves.values), nearest(column, curves.values)
            raise DataError(ValidationIssue("no such column", str(places[0]), None, None, column, known, near))
        curves = used_as(curves, [column], "light")
        values = resample(*curves.samples(column), grid, outside="zero")
        energy = curves.units[column].quantity == "energy"
        found[name] = equal_photons(grid, photons_from_energy(grid.nodes_nm, values) if energy else values)
    return found


def _refuse_unknown(file: str, table: pd.DataFrame, key: str, known: Iterable[str]) -> None:
    """Raise DataError for names that are none of those, with the first line of each."""
    names = list(known)
    first = table[~table[key].isin(names)].drop_duplicates(key)
    issues = [
        ValidationIssue(f"unknown {key}", file, line, key, name, ", ".join(names), nearest(name, names))
        for line, name in zip(first["line"], first[key], strict=True)
    ]
    if issues:
        raise DataError(issues)
