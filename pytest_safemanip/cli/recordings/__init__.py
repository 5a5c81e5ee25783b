"""The subcommands that make recordings of other data, or write them for viewers in 3D."""
