"""NRL Report 7048, reproduced."""
