"""Studies drawn from the JSON schema: refused in lines that have a place, or loaded; what editors mark is refused.

A study of all sections, or one that comes with the package, is changed at one or two places of the schema: a value that
it allows there, one outside its limits, or one of another kind; a key left out, misspelled, or of another section.
"""

from __future__ import annotations

import math
import warnings
from collections import Counter
from copy import deepcopy
from io import StringIO
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
from ruamel.yaml import YAML

from sweep.base.errors import MOST_ISSUES, SweepError
from sweep.study import load_study, sensor_studies_in
from sweep.study.editors import study_schema

from ..conftest import STUDIES
from ..curve_texts import WAVE, bell, csv
from ..watchdog import within
from ..whole_study import WHOLE

HANG_S = 120.0
"""For what takes a second or less, on a machine that is busy with other things."""
CURVES = "sensor:\n  files:\n    - {file: qe.csv, columns: {R: r, G: g, Y: y, N: g}}\n"
LIGHTS = "lights:\n  files:\n    - {file: led.csv, quantity: energy, outside: zero, signals: {red: [r], yellow: [y]}}\n"
OWN = f"study: own\n{CURVES}{LIGHTS}cfas: [RGYN, RYGG]\nobjective: csd_red_yellow\n"
STRANGE: tuple[Any, ...] = (
    *(0, -0.0, 1, -1, 0.5, 5e-324, 1e-300, 1e300, 1.7976931348623157e308, math.nan, math.inf, -math.inf, 2**63, 10**99),
    *(True, None, "", "0", "any", ".nan", "1e5", [], {}, [[]], [math.nan], {"min": 0, "max": 1, "count": 10**9}),
    *("x" * 300, "../" * 50, "\0", "\x1b[2J", "\u202e", "\U0001f6a6", [0.5] * 1000, {"a": {"b": {"c": {}}}}),
)
SCHEMA = study_schema()
EDITOR = jsonschema.Draft7Validator(SCHEMA)


def impossible(node: Any) -> bool:
    """Whether a number in a study is none."""
    inner = node.values() if isinstance(node, dict) else node if isinstance(node, list) else ()
    return (isinstance(node, float) and not math.isfinite(node)) or any(map(impossible, inner))


class Drawing:
    """Values and places drawn at random, the same from each seed."""

    def __init__(self, *seed: int) -> None:
        self.rng = np.random.default_rng(seed)

    def one_of(self, values: Any) -> Any:
        return values[int(self.rng.integers(len(values)))]

    def chance(self, share: float) -> bool:
        return bool(self.rng.random() < share)

    def form(self, part: Any) -> dict[str, Any]:
        """One form of those that a part of the schema allows."""
        part = part if isinstance(part, dict) else {}
        while {"$ref", "anyOf", "oneOf"} & part.keys() and "properties" not in part:
            ref = part.get("$ref", "").removeprefix("#/$defs/")
            part = SCHEMA["$defs"][ref] if ref else self.one_of(part.get("anyOf") or part.get("oneOf"))
        return part

    def value(self, part: Any, depth: int = 0) -> Any:
        """What a part allows, its ends more often than what lies between."""
        part = self.form(part)
        named = part.get("enum") or [part[key] for key in ("const",) if key in part]
        match "name" if named else part.get("type"):
            case "number" | "integer":
                low = part.get("minimum", part.get("exclusiveMinimum", -1e6))
                high = part.get("maximum", part.get("exclusiveMaximum", 1e6))
                number = self.one_of([low, high, low + (high - low) * self.rng.random(), 1.0, 2.0])
                return int(number) if part["type"] == "integer" and abs(number) < 1e18 else float(number)
            case "boolean":
                return self.chance(0.5)
            case "array" if depth < 4:
                least = part.get("minItems", 0)
                return [self.value(part.get("items"), depth + 1) for _ in range(least + int(self.rng.integers(3)))]
            case "object" if depth < 4:
                known = part.get("properties", {})
                chosen = {*part.get("required", ()), *(key for key in known if self.chance(0.15))}
                return {key: self.value(known.get(key), depth + 1) for key in known if key in chosen}
            case "null":
                return None
        return self.one_of(
            named or ["R", "Y", "RGGB", "RYNCy", "csd_yellow_red", "sensitivity", "road", "edges", "yellow", "x"]
        )

    def outside(self, part: Any) -> Any:
        """A number beyond a limit, or a text where there is none."""
        part = self.form(part)
        ends = [part[key] for key in ("minimum", "exclusiveMinimum", "maximum", "exclusiveMaximum") if key in part]
        return self.one_of([end + sign * max(1, abs(end)) for end in ends for sign in (-1, 1)] or ["no such", [], 1e9])

    def change(self, tree: dict[str, Any]) -> tuple[Any, ...]:
        """Change a place of a study that the schema leads to; returns its keys."""
        node: Any = tree
        part, path = SCHEMA, tuple[Any, ...]()
        while True:
            form = self.form(part)
            known = form.get("properties", {})
            if isinstance(node, list) and node:
                key: Any = int(self.rng.integers(len(node)))
                part = form.get("items", {})
            elif isinstance(node, dict) and (known or node):
                key = self.one_of([*node, *node, *known])
                part = known.get(key, form.get("additionalProperties", {}))
            else:
                return path
            path = (*path, key)
            inner = node[key] if isinstance(node, list) else node.get(key)
            if not isinstance(inner, dict | list) or not inner or self.chance(0.25):
                break
            node = inner
        number = isinstance(inner, int | float) and not isinstance(inner, bool)
        new = self.one_of(
            [lambda: self.value(part)] * 4 + [lambda: self.outside(part)] * 2 + [lambda: self.one_of(STRANGE)]
        )()
        if number and self.chance(0.5):
            new = type(inner)(inner * self.one_of([0.5, 0.9, 1.1, 2]))
        if self.chance(0.1):
            new = self.one_of([[new], {"values": new}, {"a": new}])
        if isinstance(node, dict) and self.chance(0.2):
            node.pop(key, None)
            if self.chance(0.5):
                node[self.one_of([f"{key}x", str(key)[:-1], "each", str(key).upper(), "min"])] = inner
        else:
            node[key] = new
        return path


