"""Generated models of fixtures, a module for each kind."""
