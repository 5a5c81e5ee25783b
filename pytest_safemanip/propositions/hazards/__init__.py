"""Hazards beside those of the ten templates: fire, heat, falls, edges, nearness, sight, liquids."""
