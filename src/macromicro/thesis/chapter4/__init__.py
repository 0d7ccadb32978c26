"""Chapter 4: identification and control of the macro-stage."""
