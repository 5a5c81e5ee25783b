"""Looking for failures: what an episode may have otherwise, the search for what a policy does not
stand, reducing it to its cause, keeping it, and saying what was covered.

Nothing here runs a rollout: whoever has a simulator asks for trials and tells what came of them.
"""
