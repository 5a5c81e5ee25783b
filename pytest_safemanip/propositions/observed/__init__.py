"""What propositions read, and which of their values are known where not all was observed."""
