"""Pictures of a scene: for policies with cameras, and for people."""
