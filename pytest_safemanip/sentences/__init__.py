"""Rules from sentences: a small English grammar, patterns and known propositions; no model."""
