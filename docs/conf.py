"""How the pages in this folder become a site: ``make docs``."""

from __future__ import annotations

project = "drivetrain"
html_title = "drivetrain"
html_show_copyright = False
extensions = [
    "myst_parser", "sphinx.ext.autodoc", "sphinx.ext.autosummary", "sphinx.ext.napoleon", "sphinx.ext.mathjax",
    "sphinx.ext.viewcode",
]  # fmt: skip
templates_path = ["_templates"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
exclude_patterns = ["_build"]
html_theme = "furo"
html_static_path = ["_static"]
html_css_files = ["wide.css"]
autodoc_member_order = "groupwise"
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"  # a dataclass tells its fields once
autodoc_type_aliases = {"Array": "Array", "ArrayLike": "ArrayLike"}
napoleon_attr_annotations = False
napoleon_use_ivar = True
