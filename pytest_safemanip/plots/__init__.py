"""Figures for notebooks and papers, drawn with matplotlib."""
