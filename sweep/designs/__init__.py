"""Filters: families, design spaces and batches of designs."""
