"""What is written when a session ends, for people and for CI servers."""
