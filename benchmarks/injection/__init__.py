"""Code that is changed and processes that are killed on purpose: who notices, what is lost."""
