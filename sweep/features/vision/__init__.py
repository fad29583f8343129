"""Images of signal heads and streets, the ideal observer, and a reader that learns, which read them."""

VISION, VISION_CONDITIONS = "vision.parquet", "vision_conditions.parquet"
VISION_LEARNING = "vision_learning.parquet"
FILES = {
    VISION: "a row per image of the benchmark of vision: design_id, name, cfa, seed, order (of the lenses), "
    "lamps (seen in training or unseen), image, state, lamp, intensity_cd, background, phantom, distance_m, level, "
    "and of each reader (observer, prototypes) what it says, its probability (`_p`), and the error to expect "
    "of that answer, one less its probability by the observer (`_risk`)",
    VISION_CONDITIONS: "of each design at each distance and level of light: csd (DN), dprime and pair_error, the "
    "smallest or the largest over the pairs of lenses",
    VISION_LEARNING: "of readers that learn, by the number of `images` that they have learned from, distance and "
    "level of light, lenses in any order: `error`, `risk` (to expect by the ideal observer), `observer_risk`",
}
PUBLIC = {"export_images": "export_images", "images": "image_files", "score": "score_report", "scores": "score"}
