"""The virtual bench: what is physically there. It knows no model and no controller."""
