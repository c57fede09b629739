"""What is computed of a cable: critical speeds, equilibria, shapes, folds."""
