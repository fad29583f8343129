"""A folder on disk: written atomically, read back as one object."""
