"""Figures: style and axes, files, exhibits with number and caption, progress bars."""
