"""Which effects a scene calls for, and the proof of what the others change."""