@pytest.fixture(scope="module")
def studies() -> list[dict[str, Any]]:
    texts = [path.read_text() for path in sorted(STUDIES.glob("*.yaml")) if path.stem not in ("measured", "cameras")]
    return [*(YAML(typ="safe", pure=True).load(text) for text in (*texts, OWN)), *[WHOLE] * len(texts)]


def without_replaced(tree: dict[str, Any]) -> dict[str, Any]:
    """A study with a value of `each` in place of what its scenario states of that key, which counts for nothing."""
    tree = deepcopy(tree)
    scenarios = tree.get("scenarios")
    for scene in scenarios.values() if isinstance(scenarios, dict) else ():
        each = scene.get("each") if isinstance(scene, dict) else None
        for dotted, values in each.items() if isinstance(each, dict) else ():
            *path, last = str(dotted).split(".")
            inner = scene
            for key in path:
                inner = inner.get(key) if isinstance(inner, dict) else None
            if isinstance(inner, dict) and last in inner and isinstance(values, list) and values:
                inner[last] = values[0]
    return tree


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, 41))])
def test_a_changed_study_loads_or_is_refused_where_it_was_changed(
    studies: list[dict[str, Any]], tmp_path: Path, seed: int
) -> None:
    qe = 0.8 * bell(620, 40), 0.8 * bell(530, 40), 0.4 + 0.5 * bell(600, 60)
    csv(tmp_path, "wavelength_nm,r,g,y", WAVE, *qe, name="qe.csv")
    csv(tmp_path, "wavelength_nm,r,y", WAVE, bell(635, 8), bell(590, 8), name="led.csv")
    draw, file, found = Drawing(2, seed), tmp_path / "changed.yaml", Counter[tuple[bool, bool]]()
    for _ in range(40):
        tree = deepcopy(draw.one_of(studies))
        changed = [draw.change(tree) for _ in range(1 + draw.chance(0.3))]
        text = StringIO()
        YAML(typ="safe", pure=True).dump(tree, text)
        file.write_bytes(text.getvalue().encode("utf-8", "surrogatepass"))
        marked = impossible(tree) or not EDITOR.is_valid(without_replaced(tree))
        with warnings.catch_warnings(), within(HANG_S):
            warnings.simplefilter("error")
            try:
                several = sensor_studies_in(file)
                for member in [None] if several is None else several.members:
                    load_study(file, member=member)
            except SweepError as error:
                found[marked, True] += 1
                told = str(error).splitlines()
                assert 1 <= len(told) <= MOST_ISSUES, changed
                assert all(line.strip() and line.isprintable() and len(line) < 20_000 for line in told), changed
                for issue in error.issues[: MOST_ISSUES - 1]:
                    assert issue.line is not None or str(issue.file).endswith(".csv"), (changed, str(issue))
                    assert issue.key or issue.file != str(file) or issue.problem.startswith("not valid YAML"), changed
            else:
                assert not marked, (changed, [error.message for error in EDITOR.iter_errors(tree)])
                found[False, False] += 1
    assert min(found[True, True], found[False, True], found[False, False]) > 1, found
