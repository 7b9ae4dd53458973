"""Closed forms and quadratures: truths that need no multibody engine; numpy only."""
