"""Columns of the result table: a module is a metric."""
