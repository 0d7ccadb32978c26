"""Commissioning: from a stage that nobody knows to settings that run it, step by step.

Everything here sees a rig as a controller does: efforts go in, an encoder's counts come out. A
virtual machine is no exception, so nothing can read what it has to find.
"""
