"""Filters of finished runs as files."""

NEEDS = ("map",)
PUBLIC = {"export": "export"}
