"""The parts of the documentation that the program prints: `make tables` writes them anew."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

from sweep.base.errors import EXIT_CODES
from sweep.results.dictionary import columns_table, files_table
from sweep.study.editors import SCHEMA_FILE, schema_text

from .study_reference import study_reference

ROOT = Path(__file__).parent.parent


def exit_codes_table() -> list[str]:
    """Exit codes of all commands as Markdown."""
    rows = [f"| {code} | {meaning} |" for code, meaning in EXIT_CODES.items()]
    return ["| exit code | meaning |", "| --- | --- |", *rows]


PRINTED: dict[str, dict[str, Callable[[], list[str]]]] = {
    "outputs/README.md": {"files": files_table, "columns": columns_table},
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
