"""Published figures beside those of a run."""

PUBLISHED_CSV, PUBLISHED_PARQUET = "paper_comparison.csv", "paper_comparison.parquet"
DRAWN = {
    PUBLISHED_CSV: "published figures beside ours, where a study gives some; also `.parquet`",
    PUBLISHED_PARQUET: "",
}
