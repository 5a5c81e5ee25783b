"""The kinds of dimensions that a space is made of: what each changes, and in what unit."""
