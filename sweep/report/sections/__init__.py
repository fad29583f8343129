"""Sections of a report's page, in the order of the page."""
