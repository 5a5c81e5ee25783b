"""Wall cabinets: their doors, their shelves, what stands there."""
