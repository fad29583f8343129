"""Effects of the image chain, each in its own module: its methods, when it can be skipped, and what that costs."""
