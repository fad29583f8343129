"""Light in, digital numbers out, with no more effects than needed."""
