"""Laboratory procedures: each collects recordings from a rig."""
