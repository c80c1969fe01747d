#pragma once
// The tree of links and joints as text, Graphviz, SVG and PDF.
