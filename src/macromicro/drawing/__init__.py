"""Figures: style and axes, exhibits with number and caption, block diagrams."""
