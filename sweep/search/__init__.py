"""The best design, and the proof of how good any could be."""
