"""The lateral force device: a point mass on a taut line behind a ship in a circle, after Ng, Rand and Keith (2001)."""
