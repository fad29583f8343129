"""What a file of curves holds."""
