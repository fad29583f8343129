"""Quantity and unit of a column of a file, from its head, a row of units or what a study states; and conversion."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from ..base.errors import DataError, ValidationIssue
from ..base.types import FloatArray
from .clean import several
from .spectrum import LIGHT_M_S, PLANCK_J_S, Curves, Quantity, Unit

FilterQuantity = Literal["transmission", "density", "decibel"]
SensorQuantity = Literal["qe", "responsivity", "relative_responsivity", "transmission", "density", "decibel"]
Use = Literal["sensor", "filter", "light", "surface"]
ELEMENTARY_CHARGE_C = 1.602176634e-19
"""Exact in the SI of 2019."""
A_PER_W_NM = PLANCK_J_S * LIGHT_M_S / ELEMENTARY_CHARGE_C * 1e9
"""QE is the responsivity in A/W, times 1239.84 over the wavelength in nm."""
FITTING: dict[Use, tuple[Quantity, ...]] = {
    "sensor": ("qe", "responsivity", "relative_responsivity"),
    "filter": ("transmission", "density", "decibel"),
    "light": ("energy", "photons"),
    "surface": ("reflectance",),
}
"""Quantities of each use of a file; the first one is assumed where nothing says otherwise."""
SAID: dict[Quantity, str] = {
    "qe": "QE",
    "responsivity": "A/W, converted to QE",
    "relative_responsivity": "response per energy, converted to relative QE",
    "transmission": "transmission",
    "density": "optical density, converted to transmission",
    "decibel": "dB, converted to transmission",
    "reflectance": "reflectance",
    "energy": "energy",
    "photons": "photons",
}
_RELATIVE_NM = 400.0
"""Where a relative response per energy is also its relative QE, so that files of one sensor have one scale."""
_WHOLE_PERCENT = (10.0, 130.0)
"""Largest values between which a file without a unit is taken for percent."""
_NOISE = 0.05
"""Noise above a share of 1."""

_SYMBOLS: tuple[tuple[str, Quantity | None, float | None], ...] = (
    (r"%|percent|pct|prozent", None, 0.01),
    (r"a(mp(ere)?s?)?/w(att)?|aw-1", "responsivity", 1.0),
    (r"ma/w|maw-1", "responsivity", 1e-3),
    (r"e-?/(ph|photon)|electrons?/photon", "qe", 1.0),
    (r"o\.?d\.?|abs\.?|absorbance", "density", 1.0),
    (r"dB", "decibel", 1.0),
    (r"qe|eqe", "qe", None),
    (r"t|transmission|transmittance", "transmission", None),
    (r"(photons?|quanta|ph|[munp]?mol)([/(s].*)?", "photons", 1.0),
    (r"counts?|cts|adu", "photons", 1.0),
    (r"[munk]?(w|watts?|j)([/(].*|(cm|m|sr|nm|s)-.*)?", "energy", 1.0),
    (r"1|-|fraction|none|dimensionless|ratio|0(\.\.\.?|-|to)1|nm-1|1/nm", None, 1.0),
    (r"a\.u\.|arb\..*|arbitrary.*|rel\.?|relative|norm\.?|normali[sz]ed|normiert", None, 1.0),
)
"""Units in brackets, in a row of their own or at the end of a head: quantity, and factor to plain numbers."""
_WORDS: tuple[tuple[str, Quantity], ...] = (
    (r"qe|eqe|ipce|quantum (efficiency|yield)|quanten\w+|(rendement|efficacite) quantique", "qe"),
    (r"(relative|rel|normali[sz]ed|normiert\w*) (spectral )?responsivity", "relative_responsivity"),
    (r"response per energy|ssf per energy", "relative_responsivity"),
    (r"responsivity|responsivitat|responsivite", "responsivity"),
    (r"transmission|transmittance|transmissivity|transmittanz|transmissionsgrad|durchlassigkeit|trans", "transmission"),
    (r"od|optical density|density|absorbance|absorbanz|extinktion|densite optique|optische dichte", "density"),
    (r"reflectance|reflectivity|remission|reflexionsgrad|remissionsgrad", "reflectance"),
    (r"ir ?radiance|radiance|radiant|spd|energy|energie|watts?|strahldichte|bestrahlungsstarke|leistung", "energy"),
    (r"photons?|photonen|quanta|ppfd", "photons"),
    (r"counts?|cts", "photons"),
)
_UNCLEAR = re.compile(
    r"\b(absorption|absorptance|extinction|response|sensitivity|empfindlichkeit|sensibilite|reponse|luminance|lumen|lux)\b"
)
_LOSS = re.compile(r"\b(attenuation|insertion loss|loss|dampfung)\b")
_WHOLE: dict[str, Quantity] = {"t": "transmission", "abs": "density", "abs.": "density"}
"""Heads that are a quantity as a whole."""
_FOREIGN = re.compile(r".*/.*|lm|lx|cd|m?v|ev|au|cm-1|[munpk]?a")
"""Units that are none of a curve."""
_BRACKETS = re.compile(r"[\[(]([^\[\]()]*(?:\([^()]*\)[^\[\]()]*)*)[\])]")
_PERCENT_OF = re.compile(r"(?:\b100\s*)?%\s*([tr])\b|\b([tr])\s*%", re.IGNORECASE)
"""`%T`, `T%` and `Baseline 100%T`, as photometers write them."""
_LEADING = re.compile(r"^\s*(%)\s*(?=[^\W\d_]{2})")
_TRAILING = re.compile(r"(?:^|[\s_,:/])(%|od|a/w|ma/w|db|percent|pct)\s*$", re.IGNORECASE)


def folded(text: str) -> str:
    """Return a text without accents, in lower case, with plain blanks and minus signs."""
    plain = unicodedata.normalize("NFKD", text.replace("\u00b5", "u").replace("\u03bc", "u").replace("\u2212", "-"))
    kept = "".join(c for c in plain if not unicodedata.combining(c)).replace("\u00df", "ss")
    return " ".join(kept.casefold().replace("\u207b", "-").split())


def symbol_unit(text: str) -> Unit | None:
    """Return the unit that a text is as a whole, as in brackets or in a row of units; None for other texts."""
    if (of := _PERCENT_OF.fullmatch(text.strip())) is not None:
        return Unit(text.strip(), "transmission" if (of[1] or of[2]) in "tT" else "reflectance", 0.01)
    plain = re.sub(r"[\s^*\u00b7]", "", re.sub(r"\bper\b", "/", folded(text)))
    for pattern, quantity, factor in _SYMBOLS:
        if re.fullmatch(pattern, plain, re.IGNORECASE):
            return Unit(text.strip(), quantity, factor)
    foreign = _FOREIGN.fullmatch(plain) and not re.search(r"[\[\]]|\w \w", text)
    return Unit(text.strip(), unclear="has an unknown unit") if foreign else None


def _parts(head: str) -> tuple[str, list[Unit]]:
    """Return a head without its units, and these."""
    found: list[Unit] = []

    def taken(match: re.Match[str]) -> str:
        unit = symbol_unit(match[0] if match.re is _PERCENT_OF else match[1])
        if unit is None:
            return match[0]
        found.append(unit)
        return " "

    if "/" in head and _BRACKETS.search(head) is None and (whole := symbol_unit(head)) and not whole.unclear:
        return "", [whole]
    bare = _LEADING.sub(taken, _PERCENT_OF.sub(taken, _BRACKETS.sub(taken, head)))
    bare = _TRAILING.sub(taken, bare)
    return bare.strip(" _,:/"), found


def name_of(head: str) -> str:
    """Return a head without its unit in brackets or at its end."""
    return _parts(head)[0] or head


def unit_of(head: str) -> Unit:
    """Return what the head of a column says of its numbers."""
    name, found = _parts(head)
    bare = re.sub(r"[\W_]+", " ", folded(name)).strip()
    stated = [_WHOLE[bare]] if bare in _WHOLE else []
    stated += [quantity for pattern, quantity in _WORDS if not stated and re.search(rf"\b({pattern})\b", bare)][:1]
    quantities = {unit.quantity for unit in found if unit.quantity} | set(stated)
    if {"relative_responsivity", "responsivity"} <= quantities:
        quantities -= {"relative_responsivity"}
    if "decibel" in quantities:
        quantities -= {"transmission"}
    factors = {unit.factor for unit in found if unit.factor is not None}
    percent = 0.01 in factors and quantities & {"density", "decibel", "responsivity", "relative_responsivity"}
    if len(quantities) > 1 or len(factors) > 1 or percent:
        return Unit(head, unclear="contradicts itself")
    if unknown := [unit for unit in found if unit.unclear]:
        return unknown[0]
    quantity = next(iter(quantities), None)
    if quantity is None and _UNCLEAR.search(bare):
        return Unit(head, unclear="does not tell its quantity")
    said = ", ".join([*(unit.words for unit in found), *(SAID[one].split(",")[0] for one in stated)])
    return Unit(said, quantity, next(iter(factors), None), loss=bool(_LOSS.search(bare)))


def used_as(
    curves: Curves, columns: Sequence[str], use: Use, stated: Quantity | None = None, *, scaled: bool = False
) -> Curves:
    """Return some curves in the first quantity of a use, or lights in energy or photons, with notes on what was done.

    The units are then the quantities of the file, and the factors that were taken of its numbers.
    `stated`: the quantity that the user says. `scaled`: the user scales the numbers, so percent stay as they are.
    Raises DataError where the quantity is unclear, or none of this use.
    """
    values, said, units = dict(curves.values), dict[str, list[str]](), dict(curves.units)
    top = max((float(curves.samples(name)[1].max(initial=0.0)) for name in columns), default=0.0)
    for name in columns:
        unit = curves.units.get(name, Unit())
        quantity = stated or unit.quantity or FITTING[use][0]
        if stated is None and unit.unclear:
            raise DataError(_unclear(curves, name, f"the head {unit.unclear}", unit.words, use))
        if quantity not in FITTING[use]:
            problem = f"{SAID[quantity].split(',')[0]} is no {SAID[FITTING[use][0]]}"
            raise DataError(
                _unclear(curves, name, problem if use != "light" else f"{problem} of a light", unit.words, use)
            )
        factor, note = 1.0, "" if scaled else _plain(unit, quantity, top)
        if note.startswith("!"):
            raise DataError(_unclear(curves, name, note[1:], unit.words, use))
        if not scaled and quantity not in ("density", "decibel", "relative_responsivity", "energy", "photons"):
            factor = 0.01 if note else unit.factor or 1.0
        values[name] = converted(curves.wavelength_nm, curves.values[name] * factor, quantity, unit)
        units[name] = Unit(SAID[quantity], quantity, factor)
        _check_share(curves, name, values[name], use, quantity)
        how = SAID[quantity]
        if not unit.quantity and not stated:
            how = f"no unit, assumed to be {SAID[quantity]}"
        said.setdefault(how + (f"; {note}" if note else ""), []).append(name)
    notes = [f"{several(names)}: {how}" for how, names in said.items()]
    return replace(curves, values=values, notes=(*curves.notes, *notes), units=units)


def _plain(unit: Unit, quantity: Quantity, top: float) -> str:
    """Return a note where percent are assumed, a fault that begins with `!`, or nothing; `top`: largest number."""
    if quantity not in ("qe", "transmission", "reflectance"):
        return ""
    if unit.factor == 0.01:
        return "" if top > 1.0 + _NOISE else "!values in percent, but none is above 1"
    if top <= 1.0 + _NOISE:
        return ""
    if unit.factor is None and _WHOLE_PERCENT[0] <= top <= _WHOLE_PERCENT[1]:
        return f"values up to {top:.4g} are assumed to be percent"
    return f"!values up to {top:.4g} are no {SAID[quantity]}"


def _unclear(curves: Curves, name: str, problem: str, words: str, use: Use) -> ValidationIssue:
    allowed = f"`quantity:` or --quantity of {', '.join(FITTING[use])}"
    if use == "sensor":
        allowed += "; `scale:` of other numbers; `relative_to:` of transmissions"
    return ValidationIssue(problem, curves.source, None, name, words or None, allowed)


def _check_share(curves: Curves, name: str, values: FloatArray, use: Use, quantity: Quantity) -> None:
    """Refuse responsivities that would be a QE above 1, and dB that would amplify."""
    top = float(np.nanmax(values, initial=0.0))
    if quantity in ("responsivity", "decibel", "density") and top > 1.0 + _NOISE:
        problem = f"its largest {SAID[FITTING[use][0]]} would be {top:.4g}"
        raise DataError(_unclear(curves, name, problem, SAID[quantity].split(",")[0], use))


def converted(wavelength_nm: FloatArray, values: FloatArray, quantity: Quantity, unit: Unit) -> FloatArray:
    """Return QE of responsivities (relative ones in a common scale), transmission of densities; others as they are."""
    if quantity == "responsivity":
        return np.asarray(values * A_PER_W_NM / wavelength_nm, dtype=float)
    if quantity == "relative_responsivity":
        return np.asarray(values * _RELATIVE_NM / wavelength_nm, dtype=float)
    if quantity == "density":
        return np.asarray(10.0**-values, dtype=float)
    if quantity == "decibel":
        return np.asarray(10.0 ** ((-np.abs(values) if unit.loss else values) / 10), dtype=float)
    return values
