"""For your own experiments on the two-stage bench: drive one stage, replay sensors, learn."""
