"""Lets the tests of this folder import their common cases, whatever the import mode."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "cable_engine" / "own_laws"))
