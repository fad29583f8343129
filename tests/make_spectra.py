"""Makes sweep/spectra/builtin/spectra.parquet: measured and standard spectra, with a data card for each set.

    python -m tests.make_spectra EARTHLIB

EARTHLIB: the wheel of earthlib 1.1.0, or its folder where it is installed; it is read, not imported. The script stands
among the tests because no user of the package needs that library, and because `tests/spectra/test_tasks_data.py` makes
the file again where it is at hand.
"""

from __future__ import annotations

import hashlib
import io
import json
import re
import sys
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

OUT = Path(__file__).parent.parent / "sweep" / "spectra" / "builtin" / "spectra.parquet"
FIRST_NM, LAST_NM = 400.0, 700.0
"""What the built-in sensor and lights cover."""

GROUPS = {
    "white marking": (r"^(?:traw|pprw|ppcw)", 40),
    "yellow marking": (r"^tray", 40),
    "red curb paint": (r"^tccr", 40),
    "blue parking paint": (r"^tpab", 40),
}
"""Paints of the Santa Barbara library by the codes of its field names."""
MATERIALS = {
    "asphalt": (("road", "parking_lot", "asphalt"), 50),
    "concrete": (("sidewalk", "bridge", "driveway"), 35),
    "canopy": (("canopy",), 100),
    "soil": (("soil",), 35),
}
SOURCES = {
    "earthlib": (
        "earthlib 1.1.0, https://github.com/earth-chris/earthlib",
        "MIT",
        "Christopher Anderson; paints, asphalt and concrete: Santa Barbara urban library, measured; soils: ICRAF-ISRIC, "
        "measured; canopies: PROSAIL, modeled",
    ),
    "cie_illuminants": ("colour-science, SDS_ILLUMINANTS (CIE 15)", "BSD-3-Clause", "Colour Developers; CIE"),
    "light_sources": ("colour-science, SDS_LIGHT_SOURCES", "BSD-3-Clause", "Colour Developers; RIT, NIST"),
    "colorchecker": (
        "colour-science, SDS_COLOURCHECKERS['cc_ohta']",
        "BSD-3-Clause",
        "Colour Developers; N. Ohta, 24 patches of a ColorChecker, measured",
    ),
    "iso_17321": (
        "colour-science, SDS_COLOURCHECKERS['ISO 17321-1']",
        "BSD-3-Clause",
        "Colour Developers; ISO 17321-1",
    ),
    "cie_test_colors": (
        "colour-science, 99 test color samples of CIE 224:2017",
        "BSD-3-Clause",
        "Colour Developers; CIE 224",
    ),
    "training_reflectances": (
        "colour-science, 190 training reflectances of rawtoaces",
        "BSD-3-Clause",
        "Colour Developers; Academy of Motion Picture Arts and Sciences",
    ),
}


def from_earthlib(source: Path) -> list[dict[str, Any]]:
    """At most 300 reflectances, evenly spaced in the order of their names."""
    data = (source if source.is_dir() else zipfile.Path(source) / "earthlib") / "data"
    facts = pd.read_csv(io.BytesIO((data / "spectra.csv").read_bytes()))
    header = (data / "spectra.sli.hdr").read_text(encoding="utf-8")
    values = np.frombuffer((data / "spectra.sli").read_bytes(), "<f4").reshape(len(facts), -1)
    names, wave_um = (_listed(header, key) for key in ("spectra names", "wavelength"))
    wave = np.round([1000 * float(text) for text in wave_um], 6)
    seen = (wave >= FIRST_NM) & (wave <= LAST_NM)
    rows = []
    for group, picked, most in (
        *((g, facts[(facts.LEVEL_3 == "paint") & facts.NAME.str.contains(code)], n) for g, (code, n) in GROUPS.items()),
        *((g, facts[facts.LEVEL_3.isin(kinds)], n) for g, (kinds, n) in MATERIALS.items()),
    ):
        ordered = picked.sort_values("NAME", kind="stable").index.to_numpy()
        chosen = ordered[np.unique(np.linspace(0, len(ordered) - 1, min(most, len(ordered))).round().astype(int))]
        for number, at in enumerate(chosen, 1):
            if names[at] != facts.NAME[at].strip():
                raise SystemExit(f"row {at}: the table says {facts.NAME[at]}, the spectra {names[at]}")
            rows.append(row("earthlib", group, f"{group} {number}", "reflectance", wave[seen], values[at][seen]))
    return rows


