"""Errors, types, a cache, reading of files, lazy imports, code of users, and machine code."""
