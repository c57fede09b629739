"""DTMB Report 713 (Pode 1950), reproduced."""
