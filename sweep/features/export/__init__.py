"""Filters of finished runs as files."""
