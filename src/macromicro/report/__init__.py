"""What a run showed, for people and for programs: figures, tables, the HTML page."""
