"""The documentation as a site: `sphinx-build -W docs site`. Pages are Markdown; `site_build` generates the rest."""

import sys
from importlib.metadata import version as version_of
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

project = "kinetostat"
author = "the kinetostat authors"
version = release = version_of("kinetostat")
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "site_build"]
exclude_patterns = ["generated", "measured", "site_build"]

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
default_role = "code"
highlight_language = "none"
html_math_renderer = "mathml"

autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
python_use_unqualified_type_names = True

html_theme = "furo"
html_title = f"kinetostat {version}"
html_static_path = ["site_build/static"]
html_css_files = ["style.css"]
html_copy_source = False
html_show_copyright = False
html_show_sourcelink = False
pygments_style = "friendly"
pygments_dark_style = "github-dark"
