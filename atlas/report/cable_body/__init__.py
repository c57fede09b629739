"""A cable-body system towed in a circle in water, reproduced."""
