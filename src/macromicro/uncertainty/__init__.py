"""What is not known exactly about a machine: one table, and the machines drawn from it."""