def _listed(header: str, key: str) -> list[str]:
    """The list of an ENVI header's key."""
    found = re.search(rf"{key} = {{(.*?)}}", header, re.DOTALL)
    if found is None:
        raise SystemExit(f"the header has no {key}")
    return [text.strip() for text in found.group(1).split(",")]


def from_colour() -> list[dict[str, Any]]:
    """Standard spectra of colour-science."""
    import colour
    from colour.characterisation import read_training_data_rawtoaces_v1
    from colour.quality.cfi2017 import load_TCS_CIE2017

    rows = []
    for kind, table in (("cie_illuminants", colour.SDS_ILLUMINANTS), ("light_sources", colour.SDS_LIGHT_SOURCES)):
        rows += [row(kind, kind, name, "emission", *on_grid(sd)) for name, sd in dict(sorted(table.items())).items()]
    for kind, chart in (("colorchecker", "cc_ohta"), ("iso_17321", "ISO 17321-1")):
        for name, sd in colour.SDS_COLOURCHECKERS[chart].items():
            rows.append(row(kind, kind, f"{kind} {name}", "reflectance", *on_grid(sd)))
    for kind, table in (
        ("cie_test_colors", load_TCS_CIE2017(colour.SpectralShape(380, 780, 5))),
        ("training_reflectances", read_training_data_rawtoaces_v1()),
    ):
        for number, column in enumerate(np.asarray(table.values).T, 1):
            rows.append(row(kind, kind, f"{kind} {number}", "reflectance", np.asarray(table.wavelengths), column))
    return rows


def on_grid(sd: Any) -> tuple[np.ndarray, np.ndarray]:
    return np.asarray(sd.wavelengths, dtype=float), np.asarray(sd.values, dtype=float)


def row(source: str, group: str, name: str, kind: str, wave: np.ndarray, values: np.ndarray) -> dict[str, Any]:
    """A spectrum with what is between 380 and 780 nm of it, in the precision of a 32-bit float."""
    kept = (wave >= 380) & (wave <= 780)
    return {
        "set": source,
        "group": group,
        "name": name,
        "kind": kind,
        "wavelength_nm": wave[kept].astype(np.float32),
        "value": values[kept].astype(np.float32),
    }


def digest_of(rows: list[dict[str, Any]]) -> str:
    """SHA-256 of a set's names and numbers, hexadecimal."""
    found = hashlib.sha256()
    for each in rows:
        found.update(str(each["name"]).encode() + each["wavelength_nm"].tobytes() + each["value"].tobytes())
    return found.hexdigest()


def made(source: Path) -> pa.Table:
    """The whole table, its cards in its metadata."""
    rows = from_earthlib(source) + from_colour()
    cards = {}
    for name, (origin, license_, credit) in SOURCES.items():
        own = [each for each in rows if each["set"] == name]
        cards[name] = {"source": origin, "license": license_, "credit": credit, "sha256": digest_of(own)}
    schema = pa.schema(
        [
            *((name, pa.string()) for name in ("set", "group", "name", "kind")),
            *((name, pa.list_(pa.float32())) for name in ("wavelength_nm", "value")),
        ],
        metadata={"cards": json.dumps(cards)},
    )
    return pa.Table.from_pylist(rows, schema=schema)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        raise SystemExit("usage: python -m tests.make_spectra EARTHLIB")
    table = made(Path(sys.argv[1]))
    pq.write_table(table, OUT, compression="zstd", compression_level=19)
    sets = table.column("set").to_pylist()
    print({name: sets.count(name) for name in SOURCES}, OUT.stat().st_size, "bytes")
