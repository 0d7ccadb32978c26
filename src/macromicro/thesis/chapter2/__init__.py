"""Chapter 2: positioning technologies, the alloy, hysteresis."""
