"""How long things take, in which memory, and beside what else there is for them."""
