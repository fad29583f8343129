"""Every column of the result table: a file is a metric."""
