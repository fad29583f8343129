"""Text files as rows of cells: encoding, an instrument's own head, delimiter and decimal mark."""

from __future__ import annotations

import codecs
import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import zip_longest
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..base.disk import read_input
from ..base.errors import DataError, ValidationIssue

MOST_BYTES = 40_000_000
_MOST_LINES = 200_000
Rows = list[tuple[int, list[str]]]
_UTF_16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
_CONTROLS = re.compile(rb"[\x01-\x08\x0e-\x19\x1c-\x1f]")
"""Control bytes: spreadsheets, archives and pictures have them, and NULs, within the first few bytes."""
_BEGINNING_BYTES = 4096
_COMMENT = re.compile(r"#|//|%(?![TtRr]\b|[;,\t])")
_SAMPLED = 400
"""Lines that tell the delimiter."""
_NEARLY = 0.9
"""Share of the best score from which on the first of the separators is taken: a title of words has few numbers."""
_MARKS = {"\t": "tabs", ";": "semicolons", ",": "", "|": "bars", " ": "blanks"}
NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eEdD][+-]?[0-9]+)?")
_LEADING_ZEROS = re.compile(r"[+-]?0\d.*")
_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")
_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2}(,\d{3})+")
_DOTTED = re.compile(r"[+-]?[1-9]\d{0,2}(\.\d{3})+")
_UNIT = re.compile(r"\s*(%|nm)$")
_OVERFLOW = re.compile(r"[+-]?9\.9{2,}e\+?\d+|-9999(\.0*)?", re.IGNORECASE)
"""Marks of instruments for what they could not measure."""
MISSING = ("", "nan", "n/a", "n.a.", "na", "#n/a", "#nv", "-", "--", "null", "none")
_WORD_AND_BRACKET = re.compile(r"\S*[^\s\[(]\s?[\[(][^\[\]()]*(?:\([^()]*\)[^\[\]()]*)*[\])]|\S+")


class Instrument(NamedTuple):
    """Text of an instrument: the line before its numbers, what its head has, and a line after the numbers."""

    begin: re.Pattern[str]
    head: re.Pattern[str]
    end: re.Pattern[str] | None = None


INSTRUMENTS = {
    "Ocean": Instrument(
        re.compile(r">{3,}\s*begin.*<{3,}", re.I), re.compile(r""), re.compile(r">{3,}\s*end.*<{3,}", re.I)
    ),
    "Thorlabs": Instrument(re.compile(r"\[data\]", re.I), re.compile(r""), re.compile(r"\[end.*\]", re.I)),
    "PerkinElmer": Instrument(re.compile(r"#data", re.I), re.compile(r"^#gr", re.I | re.M)),
    "JASCO": Instrument(re.compile(r"xydata", re.I), re.compile(r"^xunits", re.I | re.M)),
    "Instrument Systems": Instrument(re.compile(r"(spectral )?data", re.I), re.compile(r"^\[.*\]\s*$", re.M)),
}
_AXIS_X = re.compile(r"^\W*x[\s_-]?(?:axis)?[\s_-]?(?:units?|mode)?\s*[:=;,\t ]\s*(\S.*)$", re.I | re.M)
_AXIS_Y = re.compile(
    r"^\W*(?:y[\s_-]?(?:axis)?[\s_-]?(?:units?|mode)?|unit|einheit)\s*[:=;,\t ]\s*(\D.*)$", re.I | re.M
)
_PERKIN_ELMER_Y = re.compile(r"^#gr\s*\n(.*)\n(.+)$", re.I | re.M)
_NAMED = re.compile(r"^(?:name|title|comment)\s*=\s*(\S.*)$", re.I | re.M)
_PACKED = re.compile(r"^##xydata", re.I | re.M)
_MOST_HEAD = 200
"""Lines of an instrument's head."""


@dataclass
class Sheet:
    """Rows of cells with their line numbers, and what stands beside them.

    `remarks`: comments. `unit`, `axis`: of all curves and of what they are over, as the format states them.
    `name`: that of the only curve.
    """

    file: str
    rows: Rows
    notes: list[str] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    unit: str = ""
    axis: str = ""
    name: str = ""
    decimal: str = "."


