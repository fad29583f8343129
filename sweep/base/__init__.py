"""What every room needs: faults, types, a cache, files that may be anything, code of others."""
