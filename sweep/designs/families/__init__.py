"""Families of filters that a study can name: every class of a module here with a `kind`."""
