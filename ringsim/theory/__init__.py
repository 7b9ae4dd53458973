"""Closed forms and quadratures: references independent of the multibody engine."""
