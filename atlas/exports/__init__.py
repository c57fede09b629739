"""What hands a problem to other programs."""
