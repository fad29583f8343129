"""Rules of an objective: every class of a module here."""
