"""Machines composed of parts with data sheets."""
