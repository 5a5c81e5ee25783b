"""RoboCasa365 as a backend."""