def number_of(cell: str) -> float | None:
    """Return a finite number as tables have it, without Python's underscores and other scripts' digits."""
    cell = cell.strip()
    usual = NUMBER.fullmatch(cell) and not _LEADING_ZEROS.fullmatch(cell) and not _OVERFLOW.fullmatch(cell)
    number = float(cell.upper().replace("D", "E")) if usual else np.nan
    return number + 0.0 if np.isfinite(number) else None


def text_sheet(path: Path, allowed: str = "a header `wavelength_nm,...` and rows of numbers") -> Sheet:
    """Return the rows of a text. Raises DataError where it is none, or empty."""
    text, notes = _decoded(path)
    file, lines = str(path), re.split(r"\r\n|\r|\n", text)
    if len(lines) > _MOST_LINES:
        raise DataError(ValidationIssue("too many lines", file, value=len(lines), allowed=f"at most {_MOST_LINES:,}"))
    sheet = Sheet(file, [], notes)
    numbered = list(enumerate(lines, 1))
    if _PACKED.search(text[:_BEGINNING_BYTES]):
        raise DataError(
            ValidationIssue("JCAMP-DX with packed numbers", file, allowed="a table of wavelengths and values")
        )
    for maker, known in INSTRUMENTS.items():
        begin = next((at for at, line in enumerate(lines[:_MOST_HEAD]) if known.begin.fullmatch(line.strip())), None)
        head = "\n".join(line.strip() for line in lines[:begin])
        if begin is None or not known.head.search(head):
            continue
        end = next(
            (at for at in range(begin + 1, len(lines)) if known.end and known.end.fullmatch(lines[at].strip())), None
        )
        of_y, named = _AXIS_Y.search(head), _NAMED.search(head)
        sheet.unit, sheet.name = (found[1].strip() if found else "" for found in (of_y, named))
        sheet.axis = found[1].strip() if (found := _AXIS_X.search(head)) else ""
        if (perkin_elmer := _PERKIN_ELMER_Y.search(head)) is not None:
            sheet.axis, sheet.unit = perkin_elmer[1].strip(), perkin_elmer[2].strip()
        sheet.notes.append(f"{begin + 1} lines of the head of a file of {maker} were left out")
        numbered = numbered[begin + 1 : end]
        break
    comments = [(n, line) for n, line in numbered if _COMMENT.match(line)]
    content_lines = [(n, line) for n, line in numbered if line.strip() and not _COMMENT.match(line)]
    sheet.remarks = [_COMMENT.sub("", line, count=1).strip() for _, line in comments]
    if not any(re.search(r"[^\s,;|]", line) for _, line in content_lines):
        raise DataError(ValidationIssue("the file is empty", file, allowed=allowed))
    mark = _mark([line for _, line in content_lines])
    if _MARKS[mark]:
        sheet.notes.append(f"columns are separated by {_MARKS[mark]}")
    heads = [(n, _COMMENT.sub("", line, count=1).strip()) for n, line in comments if n < content_lines[-1][0]]
    sheet.rows = _cells(file, content_lines, mark)
    sheet.rows = sorted([*_commented_heads(file, heads, mark, sheet.rows), *sheet.rows])
    _find_decimal(sheet)
    return sheet


def _commented_heads(file: str, comments: Sequence[tuple[int, str]], mark: str, rows: Rows) -> Rows:
    """Return the comment right above the numbers if it has as many cells as they, more than one."""
    first = next(
        (n for n, cells in rows if len(cells) > 1 and all(number_of(c.replace(",", ".")) is not None for c in cells)), 0
    )
    if not first or first != rows[0][0]:
        return []
    above = [(n, text) for n, text in comments if n < first and text][-1:]
    head_rows = _cells(file, above, mark) if above else []
    return [row for row in head_rows if len(row[1]) > 1 and len(rows[0][1]) - len(row[1]) in (0, 1)]


