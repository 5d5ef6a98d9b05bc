"""How the site is built from these pages: `make docs`."""

import sys
from importlib.metadata import version as version_of
from importlib.resources import files
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE.parent), str(HERE)]  # the packages that are documented, and the extension beside

project = "dcpf"
version = release = version_of("dcpf")
html_title = "dcpf"

extensions = ["myst_parser", "extension"]
exclude_patterns = ["extension"]
myst_enable_extensions = ["amsmath", "colon_fence", "deflist", "dollarmath", "fieldlist"]
myst_heading_anchors = 3
nitpicky = True  # a reference that leads nowhere is a warning, and warnings are errors

html_theme = "furo"
html_math_renderer = "mathml"
html_static_path = ["static", str(files("ziamath") / "fonts" / "STIXTwoMath-Regular.ttf")]
html_css_files = ["style.css"]
html_copy_source = False
html_show_copyright = False
