"""The pictures and answers of the studies: `make gallery` runs every study, and writes what its report says and shows.

Into studies/figures, the tables of README.md and studies/README.md, lists of the guide, and studies/guide/gallery.md.
"""

from __future__ import annotations

import re
import subprocess
import sys
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory

import pandas as pd
from PIL import Image

from sweep.report import read_output
from sweep.report.figures import rendered
from sweep.report.page import drawings
from sweep.report.vision_report import street_drawing
from sweep.results.tables import VISION_STREETS

STUDIES = Path(__file__).parent.parent / "studies"

PICTURES = {
    "stopband": "cfas",
    "chromatic": "cfas",
    "freeform": "cfas",
    "producible": "cfas",
    "robust": "figures/regions-1",
    "angle": "figures/places-1",
    "dye": "cfas",
    "band": "figures/map",
    "dual": "cfas",
    "rccb": "pareto",
    "balanced": "figures/scorecard",
    "measured": "cfas",
    "sensors": "sensors",
    "paper": "cfas",
    "scorecard": "figures/scorecard",
    "distance": "figures/series-1",
    "exposure": "figures/series-1",
    "fog": "figures/series-1",
    "night": "figures/series-1",
    "hdr": "figures/series-1",
    "hdr_filter": "figures/series-4",
    "flicker": "figures/series-1",
    "noise": "figures/series-1",
    "vision": "figures/vision-ranks",
}
"""Study -> picture of its run."""
OTHERS = {
    "tiles": ("stopband", "figures/tiles"),
    "night-scene": ("scorecard", "figures/rendered-2"),
    "captures": ("hdr", "figures/captures-1"),
}
"""Further picture of the documentation -> study, and picture of its run."""
ANSWERED = (STUDIES.parent / "README.md", STUDIES / "README.md", STUDIES / "guide" / "11-hdr-and-flicker.md")
"""Documents with the answers of studies."""
STREETS = ("RGGB", "RYYCy", "best stopband")
"""Designs of the picture of streets."""
STREETS_SHOWN = "\n![The same streets through RGGB, RYYCy and the best stopband](../figures/streets.jpg)"
ROW = re.compile(r"^\| `(\w+)` \| (.*) \| !\[(.*)\]\(figures/(\w+)\.png\) \| (.*) \|$", re.MULTILINE)


def answer_of(said: str) -> str:
    """The answer that a run prints: what stands before its camera, the first line if there is none, and its warnings."""
    lines = said.splitlines()
    stated = next((at for at, line in enumerate(lines) if line.startswith("Camera: ")), 1)
    return " ".join([*lines[:stated], *(line for line in lines[stated:] if line.startswith("Warning: "))])


def with_answer(text: str, study: str, answer: str) -> str:
    """A document with the answer of a study in the last cell of its row, or in its item of a list."""
    text = re.sub(rf"^(\| `{study}` \|.*\|) [^|]* \|$", lambda row: f"{row[1]} {answer} |", text, flags=re.MULTILINE)
    return re.sub(rf"^- `{study}`: .*$", lambda _: f"- `{study}`: {answer}", text, flags=re.MULTILINE)


def gallery(rows: str) -> str:
    """Text of the gallery, from the table of `studies/README.md`."""
    parts = [
        "# Gallery",
        "",
        "**Question: what do the reports of the studies look like?** Each picture is of one run. `make gallery` makes all of them anew.",
    ]
    for study, question, caption, picture, finding in ROW.findall(rows):
        command = "make accuracy" if study == "accuracy" else f"make study NAME={study}"
        parts += [
            "",
            f"## {study}",
            "",
            f"{question} `{command}`",
            "",
            f"![{caption}](../figures/{picture}.png)",
            "",
            finding,
            *([STREETS_SHOWN] if study == "vision" else []),
        ]
    return "\n".join(parts) + "\n"


def copy_picture(folder: Path, name: str, target: Path) -> None:
    """Draw a picture of a run, at most 1,200 pixels wide and in 256 colors, a third of its size."""
    output = read_output(folder)
    drawn = next(drawing for drawn_name, _, drawing in drawings(output) if drawn_name == name)
    with Image.open(BytesIO(rendered(drawn(), "png"))) as picture:
        small = picture.convert("RGB")
        small.thumbnail((1200, 1200), Image.Resampling.LANCZOS)
        small.quantize(256, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).save(target, optimize=True)


def main() -> None:
    """Run the studies that are named, or all, and copy their pictures."""
    wanted = sys.argv[1:] or list(PICTURES)
    pictures = {study: (study, picture) for study, picture in PICTURES.items()} | OTHERS
    with TemporaryDirectory() as folder:
        for study in wanted:
            command = [Path(sys.executable).with_name("sweep"), "run", STUDIES / f"{study}.yaml", "--output", folder]
            said = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout
            answer = answer_of(said)
            for document in ANSWERED:
                document.write_text(with_answer(document.read_text(encoding="utf-8"), study, answer), encoding="utf-8")
        for name, (study, picture) in pictures.items():
            if study in wanted:
                copy_picture(
                    Path(folder) / study, picture.removeprefix("figures/"), STUDIES / "figures" / f"{name}.png"
                )
        if "vision" in wanted:
            pictures_of = pd.read_parquet(Path(folder) / "vision" / VISION_STREETS)
            drawn = street_drawing(pictures_of[pictures_of["name"].isin(STREETS)])
            with Image.open(BytesIO(rendered(drawn(), "png"))) as picture:
                small = picture.convert("RGB")
                small.thumbnail((1200, 1200), Image.Resampling.LANCZOS)
                small.save(STUDIES / "figures" / "streets.jpg", quality=85, subsampling=0)
    text = gallery((STUDIES / "README.md").read_text(encoding="utf-8"))
    (STUDIES / "guide" / "gallery.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
