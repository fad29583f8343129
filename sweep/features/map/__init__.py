"""The best objective over two parameters of a search."""

MAP = "map.parquet"
FILES = {
    MAP: "where a search has a map, a row per pair of values: all parameters of the best design there, objective "
    "and sensitivity before clipping and quantization, `violation` and `feasible`; with `colorants.assumed` the "
    "concentration of a single absorption band in a film of 0.8 um, `mol_per_l` and `percent_by_weight`",
}
