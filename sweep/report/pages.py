"""HTML pages from templates, one self-contained file each, and tables as text."""

from __future__ import annotations

import math
from importlib import resources
from typing import Any

import pandas as pd
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup


def page(template: str, **values: Any) -> str:
    """Fill in a template; every value is escaped."""
    loader = PackageLoader("sweep.report", "templates")
    templates = Environment(
        loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    templates.policies["json.dumps_kwargs"] = {"sort_keys": False, "allow_nan": False}
    return templates.get_template(template).render(**values)


def script(name: str) -> Markup:
    """Return a script beside the templates for the page."""
    text = resources.files("sweep.report").joinpath("templates", name).read_text(encoding="utf-8")
    return Markup(text.replace("</script", "<\\/script"))


def rows(table: pd.DataFrame) -> list[list[str]]:
    """Return header and cells as text; a missing value is a dash."""
    if table.empty:
        return []
    body = [[_cell(value) for value in row] for row in table.itertuples(index=False)]
    return [[str(name) for name in table.columns], *body]


def _cell(value: object) -> str:
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:g}" if isinstance(value, float) else str(value)


def aligned(table: pd.DataFrame) -> list[str]:
    """Return a table as lines of text."""
    cells = rows(table)
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    return ["  ".join(c.ljust(w) for c, w in zip(line, widths, strict=True)).rstrip() for line in cells]
