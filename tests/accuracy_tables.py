"""What accuracy costs, and the hard cases, as tables: `make accuracy` writes them into README.md and tests/README.md."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from typing import Any

import pandas as pd
from PIL import Image

ROOT = Path(__file__).parent.parent
SHOWN = ("10 nm", "5 nm", "standard", "reference")
"""Settings of the four rows."""
KINDS = {
    "curves": "Curves and families of filters",
    "chain": "From light to digital numbers",
    "optics": "Images of lights",
    "noise": "Noise of a readout",
    "metrics": "Distances of points",
    "confusion": "Contrast, d' and errors",
    "search": "Searches and upper bounds",
}


def cost_table(measured: pd.DataFrame) -> list[str]:
    """The largest error and the time of a design, over all scenes, of four settings."""
    seconds = measured["following_s"].fillna(measured["first_s"])
    of_standard = measured.assign(seconds=seconds)[measured["setting"] == "standard"].set_index("scenario")["seconds"]
    lines = [
        "| setting | largest error of a CSD | time of a design, the slowest scene | times `standard`, all scenes |",
        "| --- | --- | --- | --- |",
    ]
    for setting in SHOWN:
        rows = measured.assign(seconds=seconds)[measured["setting"] == setting].set_index("scenario")
        ratio = rows["seconds"] / of_standard
        name = f"`{setting}`" if setting in ("standard", "reference") else f"`wavelengths: {{step_nm: {setting[:-3]}}}`"
        lines.append(
            f"| {name} | {_error(rows['error_dn'].max())} DN | {rows['seconds'].max():.1f} s "
            f"| {ratio.min():.2g} to {ratio.max():.2g} |"
        )
    return lines


def scene_table(measured: pd.DataFrame) -> list[str]:
    """The error and the time of a design in each scene, by setting."""
    settings = list(dict.fromkeys(measured["setting"]))
    lines = [f"| scene | {' | '.join(settings)} |", f"| --- |{' --- |' * len(settings)}"]
    for scenario, rows in measured.groupby("scenario", sort=False):
        cells = [f"{_error(row['error_dn'])} DN, {1e3 * row['following_s']:,.0f} ms" for row in rows.to_dict("records")]
        lines.append(f"| {scenario} | {' | '.join(cells)} |")
    return lines


def hard_table(cases: list[dict[str, Any]]) -> list[str]:
    """The hard cases by kind: oracle, allowed error, and the error that was seen."""
    lines = []
    for kind, title in KINDS.items():
        of_kind = [case for case in cases if case["kind"] == kind]
        lines += [
            "",
            f"**{title}** ({len(of_kind)})",
            "",
            "| case | oracle | allowed | seen |",
            "| --- | --- | --- | --- |",
        ]
        lines += [
            f"| {case['case']} | {case['oracle']} | {_error(case['allowed'])} | {_error(case['error'])} |"
            for case in of_kind
        ]
    return lines[1:]


def _error(value: float | str) -> str:
    """Two significant digits, whole from 10 on."""
    return value if isinstance(value, str) else f"{value:.0f}" if 10 <= value < 1e6 else f"{value:.2g}"


def with_block(text: str, name: str, lines: list[str]) -> str:
    """A document with a printed part anew."""
    block = re.compile(rf"(<!-- accuracy: {name} -->\n).*?(<!-- end -->)", re.DOTALL)
    text, found = block.subn(lambda match: f"{match[1]}\n" + "\n".join(lines) + f"\n\n{match[2]}", text)
    assert found == 1, name
    return text


def main(folder: Path) -> None:
    """Print the tables of a folder that `make accuracy` made, and copy its picture."""
    measured = pd.read_parquet(folder / "accuracy.parquet")
    cases = json.loads((folder / "hard_cases.json").read_text())
    tests, readme = ROOT / "tests" / "README.md", ROOT / "README.md"
    stable = f"{len(cases)} [hard cases](tests/README.md#hard-cases) stay within errors that are derived for them."
    readme.write_text(with_block(readme.read_text(), "cost", [*cost_table(measured), "", stable]))
    text = with_block(tests.read_text(), "cost", cost_table(measured))
    text = with_block(text, "scenes", scene_table(measured))
    tests.write_text(with_block(text, "hard cases", hard_table(cases)))
    with Image.open(folder / "accuracy.png") as picture:
        small = picture.convert("RGB")
        small.thumbnail((1200, 1200), Image.Resampling.LANCZOS)
        small.quantize(64, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).save(
            ROOT / "studies" / "figures" / "accuracy.png", optimize=True
        )


if __name__ == "__main__":
    main(Path(sys.argv[1]))
