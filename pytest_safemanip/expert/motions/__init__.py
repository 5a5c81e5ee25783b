"""Acts that need no particular place."""
