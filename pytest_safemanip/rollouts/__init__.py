"""Rollouts: the loop, retries, and the store of recordings by key."""
