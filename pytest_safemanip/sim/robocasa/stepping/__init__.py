"""Steps a control period, as robosuite's loop bit for bit or within a tolerance, and reads it."""
