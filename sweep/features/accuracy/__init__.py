"""What accuracy costs: error and time of each preset, and of steps of the wavelengths."""
