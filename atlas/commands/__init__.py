"""The commands of the shell, one module each: `add` declares its arguments, `_run` answers and returns an exit code."""
