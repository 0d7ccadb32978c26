"""Settings of Sphinx, whose source folder is the repository's root. Nothing on the site is fetched
from elsewhere."""

import macromicro

project = "macromicro"
author = copyright = "macromicro contributors"
version = release = macromicro.__version__
extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "website.extension",
]
suppress_warnings = ["ref.python"]  # classes of one name in several modules
root_doc = "docs/index"
include_patterns = ["*.md", "deploy/*.md", "docs/**.md", "docs/**.rst", "notebooks/*.ipynb"]
exclude_patterns = ["**.template.md"]
default_role = "py:obj"
highlight_language = "none"

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 4
nb_execution_mode = "off"
html_math_renderer = "mathml"

autodoc_typehints = "none"
autodoc_member_order = "bysource"
napoleon_google_docstring = False
napoleon_use_rtype = False
add_module_names = False
toc_object_entries = False  # each page would carry all of them in its navigation
python_use_unqualified_type_names = True

html_theme = "furo"
html_title = f"macromicro {release}"
html_static_path = ["static"]
html_css_files = ["macromicro.css"]
html_extra_path = ["extra", "../../build/twin.html"]
html_copy_source = False
html_show_sourcelink = False
html_show_search_summary = False
html_theme_options = {"navigation_with_keys": True}
pygments_style = "default"
pygments_dark_style = "monokai"
