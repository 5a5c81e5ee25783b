"""The subcommands that write a recording for viewers in 3D."""
