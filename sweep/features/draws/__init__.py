"""Random lamps and cameras: how far tolerances may grow, what a share of others has, quantiles of sensors."""

ROBUSTNESS = "robustness.parquet"
UNCERTAINTY = "uncertainty.parquet"
YIELDS = "yields.parquet"
FILES = {
    ROBUSTNESS: "where the lights have a population, for each plain CFA, named design and answer of the search: "
    "`design_id`; how many times as large population and production tolerances must be for the worst CSD to fall below "
    "that of the best plain CFA (`breaks_at`; null: not up to 3 times), and the CSD, lights, shifts and temperatures "
    "there; "
    "`yield`, the share of random lamps and cameras with the wanted CSD, with its 95 % interval",
    UNCERTAINTY: "where a study has `uncertainty`, for each plain CFA, named design and answer of the search and "
    "each CSD (`quantity`), before clipping and rounding: `dn_5`, `dn_50`, `dn_95`, the CSD that so many percent of "
    "random sensors fall below, with 95 % intervals (`_low`, `_high`); `ratio_...`, `light_ratio_...`, CSD and light "
    "relative to the `reference` on the same sensor; `ratio_sd`, `light_ratio_sd` and their `correlation`; "
    "`at_least_dn`, below which no sensor is (without `shift_nm` and `ir_cut_nm`)",
    YIELDS: "where `population.wanted_yield` or `uncertainty.wanted_yield` is stated, for each plain CFA, named "
    "design and answer of the search: `dn`, the CSD that the `share` of other random lamps and cameras has, which no "
    "search has looked at (`draws` of them, before clipping and rounding), with a 95 % interval of that of all "
    "(`dn_low`, `dn_high`)",
}
