"""Steps, care and guard of a run, for every engine: numbers in, decisions out (docs/steps.md).

``RunControl`` (run_control.py) chooses the next step, has a bad one repeated and ends the run;
``restarts.py`` starts a run anew that failed.
"""
