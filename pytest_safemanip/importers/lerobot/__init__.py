"""Datasets of LeRobot's: RoboCasa's with states, and logs without."""
