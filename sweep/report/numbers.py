"""Numbers as people read them: digits and units, ranges, changes, errors. The one place where a number becomes text."""

from __future__ import annotations

import math
from collections.abc import Sequence

NARROW = "\u00a0"
"""A space at which no line ends."""
SAME = 0.005
"""Relative difference below which a figure is neither gain nor loss."""
ERROR, SHARE, YIELD = "error", "share", "yield"
"""Units of probabilities of an error, of shares that are read in percent, and of shares near 1."""
_TIMES = 3.0
"""From here on a factor is easier to read than percent."""
_FEW = 9.5
"""Percent below which a change has a digit after the point."""
_RAREST = 1e-12
_UNITS = {"s": (1e3, "ms"), SHARE: (100.0, "%"), "1/nm": (1.0, "per nm"), "1": (1.0, "")}
Span = tuple[float, float]


def unit_shown(unit: str) -> tuple[float, str]:
    """Return the factor to the unit that people read, and that unit."""
    return _UNITS.get(unit, (1.0, unit))


def digits(value: float, most: int = 3, *, trim: bool = False) -> str:
    """Return a number with a few significant digits, thousands separated; `trim`: without zeros at the end."""
    if not math.isfinite(value):
        return "unknown" if math.isnan(value) else "∞"
    if value == 0:
        return "0"
    exponent = math.floor(math.log10(abs(float(f"{value:.{most}g}"))))
    if exponent < -4:
        return f"{value:.2g}"
    places = most - 1 - exponent
    text = f"{round(value, places):,.{max(0, places)}f}".replace("-", "\u2212")
    return text.rstrip("0").rstrip(".") if trim and "." in text else text


def amount(value: float, unit: str = "", *, trim: bool = False) -> str:
    """Return a number with its unit: `5.56 ms`, `59.1 %`, `1 in 1,000`."""
    if unit == ERROR:
        return "rarer than 1 in a trillion" if value < _RAREST else f"1 in {digits(1 / value, trim=True)}"
    if unit == YIELD:
        return _near_all(value)
    factor, name = unit_shown(unit)
    text = digits(factor * value, trim=trim)
    return f"{text}{NARROW}{name}" if name and math.isfinite(value) else text


def _near_all(share: float) -> str:
    """Return a share with two digits of what is missing to 1, rounded down."""
    if not 0.9 < share < 1:
        return amount(share, SHARE, trim=True)
    places = min(4, -1 - math.floor(math.log10(1 - share)))
    return f"{math.floor(share * 100 * 10**places) / 10**places:.{places}f}{NARROW}%"


def inward(value: float, most: int = 3, *, up: bool) -> float:
    """Return a number with a few digits, rounded to one side, so that what it promises holds."""
    if value == 0 or not math.isfinite(value):
        return value
    step = 10.0 ** (math.floor(math.log10(abs(value))) + 1 - most)
    return (math.ceil(value / step * (1 - 1e-12)) if up else math.floor(value / step * (1 + 1e-12))) * step


def ranges(spans: Sequence[Span], unit: str, whole: Span, most: int = 3) -> str:
    """Return ranges within a whole, rounded inward: `up to 402 cd`, `2.26 to 3.45 cd, from 69.2 cd`.

    An end of the whole is no end of what holds, and is said as that.
    """
    parts, (factor, name) = [], unit_shown(unit)
    for low, high in spans:
        first, last = low <= whole[0], high >= whole[1]
        start = whole[0] if first else inward(low * factor, most, up=True) / factor
        stop = whole[1] if last else inward(high * factor, most, up=False) / factor
        start_text, stop_text = amount(start, unit, trim=True), amount(stop, unit, trim=True)
        if first and last:
            parts.append(f"any of {start_text.removesuffix(NARROW + name)} to {stop_text}")
        elif first:
            parts.append(f"up to {stop_text}")
        elif last:
            parts.append(f"from {start_text}")
        elif start >= stop:
            parts.append(f"near {start_text}")
        else:
            parts.append(f"{start_text.removesuffix(NARROW + name)} to {stop_text}")
    return ", ".join(parts) or "nowhere"


def change(value: float, of: float) -> str:
    """Return a value against another: `+68 %`, `x 3.75`; empty where one of them is none."""
    if not (of > 0 and value > 0):
        return ""
    ratio = value / of
    if ratio >= _TIMES:
        return f"\u00d7{NARROW}{digits(ratio)}"
    percent = 100 * (ratio - 1)
    text = f"{percent:+.{int(abs(percent) < _FEW)}f}{NARROW}%".replace("-", "\u2212")
    return text if text.strip("+\u2212") != f"0.0{NARROW}%" else f"±0{NARROW}%"


def effect(value: float, of: float, better: str) -> str:
    """Return `gain` or `loss` of a value against another; empty where they are shown as equal."""
    if not better or not (math.isfinite(value) and math.isfinite(of)) or abs(value - of) <= SAME * abs(of):
        return ""
    return "gain" if (value > of) == (better == "more") else "loss"


def span(values: Sequence[float], unit: str = "") -> str:
    """Return one value, or the least and the most."""
    low, high = (amount(end, unit, trim=True) for end in (min(values), max(values)))
    return low if low == high else f"{low.removesuffix(NARROW + unit_shown(unit)[1])} to {high}"


def joined(parts: Sequence[str]) -> str:
    """Return parts as a list in words."""
    return " and ".join([", ".join(parts[:-1]), parts[-1]] if len(parts) > 1 else parts)
