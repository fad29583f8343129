"""Lamps that norms allow, and reds that move: which of them a design separates less than RGGB."""

REGIONS_MAP = "regions.parquet"
LAMP_LIMITS = "lamp_limits.parquet"
FILES = {
    REGIONS_MAP: "where a study asks for maps of color regions, for each plain CFA, named design and answer of "
    "the search: design_id, norm, peak of the yellow LED (yellow_nm) and of the red one (red_nm), how many pairs of "
    "widths the norm allows (pairs), how many of these have the wanted distance (separated), how many RGGB keeps "
    "farther apart, also at any brightness (below_rggb, chromatic_below_rggb; empty without RGGB), the smallest "
    "distance (least_dn) and the widths there (yellow_fwhm_nm, red_fwhm_nm)",
    LAMP_LIMITS: "where lamps fill the field of one scene beside RGGB, for each named design and answer of the "
    "search, by the shape of a red LED (those of tl16's lamps, modeled, and a Gaussian of 18 nm) and quantity: the "
    "peak from which on a deeper red is nearer to the study's yellows than with RGGB (`red_limit_nm`), its color there "
    "(`red_limit_x`, `red_limit_y`) and distance (`red_limit_dn`), the same of reds toward the yellow "
    "(`yellow_limit_nm`), and from which peak on the distance is below the one that the study wants "
    "(`wanted_limit_nm`); 630 where that holds at the first red, empty where it does not up to 60 nm from there, "
    "or 20 nm from an end of the wavelengths; and its distance over RGGB's (`deepest_ratio`) at the deepest peak of "
    "the study's reds (`deepest_nm`)",
}
