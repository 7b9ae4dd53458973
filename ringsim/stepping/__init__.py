"""Steps, care and guard of a run, for every engine: numbers in, decisions out.

The physics is told in docs/theory/steps.md.

``RunControl`` (control.py) chooses the next step, has a bad one repeated and ends the run;
``ending.py`` starts a run anew that failed.
"""
