"""Demonstrations and data sets in robosuite's and robomimic's HDF5."""
