"""How the documentation is built: ``sphinx-build -W docs OUT``.

It is of the ringsim that is imported, as kernels of notebooks import it: what PYTHONPATH names, or
what is installed.
"""

import importlib.metadata
import os
import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

from made_pages import fill  # noqa: E402

project, author = "ringsim", "the ringsim developers"
project_copyright = "2026, the ringsim developers"
release = importlib.metadata.version("ringsim")

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "offline_math"]
exclude_patterns = ["_build", "README.md"]
html_theme = "furo"
html_math_renderer = "mathml"
html_title = f"ringsim {release.partition('+')[0]}"
html_copy_source = False
html_static_path = ["_static"]
html_css_files = ["pages.css"]
smartquotes = False  # quotes are part of what is written in files

myst_enable_extensions = ["amsmath", "dollarmath", "colon_fence"]
myst_heading_anchors = 3
nb_execution_mode = "cache"
nb_execution_cache_path = os.environ.get("RINGSIM_DOCS_CACHE", str(HERE / "_build" / "notebooks"))
nb_execution_timeout = 300
nb_execution_raise_on_error = True
nb_execution_in_temp = True
nb_output_stderr = "remove"  # progress

autodoc_member_order = "bysource"


def setup(app):
    """Fill the places of pages that are made from the code."""
    app.connect("source-read", fill)
