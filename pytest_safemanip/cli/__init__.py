"""The command ``safemanip``: one module per subcommand.

A subcommand's module is imported when the subcommand is chosen. It has ``EXAMPLE``, a command line
that works; ``add_arguments(parser)``; and ``run(options)``, which prints and returns the exit
status.
"""
