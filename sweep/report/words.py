"""Numbers and names as people read them: three digits and a unit, factors, shares, errors, lamps, scenes."""

from __future__ import annotations

import math
import re

from ..metrics.columns.chromatic import CHROMATIC_ERROR
from ..metrics.columns.confusion import STATE_ERROR, STATE_ERROR_BOUND
from ..metrics.columns.tasks import PREFIX as TASK
from ..metrics.quantity import DN, LOG10, Column
from ..results.output import Output

_SWEPT = re.compile(r"filter \d+")
NARROW = "\u00a0"
"""A space at which no line ends."""
_LAMP = re.compile(r"([a-z]+)_0*(\d+)_(green|yellow|orange|red)")
_PEOPLE = {"germany": "German", "us": "US", "japan": "Japanese", "china": "Chinese", "france": "French"}
_ERRORS = (CHROMATIC_ERROR, STATE_ERROR, STATE_ERROR_BOUND)
SAME = 0.005
"""Relative difference below which a figure is neither gain nor loss."""
_TIMES = 3.0
"""From here on a factor is easier to read than percent."""
_WORDS = {
    "cfa_sensitivity": "light of the whole CFA",
    "exposure_s": "exposure of a white patch",
}
"""Names of quantities for who does not know the columns."""
_OF_TASKS = {
    "color mean error": "mean color error ΔE00",
    "color luminance SNR": "luminance SNR",
    "color Vora value": "Vora value of colors",
    "low light illuminance for SNR 10": "illuminance for SNR 10",
}
_IN_LIGHT = {"D65": "daylight", "A": "incandescent light", "LED": "white LED light", "HPS": "sodium light"}


def digits(value: float) -> str:
    """Return three significant digits, thousands separated."""
    if not math.isfinite(value):
        return "unknown" if math.isnan(value) else "∞"
    if value == 0:
        return "0"
    exponent = math.floor(math.log10(abs(float(f"{value:.3g}"))))
    if exponent < -4:
        return f"{value:.2g}"
    return f"{round(value, 2 - exponent):,.{max(0, 2 - exponent)}f}".replace("-", "−")


def number(value: float) -> str:
    """Return three significant digits without zeros at the end, for numbers that a study states."""
    text = digits(value)
    return text.rstrip("0").rstrip(".") if "." in text else text


def amount(value: float, unit: str = "") -> str:
    """Return a number with its unit, in units of people: %, ms."""
    if unit == "s" and value and abs(value) < 1:
        return amount(1e3 * value, "ms")
    if unit == "share":
        return f"{digits(100 * value)}{NARROW}%"
    return f"{digits(value)}{NARROW}{unit}" if unit else digits(value)


def of_column(column: Column, value: float) -> str:
    """Return the value of a quantity: a light in percent, an error as 1 in so many."""
    if column.role == "light":
        return amount(value, "share")
    if column.metric in _ERRORS:
        return one_in(value)
    if column.unit == LOG10:
        return f"{value:.2f} decades"
    unit = "" if column.unit in ("1", "") else column.unit.replace("1/", "per ")
    return amount(value, unit)


def one_in(error: float) -> str:
    """Return a probability as `1 in 1,000`."""
    if error <= 0 or error < 1e-12:
        return "fewer than 1 in a trillion"
    return f"1 in {digits(1 / error)}"


def change(value: float, of: float) -> str:
    """Return a value against another: `+68 %`, `× 3.75`."""
    if not (of > 0 and value > 0):
        return ""
    ratio = value / of
    if abs(ratio - 1) < SAME:
        return "±0 %"
    return f"× {digits(ratio)}" if ratio >= _TIMES else f"{100 * (ratio - 1):+.0f}{NARROW}%".replace("-", "−")


def against_in_words(value: float, of: float, name: str) -> str:
    """Return a value against another: `68 % more than RGGB`, `3.75 times that of RGGB`; empty where unknown."""
    if not (of > 0 and value > 0):
        return ""
    ratio = value / of
    if abs(ratio - 1) < SAME:
        return f"as much as {name}"
    if ratio >= _TIMES:
        return f"{digits(ratio)} times that of {name}"
    return f"{100 * abs(ratio - 1):.0f}{NARROW}% {'more' if ratio > 1 else 'less'} than {name}"


def effect(column: Column, value: float, of: float) -> str:
    """Return whether a value is a gain, a loss or the same against another."""
    if value == of or (of and abs(value / of - 1) < SAME):
        return "same"
    return "▲ gain" if (value > of) == (column.direction == "more") else "▼ loss"


def lamp(name: str) -> str:
    """Return a lamp's name in words: `a German yellow (lamp 5)`."""
    found = _LAMP.fullmatch(name)
    if found is None:
        return name
    people = _PEOPLE.get(found[1], found[1].capitalize())
    return f"a{'n' if people[0] in 'AEIO' else ''} {people} {found[3]} (lamp {found[2]})"


def lamps(two: str) -> str:
    """Return the two lamps that limit a design, in words."""
    return " and ".join(lamp(name) for name in two.split(" / "))


def quantity(column: Column) -> str:
    """Return a quantity's name in words of people: a CSD is a separation."""
    if column.name in _WORDS:
        return _WORDS[column.name]
    words = column.words.replace("CSD", "separation")
    if column.metric.startswith(TASK):
        what, _, light = words.rpartition(" ")
        what, light = (what, f" under {_IN_LIGHT[light]}") if light in _IN_LIGHT else (words, "")
        return f"{_OF_TASKS.get(what, what)}{light}"
    return (
        f"{words.replace('chromatic ', '', 1)} of lamps of any brightness"
        if words.startswith("chromatic ") and "separation" in words
        else words
    )


def full_scale(output: Output) -> str:
    """Return the full scale beside the first number of digital numbers on a page."""
    pixel = output.study.pixel
    read = {scene.pixel_of(pixel).full_scale_dn for scene in output.study.scenarios.values()}
    if len(read) > 1:
        return ""
    if pixel.captures:
        return f" of {pixel.saturation_e * pixel.dn_per_e + pixel.offset_dn:,.0f}"
    return f" of {pixel.full_scale_dn:,}"


def scaled(output: Output, text: str) -> str:
    """Return a text whose first digital number says the full scale."""
    return re.sub(rf"({DN})\b(\*\*)?", lambda found: f"{found[1]}{found[2] or ''}{full_scale(output)}", text, count=1)


def joined(parts: list[str]) -> str:
    """Return parts as a list in words."""
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}" if parts else ""


def article(words: str) -> str:
    """Return words with a or an."""
    return f"a{'n' if words[:1].lower() in 'aeiou' else ''} {words}"


def inward_share(share: float) -> float:
    """Return a share rounded up to a tenth of a percent."""
    return math.ceil(1000 * share - 1e-9) / 1000


def inward(value: float, *, up: bool, digits: int = 3) -> float:
    """Return a number with a few digits, rounded to one side."""
    if value == 0 or not math.isfinite(value):
        return value
    unit = 10.0 ** (math.floor(math.log10(abs(value))) + 1 - digits)
    return (math.ceil if up else math.floor)(value / unit * (1 - 1e-12)) * unit


def quoted(name: str) -> str:
    """Return a design's name as a name: of several words in quotation marks, but not that of a swept one."""
    return f"“{name}”" if " " in name and not _SWEPT.match(name) else name
