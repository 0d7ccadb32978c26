"""The micro-stage by its own model: heat content, relays and their inverse."""
