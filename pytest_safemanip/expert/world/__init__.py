"""What is around the robot, and where there is room in it."""
