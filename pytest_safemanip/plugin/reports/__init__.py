"""What happens when a session ends: reports are written, and Ctrl-C ends it soon."""
