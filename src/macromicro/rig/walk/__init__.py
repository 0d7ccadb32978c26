"""First power-up of a rig, step by step with the person beside it."""
