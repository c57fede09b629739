"""Figures. Each function draws on the axes given, or on new ones, and returns the artists that carry data."""
