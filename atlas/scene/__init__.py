"""Towing scenes in real units, and what is asked about them."""
