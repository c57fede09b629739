"""Building the files."""
