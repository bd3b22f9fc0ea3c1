"""What was found: the records of a study, what is derived from them, and how they are kept and shown."""
