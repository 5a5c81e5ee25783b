"""robosuite's own environments as a simulator."""
