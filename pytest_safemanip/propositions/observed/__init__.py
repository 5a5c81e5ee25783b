"""Steps of which not everything was observed: what propositions read, and which values are known."""
