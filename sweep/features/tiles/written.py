"""Tiles of a study: `cfas: {tiles: 2x2, of: [R, G, B]}` becomes one CFA for each, and a box for each filter in them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations_with_replacement, product
from typing import Any

from ...base.errors import Fault, SweepError
from ...camera.mosaic import Mosaic

TILES = "tiles"
MODIFIED = "N"
"""Name of the modified channel."""
_OF, _COUNT, _ALL = "of", "modified", "2x2"
_MOST = 8
"""Channels of all 2x2 tiles; 8 make 120 combinations of three others, each with 8 bases."""
_SMALL = 4
"""Pixels of a tile that is named after them."""
_ALLOWED = "{tiles: 2x2, of: [R, G, B, Y, Cy], modified: 1}, or {tiles: [RGGB, RYYCy]}"


def written(value: Any) -> Any:
    """Return the keys of a study with its tiles written out: each a CFA, and a box of each filter in each."""
    cfas = value.get("cfas") if isinstance(value, dict) else None
    if not isinstance(cfas, dict):
        return value
    if not isinstance(cfas.get(TILES), str | list):
        if isinstance(cfas.get(_OF), list) or isinstance(cfas.get(_COUNT), int):
            raise Fault(("cfas", TILES), "missing", None, _ALLOWED)
        return value
    modified = cfas.get(_COUNT, 0)
    if modified not in (0, 1) or isinstance(modified, bool):
        raise Fault(("cfas", _COUNT), "pixels of each tile that a filter modifies", modified, "0 or 1")
    tiles, named = _tiles_of(value, cfas, modified=bool(modified)), dict(cfas)
    for key in (TILES, _OF, _COUNT):
        named.pop(key, None)
    boxes = _boxes_of(value.get("boxes", {}), tiles, modified)
    if clash := [cfa for cfa, *_ in tiles if modified and cfa in named]:
        raise Fault(("cfas", clash[0]), "one of the tiles has this name", None, "another name")
    made = {cfa: {"tile": rows} for cfa, rows, _ in tiles if cfa not in named}
    return value | {"cfas": named | made} | ({"boxes": boxes} if boxes else {})


def _boxes_of(boxes: Any, tiles: Sequence[tuple[str, Any, str]], modified: int) -> dict[str, Any]:
    """Return the boxes of a study, with those of all tiles written out."""
    written: dict[str, Any] = {}
    for name, box in boxes.items() if isinstance(boxes, dict) else ():
        if not isinstance(box, dict) or box.get("cfa") != TILES:
            written[name] = box
            continue
        if not modified:
            raise Fault(("boxes", name, "cfa"), "of tiles with a modified pixel", TILES, "`modified: 1` in `cfas`")
        for key in ("channel", "base", "below", "group"):
            if key in box:
                raise Fault(("boxes", name, key), "each pixel of each tile in turn", box[key], f"no `{key}`")
        for cfa, _, base in tiles:
            keys = {"cfa": cfa, "channel": MODIFIED, "base": base, "below": True, "group": str(name)}
            written[f"{name} {cfa}({base})"] = box | keys
    if modified and not any(isinstance(box, dict) and box.get("group") for box in written.values()):
        example = "`boxes: {stopband: {cfa: tiles, family: stopband, to: 0.1}}`"
        raise Fault(("cfas", _COUNT), "no box says which filter modifies the pixel", modified, example)
    return written


def _tiles_of(value: Mapping[str, Any], cfas: Mapping[str, Any], *, modified: bool) -> list[tuple[str, Any, str]]:
    """Return the name and the rows of each tile, and the channel whose pixel is modified; empty for none."""
    stated = cfas[TILES]
    if isinstance(stated, list):
        if _OF in cfas:
            raise Fault(("cfas", _OF), "goes with `tiles: 2x2`; a list names its tiles", None, f"no `{_OF}`")
        if len({str(name) for name in stated}) < len(stated) or not stated:
            raise Fault(("cfas", TILES), "a list of different tiles", stated, _ALLOWED)
        return [tile for name in stated for tile in _of_pattern(name, modified=modified)]
    channels = cfas.get(_OF)
    known = isinstance(channels, list) and all(isinstance(name, str) for name in channels)
    if stated != _ALL:
        raise Fault(("cfas", TILES), "no such tiles", stated, _ALLOWED)
    if channels is None or not known or not 1 <= len(set(channels)) == len(channels) <= _MOST:
        raise Fault(("cfas", _OF), "no list of channels", channels, f"1 to {_MOST} different names of curves")
    if modified and MODIFIED in channels:
        raise Fault(("cfas", _OF), "the name of the modified channel", MODIFIED, "other names of curves")
    placed = _counts_places(value)
    if not modified:
        tiles = distinct_tiles(channels) if placed else list(combinations_with_replacement(channels, 4))
        return [("".join(tile), [list(tile[:2]), list(tile[2:])], "") for tile in tiles]
    others = list(product(channels, repeat=3)) if placed else list(combinations_with_replacement(channels, 3))
    rows = {"".join(three) + MODIFIED: [list(three[:2]), [three[2], MODIFIED]] for three in others}
    return [(name, tile, base) for name, tile in rows.items() for base in channels]


def _of_pattern(name: Any, *, modified: bool) -> Iterator[tuple[str, Any, str]]:
    """Yield a pattern by its name, or each of its channels with its first pixel modified."""
    try:
        mosaic = Mosaic.from_name(str(name))
    except SweepError as error:
        raise Fault(("cfas", TILES), error.issues[0].problem, name, error.issues[0].allowed) from None
    rows = mosaic.rows
    if not modified:
        yield str(name), rows, ""
    for channel in mosaic.channels if modified else ():
        flat = [pixel for row in rows for pixel in row]
        flat[flat.index(channel)] = MODIFIED
        width = len(rows[0])
        tile = [flat[at : at + width] for at in range(0, len(flat), width)]
        yield "".join(flat) if len(flat) == _SMALL else f"{name} with {channel} modified", tile, channel


def distinct_tiles(channels: Sequence[str]) -> list[tuple[str, ...]]:
    """Return the 2x2 tiles, row by row, that are no shifts of each other."""
    kept: dict[tuple[int, ...], None] = {}
    for a, b, c, d in product(range(len(channels)), repeat=4):
        shifts = [(a, b, c, d), (b, a, d, c), (c, d, a, b), (d, c, b, a)]
        kept.setdefault(min(shifts))
    return [tuple(channels[index] for index in tile) for tile in kept]


def _counts_places(value: Mapping[str, Any]) -> bool:
    """Return whether the places of pixels in a tile count: for lamps of some pixels, and where light comes through."""

    def states(part: Any, key: str) -> bool:
        if not isinstance(part, dict):
            return False
        return any(key in str(name).split(".") or states(inner, key) for name, inner in part.items())

    scenarios, pixels = value.get("scenarios"), [value.get("pixel"), value.get("scenarios"), value.get("pixels")]
    return states(scenarios, "target") or any(states(pixel, "crosstalk") for pixel in pixels)
