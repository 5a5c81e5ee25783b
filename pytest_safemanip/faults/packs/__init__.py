"""Ways to violate the rules of packs: one of them breaks several, of several packs."""
