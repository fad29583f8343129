"""A noisy pixel's digital number: its mean and variance, as exact sums and from a table."""
