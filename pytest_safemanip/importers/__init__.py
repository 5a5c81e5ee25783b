"""Recordings made from other people's data: demonstrations, data sets, logs."""
