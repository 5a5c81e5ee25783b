"""What the user writes down: properties and tasks as YAML, checked with file and line."""
