"""Reads arrays that others have written, as data: nothing in them is ever run."""
