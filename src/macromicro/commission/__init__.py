"""Commissioning: identify an unknown stage from its own sensor and write the settings that run it.

The code sees a rig as a controller does, simulated ones included: efforts in, counts out.
"""
