"""Files changed at random: keys, values and structure of studies, bytes and cells of tables. The same from each seed."""

from __future__ import annotations

import math
from copy import deepcopy
from io import StringIO
from typing import Any

import numpy as np
from ruamel.yaml import YAML

EXTREMES: tuple[Any, ...] = (
    *(0, -0.0, 1, -1, 2, 0.5, 5e-324, 1e-300, 1e-30, 1e-9, 1e9, 1e30, 1e300, 1.7976931348623157e308, -1e308),
    *(math.nan, math.inf, -math.inf, 2**31, 2**63, 10**30, 10**99, True, False, None, "", "0", "any", ".nan", "1e5"),
    *(
        [],
        {},
        [[]],
        [1, 2],
        [math.nan],
        {"min": 0, "max": 1, "count": 10**9},
        {"min": -1e308, "max": 1e308, "count": 3},
    ),
    *("x" * 300, "../" * 50, "\0", "\x1b[2J", "\u202e", "\U0001f6a6", [0.5] * 1000, {"a": {"b": {"c": {}}}}),
)


def places(node: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Paths of all values of a tree, its root left out."""
    items = node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ()
    return [place for key, value in items for place in ((*path, key), *places(value, (*path, key)))]


def at(node: Any, path: tuple[Any, ...]) -> Any:
    for key in path:
        node = node[key]
    return node


def one_of(rng: np.random.Generator, values: Any) -> Any:
    return values[int(rng.integers(len(values)))]


def changed(rng: np.random.Generator, tree: dict[str, Any]) -> dict[str, Any]:
    """A study with one or two places deleted, doubled, renamed, replaced, nested or exchanged."""
    tree = deepcopy(tree)
    for _ in range(int(rng.integers(1, 3))):
        known = places(tree)
        if not known:
            break
        path = one_of(rng, known)
        parent, key = at(tree, path[:-1]), path[-1]
        value = parent[key]
        match int(rng.integers(14)):
            case number if number > 7:
                if isinstance(value, int | float) and not isinstance(value, bool):
                    parent[key] = type(value)(value * one_of(rng, [0.5, 0.9, 1.1, 2]))
            case 0:
                del parent[key]
            case 1 if isinstance(parent, list):
                parent.insert(0, deepcopy(value))
            case 1 | 2 if isinstance(parent, dict):
                name = one_of(rng, [f"{key}x", str(key)[:-1], "kind", "each", str(key).upper(), "x" * 200])
                parent[name] = deepcopy(value)
                if rng.integers(2):
                    parent.pop(key, None)
            case 3:
                parent[key] = one_of(rng, [[value], {"a": value}, [value] * 3, {"values": value}])
            case 4:
                parent[key] = deepcopy(at(tree, one_of(rng, known))) if rng.integers(2) else None
            case _:
                parent[key] = deepcopy(one_of(rng, EXTREMES))
    return tree


def written(tree: dict[str, Any]) -> bytes:
    text = StringIO()
    YAML(typ="safe", pure=True).dump(tree, text)
    return text.getvalue().encode("utf-8", "surrogatepass")
