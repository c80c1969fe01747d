// Source: PDF Reference, sixth edition, version 1.7: file structure (3.4), path construction (4.4), text
// (5.3), the standard 14 fonts (5.5.1). Everything used here is in PDF 1.4.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <vector>

#include "doppel/review/conversion/detail/drawing.h"
#include "doppel/review/conversion/drawing.h"

namespace doppel {
namespace {

// A page is at most 200 inches on a side (appendix C); a larger drawing is scaled down to that.
constexpr double kMaxPageSize = 14400;
constexpr double kRound = 0.5523;  // control points of a quarter circle

constexpr std::array<const char*, 11> kPdfTones = {
    "1 1 1",          "0.12 0.14 0.16", "0.36 0.40 0.44", "0.95 0.96 0.97", "0.72 0.75 0.80", "1 1 1",
    "0.42 0.45 0.50", "0.12 0.44 0.82", "0.48 0.31 0.79", "0.10 0.54 0.33", "0.70 0.33 0.12"};

const char* colour(Tone tone) {
  return kPdfTones[static_cast<std::size_t>(tone)];
}

// The page's matrix inverts y, so coordinates are written unchanged.
void write_pdf(const DrawnBox& box, std::string& out) {
  const double x1 = box.x, y1 = box.y, x2 = box.x + box.width, y2 = box.y + box.height, r = box.radius;
  const double c = r * (1 - kRound);
  append(out, "{} rg {} RG 1 w\n{:.2f} {:.2f} m\n", colour(box.fill), colour(box.edge), x1 + r, y1);
  const auto side = [&out](double lx, double ly, double ax, double ay, double bx, double by, double x,
                           double y) {
    append(out, "{:.2f} {:.2f} l {:.2f} {:.2f} {:.2f} {:.2f} {:.2f} {:.2f} c\n", lx, ly, ax, ay, bx, by, x,
           y);
  };
  side(x2 - r, y1, x2 - c, y1, x2, y1 + c, x2, y1 + r);
  side(x2, y2 - r, x2, y2 - c, x2 - c, y2, x2 - r, y2);
  side(x1 + r, y2, x1 + c, y2, x1, y2 - c, x1, y2 - r);
  side(x1, y1 + r, x1, y1 + c, x1 + c, y1, x1 + r, y1);
  out += "b\n";
}

void write_pdf(const DrawnCurve& curve, std::string& out) {
  const double mx = 0.5 * (curve.x1 + curve.x2), my = 0.5 * (curve.y1 + curve.y2);
  append(out, "{} RG 1.4 w {} {:.2f} {:.2f} m ", colour(curve.tone), curve.dashed ? "[4 3] 0 d" : "[] 0 d",
         curve.x1, curve.y1);
  if (curve.across) {
    append(out, "{:.2f} {:.2f} {:.2f} {:.2f}", mx, curve.y1, mx, curve.y2);
  } else {
    append(out, "{:.2f} {:.2f} {:.2f} {:.2f}", curve.x1, my, curve.x2, my);
  }
  append(out, " {:.2f} {:.2f} c S [] 0 d\n", curve.x2, curve.y2);
}

void write_pdf(const DrawnText& text, std::string& out) {
  const double left = text.x - (text.centred ? 0.5 * text_width(text.text, text.size, text.bold) : 0.0);
  append(out, "BT {} rg /{} {:g} Tf 1 0 0 -1 {:.2f} {:.2f} Tm (", colour(text.tone), text.bold ? "B" : "R",
         text.size, left, text.y);
  for (const char32_t c : code_points(text.text)) {
    const std::uint8_t byte = win_ansi(c);
    if (byte == '(' || byte == ')' || byte == '\\') out += '\\';
    if (byte < 0x80) {
      out += static_cast<char>(byte);
    } else {
      append(out, "\\{:03o}", byte);
    }
  }
  out += ") Tj ET\n";
}

std::string literal(std::string_view utf8) {
  std::string out = "(";
  for (const char32_t c : code_points(utf8)) {
    const std::uint8_t byte = win_ansi(c);
    if (byte == '(' || byte == ')' || byte == '\\') out += '\\';
    out += static_cast<char>(byte < 0x80 ? byte : '?');
  }
  return out + ")";
}

}  // namespace

std::string to_pdf(const Drawing& drawing) {
  const double scale = std::min(1.0, kMaxPageSize / std::max(drawing.width, drawing.height));
  const double width = scale * drawing.width, height = scale * drawing.height;
  std::string content = fmt::format("{0:.6f} 0 0 -{0:.6f} 0 {1:.2f} cm 1 J 1 j\n", scale, height);
  for (const auto& item : drawing.items) {
    std::visit([&content](const auto& thing) { write_pdf(thing, content); }, item);
  }
  const std::vector<std::string> objects = {
      "<< /Type /Catalog /Pages 2 0 R >>",
      "<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
      fmt::format("<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {:.2f} {:.2f}] /Contents 4 0 R /Resources << "
                  "/Font << /R 5 0 R /B 6 0 R >> >> >>",
                  width, height),
      fmt::format("<< /Length {} >>\nstream\n{}endstream", content.size(), content),
      "<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica /Encoding /WinAnsiEncoding >>",
      "<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica-Bold /Encoding /WinAnsiEncoding >>",
      fmt::format("<< /Title {} /Producer (doppel) >>", literal(drawing.title))};
  std::string out = "%PDF-1.4\n%\xE2\xE3\xCF\xD3\n";
  std::string table = fmt::format("xref\n0 {}\n0000000000 65535 f \n", objects.size() + 1);
  for (std::size_t i = 0; i < objects.size(); ++i) {
    append(table, "{:010} 00000 n \n", out.size());
    append(out, "{} 0 obj\n{}\nendobj\n", i + 1, objects[i]);
  }
  const std::size_t start = out.size();
  append(table, "trailer\n<< /Size {} /Root 1 0 R /Info 7 0 R >>\nstartxref\n{}\n%%EOF\n", objects.size() + 1,
         start);
  return out + table;
}

}  // namespace doppel
