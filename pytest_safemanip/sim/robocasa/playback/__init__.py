"""Episodes of RoboCasa's datasets: their model as XML and their description, and back."""
