"""Images of traffic lights as a camera takes them, the ideal observer that reads them, and a reader that learns to."""
