"""The reproduction as a page, a table in the terminal and JSON."""
