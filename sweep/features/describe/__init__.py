"""What a file of curves holds."""

PUBLIC = {"describe": "describe"}
