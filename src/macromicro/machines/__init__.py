"""Machines as data and composition: parts with data sheets, one control period for any stage."""
