#include <fmt/format.h>

#include "doppel/base/xml/xml.h"
#include "doppel/review/conversion/detail/drawing.h"
#include "doppel/review/conversion/drawing.h"

namespace doppel {
namespace {

// One class for each tone, filled or stroked; the plain attributes are for readers without style sheets.
struct Colours {
  const char* name;
  const char* light;
  const char* dark;
};
constexpr Colours kSvgTones[] = {{"paper", "#ffffff", "#16181d"},      {"ink", "#1f2328", "#e8eaed"},
                                 {"faint", "#5d6570", "#a3abb6"},      {"box", "#f3f5f8", "#242830"},
                                 {"edge", "#b8c0cc", "#505866"},       {"frame", "#ffffff", "#16181d"},
                                 {"fixed", "#6b7480", "#9aa3af"},      {"revolute", "#1f6fd0", "#6aa9ff"},
                                 {"continuous", "#7a4fc9", "#b392f0"}, {"prismatic", "#1a8a55", "#58c48d"},
                                 {"other", "#b3541e", "#f0a070"}};

const Colours& colours(Tone tone) {
  return kSvgTones[static_cast<int>(tone)];
}

void write_svg(const DrawnBox& box, std::string& out) {
  append(
      out,
      "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" rx=\"{:.1f}\" class=\"f-{} s-{}\" "
      "fill=\"{}\" stroke=\"{}\"/>\n",
      box.x, box.y, box.width, box.height, box.radius, colours(box.fill).name, colours(box.edge).name,
      colours(box.fill).light, colours(box.edge).light);
}

void write_svg(const DrawnCurve& curve, std::string& out) {
  const double mx = 0.5 * (curve.x1 + curve.x2), my = 0.5 * (curve.y1 + curve.y2);
  append(out, "<path d=\"M{:.1f} {:.1f}", curve.x1, curve.y1);
  if (curve.across) {
    append(out, "C{:.1f} {:.1f} {:.1f} {:.1f}", mx, curve.y1, mx, curve.y2);
  } else {
    append(out, "C{:.1f} {:.1f} {:.1f} {:.1f}", curve.x1, my, curve.x2, my);
  }
  append(out, " {:.1f} {:.1f}\" fill=\"none\" stroke-width=\"1.4\" class=\"s-{}\" stroke=\"{}\"{}/>\n",
         curve.x2, curve.y2, colours(curve.tone).name, colours(curve.tone).light,
         curve.dashed ? " stroke-dasharray=\"4 3\"" : "");
}

void write_svg(const DrawnText& text, std::string& out) {
  append(out, "<text x=\"{:.1f}\" y=\"{:.1f}\" font-size=\"{:g}\"{}{} class=\"f-{}\" fill=\"{}\">{}</text>\n",
         text.x, text.y, text.size, text.bold ? " font-weight=\"bold\"" : "",
         text.centred ? " text-anchor=\"middle\"" : "", colours(text.tone).name, colours(text.tone).light,
         escape_xml(text.text, false));
}

}  // namespace

std::string to_svg(const Drawing& drawing) {
  std::string out = fmt::format(
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" "
      "width=\"{0:.0f}pt\" height=\"{1:.0f}pt\" viewBox=\"0 0 {0:.0f} {1:.0f}\" "
      "font-family=\"Helvetica, Arial, 'Liberation Sans', 'Nimbus Sans', sans-serif\">\n<title>{2}</title>\n",
      drawing.width, drawing.height, escape_xml(drawing.title, false));
  out += "<style>@media (prefers-color-scheme: dark) {";
  for (const Colours& tone : kSvgTones)
    append(out, " .f-{0} {{ fill: {1} }} .s-{0} {{ stroke: {1} }}", tone.name, tone.dark);
  out += " }</style>\n";
  append(out, "<rect width=\"100%\" height=\"100%\" class=\"f-paper\" fill=\"{}\"/>\n",
         colours(Tone::paper).light);
  for (const auto& item : drawing.items) {
    std::visit([&out](const auto& thing) { write_svg(thing, out); }, item);
  }
  return out + "</svg>\n";
}

}  // namespace doppel
