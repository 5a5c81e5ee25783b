"""Fridges: their compartments, shelves and racks."""
