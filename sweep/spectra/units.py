"""Quantity and unit of a column of a file, from its head, a row of units or what a study states; and conversion."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from ..base.errors import DataError, ValidationIssue, nearest
from ..base.types import PerSample, PerWavelength
from . import LightUnit
from .clean import several
from .spectrum import LIGHT_M_S, PLANCK_J_S, Curves, Quantity, Unit

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
_WHOLE_PERCENT = (20.0, 130.0)
"""Largest values between which a file without any unit is taken for percent."""
_NOISE = 0.05
"""Noise above a share of 1."""

_MOST_LETTERS = 300
"""Letters of a head that are looked at."""
_MOST_DENSITY = 15.0
_PER = r"(([/(.]|(?=(c?m|nm|um|sr|s)(-|\d)))(c?m|nm|um|sr|s|\(|1)[^\W_]*[\w/().\-]*)?"
"""What may follow the unit of a spectrum: `/m2/nm`, `(sr nm)`, `m-2 nm-1`."""
_SYMBOLS: tuple[tuple[str, Quantity | None, float | None], ...] = (
    (r"%|percent|pct|prozent", None, 0.01),
    (r"a(mp(ere)?s?)?/w(att)?|aw-1", "responsivity", 1.0),
    (r"ma/w|maw-1", "responsivity", 1e-3),
    (r"e-?/(ph|photon)|electrons?/photon", "qe", 1.0),
    (r"o\.?d\.?|abs\.?|absorbance", "density", 1.0),
    (r"db", "decibel", 1.0),
    (r"qe|eqe", "qe", None),
    (r"t|transmission|transmittance", "transmission", None),
    (r"(photons?|quanta|ph|[munp]?mol)" + _PER, "photons", 1.0),
    (r"[munk]?(w|watts?|j)" + _PER, "energy", 1.0),
    (r"1|-|fraction|none|dimensionless|ratio|0(\.\.\.?|-|to)1|nm-1|1/nm", None, 1.0),
    (r"a\.u\.|arb\..*|arbitrary.*|rel\.?|relative|norm\.?|normali[sz]ed|normiert", None, 1.0),
)
"""Units in brackets, in a row of their own or at the end of a head: quantity, and factor to plain numbers."""
_PHOTONS = r"photons?|photonen|quanta|quantum flux|ppfd|pfd|ypfd"
_WORDS: tuple[tuple[str, Quantity], ...] = (
    (r"qe|eqe|ipce|quantum (efficiency|yield)|quanten\w+|(rendement|efficacite) quantique", "qe"),
    (r"(relative|rel|normali[sz]ed|normiert\w*) (spectral )?responsivity", "relative_responsivity"),
    (r"response per energy|ssf per energy", "relative_responsivity"),
    (r"responsivity|responsivitat|responsivite|radiant sensitivity", "responsivity"),
    (r"transmission|transmittance|transmissivity|transmittanz|transmissionsgrad|durchlassigkeit|trans", "transmission"),
    (r"od(?! *\d)|optical density|absorbance|absorbanz|extinktion|densite optique|optische dichte", "density"),
    (r"reflectance|reflectivity|remission|reflexionsgrad|remissionsgrad", "reflectance"),
    (_PHOTONS, "photons"),
    (r"ir ?radiance|radiance|radiant|spd|energy|energie|watts?|strahldichte|bestrahlungsstarke|leistung", "energy"),
)
_EXCLUSIVE: frozenset[Quantity] = frozenset({"qe", "responsivity", "transmission", "density", "reflectance"})
"""Quantities of which no two can be meant; a `photon irradiance (umol/m2/s/nm)` is one of photons."""
_UNCLEAR = re.compile(
    r"\b(absorption|absorptance|absorptivity|absorbing|extinction|response|sensitivity|empfindlichkeit|sensibilite"
    r"|reponse|luminance|lumen|lux|loss|attenuation|dampfung|reflection|blocking|emissivity|napierian|base e"
    r"|coefficient|log|log10|ln|return loss|1 t|scatter\w*|haze|internal|tau i|ti|counts?|cts|adu)\b"
)
_OTHERWISE = re.compile(r"napierian|base e|coefficient|return|internal|^log|^1 t")
"""Words by which a quantity that is named is another one."""
_LOSS = re.compile(r"\b(attenuation|insertion loss|loss|dampfung)\b")
_WHOLE: dict[str, Quantity] = {"t": "transmission", "abs": "density", "density": "density"}
"""Heads that are a quantity as a whole."""
_SINGLE = ("A", "k", "n")
"""Heads of filters and sensors that are some quantity of a material, or a name."""
_PER_FREQUENCY = re.compile(r".*([tgmk]?hz|ev|cm-1)\)*|dbm.*")
_FOREIGN = re.compile(r".*/.*|.*[a-z]-\d.*|lm|lx|cd|m?v|ev|m?au|cm-1|[munpk]?a|\u2030|pp[mb]|(x|10|1e)-?\d.*|dbm|log.*")
"""Units that are none of a curve."""
_BRACKETS = re.compile(r"[\[(]([^\[\]()]*(?:\([^()]*\)[^\[\]()]*)*)[\])]")
_PERCENT_OF = re.compile(r"(?:\b100\s*)?%\s*([tr])\b|\b([tr])\s*%", re.IGNORECASE)
"""`%T`, `T%` and `Baseline 100%T`, as photometers write them."""
_LEADING = re.compile(r"^\s*(%)\s*(?=[^\W\d_]{2})")
_ATOM = (
    r"(?:[munpk\u00b5\u03bc]?(?:w|j|mol|a|v|lm|lx|cd|s|ev|g|m)|[tgmk]?hz|cm|sr|dn|lsb|adu|counts?|cts|e-?|electrons?"
    r"|ph|photons?|quanta|db|1)"
)
_POWER = r"(?:\^?-?\d)?"
_COMPOUND = (
    rf"{_ATOM}{_POWER}(?:(?: ?/ ?| per |[_ .\u00b7](?=[a-z]+\^?-\d)|(?<=[a-z\d])[.\u00b7*])\(?{_ATOM}{_POWER}\)?)+"
    r"|[munc\u00b5\u03bc]m\^?-\d"
)
"""Units of several: `DN/(nJ/cm2)`, `e-/lx/s`, `W m-2 nm-1`, `V/lx.s`; and 1 over a length."""
_TRAILING = re.compile(
    rf"(?:(?:^|[\s_,:])({_COMPOUND})|(?:^|[\s_,:/])(od|m?a[/_ ]w(?:\^?-1)?|db|percent|pct)|(%|\u2030))\s*$",
    re.IGNORECASE,
)


def stated_quantity(word: str) -> Quantity:
    """Return a unit that a user states; raises DataError for an unknown one."""
    known = {str(quantity): quantity for of_use in FITTING.values() for quantity in of_use}
    if word not in known:
        near = nearest(word, known)
        raise DataError(ValidationIssue("unknown quantity", None, None, "--quantity", word, ", ".join(known), near))
    return known[word]


def light_unit(stated: Iterable[Quantity]) -> LightUnit | None:
    """Return the unit of lights among stated quantities."""
    known = {*stated}
    return "photons" if "photons" in known else "energy" if "energy" in known else None


def folded(text: str) -> str:
    """Return a text without accents, in lower case, with plain blanks, minus signs and apostrophes."""
    plain = unicodedata.normalize("NFKD", text[:_MOST_LETTERS].replace("\u2019", "'").replace("\x92", "'"))
    letters = "".join(c for c in plain if not unicodedata.combining(c))
    for foreign, own in (("\u00b5", "u"), ("\u03bc", "u"), ("\u2212", "-"), ("\u00df", "ss")):
        letters = letters.replace(foreign, own)
    return " ".join(letters.casefold().split())


def symbol_unit(text: str) -> Unit | None:
    """Return the unit that a text is as a whole, as in brackets or in a row of units; None for other texts."""
    if (of := _PERCENT_OF.fullmatch(text.strip())) is not None:
        return Unit(text.strip(), "transmission" if (of[1] or of[2]) in "tT" else "reflectance", 0.01)
    plain = re.sub(r"[\s^*{}\u00b7\u22c5]", "", re.sub(r"\bper\b", "/", folded(text))).replace("a_w", "a/w")
    if not _PER_FREQUENCY.fullmatch(plain):
        for pattern, quantity, factor in _SYMBOLS:
            if re.fullmatch(pattern, plain):
                return Unit(text.strip(), quantity, factor)
    foreign = _FOREIGN.fullmatch(plain) and not re.search(r"[\[\]]|[^\W\d_]{3,} ?\(|[^\W\d_]{3} [^\W\d_]{3}|\bw/", text)
    return Unit(text.strip(), unclear="has an unknown unit") if foreign else None


def _parts(head: str) -> tuple[str, list[Unit]]:
    """Return a head without its units, and these."""
    found: list[Unit] = []

    def taken(match: re.Match[str]) -> str:
        inside = match[0] if match.re is _PERCENT_OF else next(group for group in match.groups() if group is not None)
        unit = symbol_unit(inside)
        if unit is None:
            return match[0]
        found.append(unit)
        return " "

    head = head[:_MOST_LETTERS]
    if re.search(r"[/\-]", head):
        if (unit_of_head := symbol_unit(head)) and not unit_of_head.unclear:
            return "", [unit_of_head]
        before, _, after = head.rpartition(" / ")
        if before and (unit := symbol_unit(after)):
            return before.strip(), [unit]
    bare = _LEADING.sub(taken, _PERCENT_OF.sub(taken, _BRACKETS.sub(taken, head)))
    bare = _TRAILING.sub(taken, bare)
    return bare.strip(" _,:/"), found


def name_of(head: str) -> str:
    """Return a head without its unit in brackets or at its end."""
    return _parts(head)[0] or head


def _quantity_in(text: str) -> list[Quantity]:
    """Return the first quantity that words name, in a list; empty for none."""
    if text in _WHOLE:
        return [_WHOLE[text]]
    return [quantity for pattern, quantity in _WORDS if re.search(rf"\b({pattern})\b", text)][:1]


def unit_of(head: str) -> Unit:
    """Return what the head of a column says of its numbers."""
    name, found = _parts(head)
    bare = re.sub(r"[\W_]+", " ", folded(name)).strip()
    stated = _quantity_in(bare)
    symbols = {unit.quantity for unit in found if unit.quantity}
    if {"relative_responsivity", "responsivity"} <= {*stated, *symbols}:
        stated = []
    if "decibel" in symbols and not re.search(r"return|reflect", bare):
        stated = [] if stated == ["transmission"] else stated
    quantities = symbols | {word for word in stated if not symbols or word in _EXCLUSIVE}
    factors = {unit.factor for unit in found if unit.factor is not None}
    percent = 0.01 in factors and quantities & {"density", "decibel", "responsivity", "relative_responsivity"}
    if len(quantities) > 1 or len(factors) > 1 or percent:
        return Unit(head, unclear="contradicts itself")
    if unknown := [unit for unit in found if unit.unclear]:
        return unknown[0]
    quantity = next(iter(quantities), None)
    if _UNCLEAR.search(bare) and (quantity is None or _OTHERWISE.search(bare)):
        counts = re.search(r"\b(counts?|cts|adu)\b", bare)
        return Unit(
            head, unclear="is of a spectrometer without calibration" if counts else "does not tell its quantity"
        )
    said = ", ".join([*(unit.words for unit in found), *(SAID[word].split(",")[0] for word in stated)])
    return Unit(said, quantity, next(iter(factors), None), loss=bool(_LOSS.search(bare)))


def stated_in_title(text: str) -> Unit | None:
    """Return the unit that a title or a comment states: in brackets, after `unit:`, as A/W, or as a whole."""
    text = text[:_MOST_LETTERS]
    parts = re.findall(r"[\[(][^\[\]]*[\])]|(?:unit|einheit|unite)s?\s*[:=]\s*\S.*", text, re.IGNORECASE)
    parts += re.findall(r"(?<![\w/])m?A\s?/\s?W(?![\w/])", text)
    units = [symbol_unit(text), *(symbol_unit(re.sub(r"^[^\[(]*?[:=]\s*", "", part).strip("[]() ")) for part in parts)]
    return next((unit for unit in units if unit is not None and (unit.quantity or unit.factor == 0.01)), None)


def begun_by_quantity(text: str) -> Unit | None:
    """Return the unit of a title that begins with a quantity, as `Transmittance of ND filters, %`; None for others."""
    plain = re.sub(r"[^\w%]+", " ", folded(text)).strip()
    words = "|".join(f"(?:{pattern})" for pattern, _ in _WORDS)
    begins = re.match(rf"(?:spectral )?({words})\b(?! *\d)", plain)
    if begins is not None and (quantity := _quantity_in(begins[1])):
        found = unit_of(text)
        return found if found.unclear else Unit(text, found.quantity or quantity[0], found.factor, loss=found.loss)
    if re.match(r"(?:relative |normali[sz]ed )?(?:spectral )?(?:response|sensitivity|empfindlichkeit)\b", plain):
        return Unit(text, unclear="does not tell its quantity")
    return None


def used_as(
    curves: Curves, columns: Sequence[str], use: Use, stated: Quantity | None = None, *, scaled: bool = False
) -> Curves:
    """Return some curves in the first quantity of a use, or lights in energy or photons, with notes on what was done.

    The units are then the quantities of the file, and the factors that were taken of its numbers.
    `stated`: the quantity that the user says. `scaled`: the user scales the numbers, so percent stay as they are.
    Raises DataError where the quantity is unclear, or none of this use.
    """
    values, said, units = dict(curves.values), dict[str, list[str]](), dict(curves.units)

    def asked(name: str) -> Quantity:
        return stated or curves.units.get(name, Unit()).quantity or FITTING[use][0]

    def top(name: str) -> float:
        unit = curves.units.get(name, Unit())
        alike = [
            other
            for other in curves.values
            if (known := curves.units.get(other, Unit())).factor == unit.factor
            and known.group == unit.group
            and asked(other) == asked(name)
        ]
        return max(float(curves.samples(other)[1].max(initial=0.0)) for other in {*alike, name})

    for name in columns:
        unit, quantity = curves.units.get(name, Unit()), asked(name)
        vague = unit.unclear and not (use == "light" and re.search("respon|sensiti|empfind", folded(unit.words)))
        if stated is None and unit.quantity is None and use in ("sensor", "filter") and name_of(name) in _SINGLE:
            raise DataError(_unclear(curves, name, "absorbance (`quantity: density`), or a name?", "", use))
        if stated is None and vague:
            raise DataError(_unclear(curves, name, f"the head {unit.unclear}", unit.words, use))
        if quantity not in FITTING[use]:
            problem = f"{SAID[quantity].split(',')[0]} is no {SAID[FITTING[use][0]]}"
            raise DataError(
                _unclear(curves, name, problem if use != "light" else f"{problem} of a light", unit.words, use)
            )
        factor, note, fault = 1.0, "", ""
        if not scaled:
            bare = all(other.factor is None and not other.unclear for other in curves.units.values())
            note, fault = _plausible(unit, quantity, top(name), stated=stated is not None, bare=bare)
        if fault:
            raise DataError(_unclear(curves, name, fault, unit.words, use))
        if not scaled and quantity not in ("density", "decibel", "relative_responsivity", "energy", "photons"):
            factor = 0.01 if note else unit.factor or 1.0
        values[name] = converted(curves.wavelength_nm, curves.values[name] * factor, quantity, unit)
        units[name] = Unit(SAID[quantity], quantity, factor)
        _check_share(curves, name, values[name], use, quantity)
        told = {known.quantity for known in curves.units.values()}
        if use == "filter" and (unit.quantity or stated) is None and name_of(name) == "R" and "transmission" in told:
            raise DataError(_unclear(curves, name, "reflectance, or the transmission of a red filter?", "", use))
        how = SAID[quantity].replace("A/W", "mA/W") if factor == 1e-3 else SAID[quantity]
        if not unit.quantity and not stated:
            how = f"no unit, assumed to be {SAID[quantity]}"
        said.setdefault(how + (f"; {note}" if note else ""), []).append(name)
    notes = [f"{several(names)}: {how}" for how, names in said.items()]
    return replace(curves, values=values, notes=(*curves.notes, *notes), units=units)


def _plausible(unit: Unit, quantity: Quantity, top: float, *, stated: bool, bare: bool) -> tuple[str, str]:
    """Return a note where percent are assumed, and why the largest number `top` cannot be; empty for neither.

    `bare`: no column of the file has a unit.
    """
    if quantity == "density":
        return "", f"values up to {top:.4g} are no {SAID[quantity].split(',')[0]}" if top > _MOST_DENSITY else ""
    if quantity not in ("qe", "transmission", "reflectance"):
        return "", ""
    if unit.factor == 0.01:
        return "", "" if top > 1.0 + _NOISE or stated else "values in percent, but none is above 1"
    if top <= 1.0 + _NOISE:
        return "", ""
    if bare and _WHOLE_PERCENT[0] <= top <= _WHOLE_PERCENT[1]:
        return f"values up to {top:.4g} are assumed to be percent", ""
    return "", f"values up to {top:.4g} are no {SAID[quantity]}"


def _unclear(curves: Curves, name: str, problem: str, words: str, use: Use) -> ValidationIssue:
    allowed = f"`quantity:` or --quantity of {', '.join(FITTING[use])}"
    if use == "sensor":
        allowed += "; `scale:` of other numbers; `relative_to:` of transmissions"
    return ValidationIssue(problem, curves.source, None, name, words or None, allowed)


def _check_share(curves: Curves, name: str, values: PerSample, use: Use, quantity: Quantity) -> None:
    """Refuse responsivities that would be a QE above 1, and dB that would amplify."""
    top = float(np.nanmax(values, initial=0.0))
    if quantity in ("responsivity", "decibel", "density") and top > 1.0 + _NOISE:
        problem = f"its largest {SAID[FITTING[use][0]]} would be {top:.4g}"
        raise DataError(_unclear(curves, name, problem, SAID[quantity].split(",")[0], use))


def converted(wavelength_nm: PerWavelength, values: PerSample, quantity: Quantity, unit: Unit) -> PerSample:
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
