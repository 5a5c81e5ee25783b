"""What simulators on MuJoCo share: what is what in a model, and how its steps are read."""
