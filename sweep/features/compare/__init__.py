"""Finished runs beside each other."""

PUBLIC = {"compare": "compare"}
