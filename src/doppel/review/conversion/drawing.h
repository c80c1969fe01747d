#pragma once
// A list of boxes, lines and texts on a page, with writers for SVG and PDF that give the same layout. Units:
// points (1/72 inch), x to the right, y down. Text is measured by Helvetica's published widths, which are
// also those of Arial, Liberation Sans and Nimbus Sans.

#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "doppel/export.h"

namespace doppel {

enum class Tone {  // the meaning of a colour; SVG adapts to the light or dark scheme of the viewer
  paper,
  ink,
  faint,
  box,
  box_edge,
  frame,
  fixed,
  revolute,
  continuous,
  prismatic,
  other
};

struct DrawnBox {
  double x = 0, y = 0, width = 0, height = 0, radius = 0;
  Tone fill = Tone::box, edge = Tone::box_edge;
};
// From (x1, y1) to (x2, y2) by a cubic whose ends are parallel to x (`across`) or to y.
struct DrawnCurve {
  double x1 = 0, y1 = 0, x2 = 0, y2 = 0;
  bool across = false;
  bool dashed = false;
  Tone tone = Tone::fixed;
};
struct DrawnText {
  double x = 0, y = 0;  // of the middle of the baseline, or its left end
  std::string text;     // UTF-8
  double size = 9;
  bool bold = false, centred = true;
  Tone tone = Tone::ink;
};

struct Drawing {
  double width = 0, height = 0;
  std::string title;
  std::vector<std::variant<DrawnBox, DrawnCurve, DrawnText>> items;  // painted in this order
};

DOPPEL_API double text_width(std::string_view utf8, double size, bool bold);

DOPPEL_API std::string to_svg(const Drawing& drawing);
// PDF 1.4, one page; characters beyond Windows' Latin set become '?'.
DOPPEL_API std::string to_pdf(const Drawing& drawing);

}  // namespace doppel
