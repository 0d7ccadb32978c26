"""Reports of runs for people and programs: figures, tables, the HTML page."""
