"""Chapter 5: models and control of the micro-stage."""
