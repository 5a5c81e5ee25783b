"""Properties and tasks as YAML, checked with file and line."""
