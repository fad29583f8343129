"""The parts of the documentation that the program prints: `make tables` writes them anew."""

from __future__ import annotations

import re
from collections.abc import Callable
from itertools import product
from pathlib import Path

from sweep.base.errors import EXIT_CODES
from sweep.features.vision.isp import isp_of
from sweep.features.vision.keys import Illuminant
from sweep.results.dictionary import columns_table, files_table
from sweep.study import load_study
from sweep.study.editors import SCHEMA_FILE, schema_text

from .study_reference import study_reference

ROOT = Path(__file__).parent.parent


def exit_codes_table() -> list[str]:
    """Exit codes of all commands as Markdown."""
    rows = [f"| {code} | {meaning} |" for code, meaning in EXIT_CODES.items()]
    return ["| exit code | meaning |", "| --- | --- |", *rows]


def isp_table() -> list[str]:
    """Constants of the ISP of four CFAs by day and under a street lamp as Markdown."""
    study = load_study(ROOT / "studies" / "vision.yaml")
    lines = ["| CFA | light | white | matrix to R, G, B |", "| --- | --- | --- | --- |"]
    lights: tuple[Illuminant, ...] = ("daylight", "LED street light")
    for name, light in product(("RGGB", "RCCB", "RYYCy", "paper_N4"), lights):
        (space,) = (one for one in study.spaces if one.name == name)
        camera = study.setup(space, next(iter(study.scenarios))).camera
        qe = camera.qe.copy()
        qe[list(camera.modified)] = space.curves(space.points(0, 1), study.grid.size)[0]
        isp = isp_of(study.grid, qe, light)
        white = ", ".join(
            f"{channel} {share:.2f}" for channel, share in zip(camera.mosaic.channels, isp.white, strict=True)
        )
        rows = "; ".join(" ".join(f"{value:.2f}" for value in row) for row in isp.matrix)
        lines.append(f"| {name} | {light} | {white} | {rows} |")
    return lines


PRINTED: dict[str, dict[str, Callable[[], list[str]]]] = {
    "outputs/README.md": {"files": files_table, "columns": columns_table},
    "studies/guide/07-other-tasks-and-images.md": {"isp": isp_table},
    "studies/guide/reference.md": {"exit codes": exit_codes_table, "study": study_reference},
}


def with_printed(text: str, parts: dict[str, Callable[[], list[str]]]) -> str:
    """A document with its printed parts as the program prints them now."""
    for name, lines in parts.items():
        block = re.compile(rf"(<!-- printed: {name} -->\n).*?(<!-- end -->)", re.DOTALL)
        body = "\n".join(lines())
        text, found = block.subn(lambda match, body=body: f"{match[1]}\n{body}\n\n{match[2]}", text)
        assert found == 1, name
    return text


if __name__ == "__main__":
    for file, parts in PRINTED.items():
        (ROOT / file).write_text(with_printed((ROOT / file).read_text(), parts))
    (ROOT / "studies" / SCHEMA_FILE).write_text(schema_text(), encoding="utf-8")
