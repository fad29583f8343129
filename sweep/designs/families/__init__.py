"""Families of filters that a study can name: every class of a file here that has a `kind`."""
