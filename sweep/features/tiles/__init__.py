"""All tiles of some channels: which one, which of its pixels a filter modifies, and which filter."""

TILES = "tiles.parquet"
FILES = {
    TILES: "of a search over tiles, a row for each tile at each level of light (`cfa_sensitivity_min`; null: "
    "what the study itself needs): `space`, `cfa`, the curve that its modified pixel is made from (`base`), how many "
    "`kinds` of pixels, its `status` (`searched`; `excluded`: its `upper_bound` is no more than the best that "
    "was found; `too dark`; `impossible`: no filter meets the constraints), the best filter found in it, and of the "
    "`best` tile other separations of the same lamps, DN, as they are read out: "
    "cfa_sensitivity_min, space, cfa, base, kinds, status, best, upper_bound, objective, sensitivity, "
    "cfa_sensitivity, <parameters>, csd, pixel_csd, chromatic_csd, chromatic_pixel_csd",
}
