"""What searches find, and after how many rollouts."""
