"""What a readout is worth, and when it is allowed."""
