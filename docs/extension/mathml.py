"""Equations as MathML, which browsers show by themselves: no script, no font and no network are needed."""

from typing import Any

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx
from sphinx.util.math import get_node_equation_number


def add_mathml(app: Sphinx) -> None:
    """Offers `mathml` for `html_math_renderer`."""
    app.add_html_math_renderer("mathml", (_inline, None), (_display, None))


def _inline(translator: Any, node: nodes.math) -> None:
    translator.body.append(convert(node.astext(), display="inline"))
    raise nodes.SkipNode


def _display(translator: Any, node: nodes.math_block) -> None:
    number, link = "", ""
    if node["number"]:
        number = f'<span class="eqno">({get_node_equation_number(translator, node)})'
        translator.body.append(translator.starttag(node, "div", CLASS="math numbered"))
        translator.add_permalink_ref(node, "Link to this equation")
        link = translator.body.pop()
        number += f"{link}</span>"
    else:
        translator.body.append(translator.starttag(node, "div", CLASS="math"))
    equation = convert(node.astext(), display="block")
    translator.body.append(f'<div class="equation">{equation}</div>{number}</div>\n')
    raise nodes.SkipNode
