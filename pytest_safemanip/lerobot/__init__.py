"""Datasets of LeRobot's as RoboCasa365 has them: what their arrays mean, how they are written."""
