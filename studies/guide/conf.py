"""Configuration of the HTML documentation, `make docs`: guide and API reference, offline, with Sphinx's own theme."""

project = "sweep"
root_doc = "studies/guide/index"
extensions = ["sphinx.ext.autodoc", "sphinx.ext.autosummary", "numpydoc", "myst_parser"]
include_patterns = ["*.md", "outputs/README.md", "studies/*.md", "studies/guide/*", "sweep/**.md", "tests/*.md"]
exclude_patterns = ["studies/guide/conf.py"]
html_theme = "alabaster"
html_title = "sweep"
nitpicky = True
autodoc_typehints = "none"
autodoc_member_order = "bysource"
numpydoc_show_class_members = False
myst_heading_anchors = 4