def _decoded(path: Path) -> tuple[str, list[str]]:
    """Return a file's text and how it was decoded. Raises DataError where it is no text."""
    content = read_input(path, MOST_BYTES, DataError)
    beginning = content[:_BEGINNING_BYTES]
    encoding = "utf-16" if content[:2] in _UTF_16 and content[:4] != codecs.BOM_UTF32_LE else "utf-8-sig"
    if content[:2] not in _UTF_16 and b"\0" in beginning:
        if _CONTROLS.search(beginning):
            raise DataError(ValidationIssue("not a text table", str(path), allowed="text; save a spreadsheet as CSV"))
        low, high = (beginning[at::2].count(0) / max(len(beginning[at::2]), 1) for at in (0, 1))
        if max(low, high) > 0.5 and len(content) % 2 == 0:  # without a mark of the order of bytes
            encoding = "utf-16-be" if low > high else "utf-16-le"
    try:
        text = content.decode(encoding)
    except UnicodeDecodeError:
        return content.decode("latin-1"), ["the text is not UTF-8, and was read as Latin-1"]
    if "\0" in text:
        raise DataError(ValidationIssue("NUL characters in the text", str(path), allowed="UTF-8 or UTF-16"))
    return text, [] if encoding == "utf-8-sig" else ["the text is UTF-16"]


def _split(line: str, mark: str) -> list[str]:
    if mark == " " and '"' not in line:
        return _WORD_AND_BRACKET.findall(line)
    (cells,) = csv.reader([line], delimiter=mark, strict=line.count('"') % 2 == 1, skipinitialspace=True)
    return [cell.strip() for cell in cells]


def _mark(lines: Sequence[str]) -> str:
    """Return the separator with which the largest shares of cells are numbers, summed over lines."""
    sampled = [lines[int(at)] for at in np.unique(np.linspace(0, len(lines) - 1, _SAMPLED).astype(int))]

    def numbers(mark: str) -> float:
        total = 0.0
        for line in sampled:
            cells = [c for c in (line.split() if mark == " " else line.replace('"', "").split(mark)) if c.strip()]
            if len(cells) > 1:
                plain = [_UNIT.sub("", cell.replace(",", ".", 1).strip()) for cell in cells]
                total += sum(number_of(cell) is not None or cell.casefold() in MISSING for cell in plain) / len(cells)
        return total

    scores = {mark: numbers(mark) for mark in _MARKS}
    if max(scores.values()) > 0:
        return next(mark for mark in _MARKS if scores[mark] >= _NEARLY * max(scores.values()))
    return max(("\t", ";", ",", "|"), key=lambda mark: sum(mark in line for line in sampled))


def _cells(file: str, lines: Sequence[tuple[int, str]], mark: str) -> Rows:
    rows = []
    for n, line in lines:
        try:
            cells = _split(line, mark)
        except (csv.Error, ValueError) as error:
            raise DataError(ValidationIssue(f"not a readable CSV: {error}", file, n)) from None
        if any(cells):
            rows.append((n, cells))
    return rows


def _find_decimal(sheet: Sheet) -> None:
    """Find the decimal mark: a comma where numbers have some, and none has a point. DataError where it is unclear.

    Where all numbers of a column have a comma before three digits, it is one: another scale of a light changes nothing,
    and no share is above 1,000.
    """
    sampled = [sheet.rows[int(at)] for at in np.unique(np.linspace(0, len(sheet.rows) - 1, _SAMPLED).astype(int))]
    cells, unclear = [cell.rstrip("%").strip() for _, row in sampled for cell in row], False
    for column in zip_longest(*(row for _, row in sampled), fillvalue=""):
        dotted = [cell for cell in column if _DOTTED.fullmatch(cell)]
        integers = [cell for cell in column if cell.isdigit() and int(cell[:6]) >= 100]
        unclear = unclear or (bool(integers) and any(_THOUSANDS.fullmatch(cell) for cell in column))
        if dotted and integers and len(dotted) == sum("." in cell for cell in column) and float(dotted[0]) < 100:
            problem, allowed = "a point may be a decimal mark or part every three digits", "numbers without it"
            raise DataError(ValidationIssue(problem, sheet.file, value=dotted[0], allowed=allowed))
    commas = [cell for cell in cells if _COMMA.fullmatch(cell) or _THOUSANDS.fullmatch(cell)]
    if not commas or any("." in cell and NUMBER.fullmatch(cell) for cell in cells):
        return
    if unclear and all(_THOUSANDS.fullmatch(cell) for cell in commas):
        problem, allowed = "a comma may be a decimal mark or part every three digits", "numbers without it"
        raise DataError(ValidationIssue(problem, sheet.file, value=commas[0], allowed=allowed))
    sheet.decimal = ","
    sheet.notes.append("numbers have decimal commas")
