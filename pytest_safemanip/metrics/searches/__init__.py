"""What searches found, as summaries tell it, and what gates make of it."""
