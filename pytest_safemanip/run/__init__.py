"""What one run of the suite is, without pytest: settings, cases, plan, session, results."""
