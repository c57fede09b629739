"""Ng, Rand and Keith (2001) on the lateral force device, reproduced."""
