"""What happens when a session ends: reports and videos are written, and Ctrl-C ends it soon."""
