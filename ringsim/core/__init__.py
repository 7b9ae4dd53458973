"""The core in C, and what both engines compute in it: the tension chain of the cables."""
