"""Rows of a run, computed again at the reference settings."""

AUDIT = "audit.parquet"
ADDED = {
    AUDIT: "rows of `sweep audit`: errors against the reference settings, and those that are allowed",
}
PUBLIC = {"audit": "audit"}
