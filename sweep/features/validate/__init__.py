"""Readings of a camera on the bench, against the study that models it."""

PUBLIC = {"validate": "validate", "bench_template": "validate"}
