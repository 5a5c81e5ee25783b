"""Whether verdicts are right: against planned faults, MuJoCo itself, and what comes after."""
