#include "doppel/review/conversion/drawing.h"

#include <array>

#include "doppel/review/conversion/detail/drawing.h"

namespace doppel {
namespace {

// Widths in thousandths of the size, of the characters 32 to 126: Adobe's Core 14 AFM files.
constexpr std::array<short, 95> kHelvetica = {
    278, 278, 355, 556, 556, 889, 667, 191, 333, 333, 389, 584, 278, 333,  278, 278, 556, 556, 556,
    556, 556, 556, 556, 556, 556, 556, 278, 278, 584, 584, 584, 556, 1015, 667, 667, 722, 722, 667,
    611, 778, 722, 278, 500, 667, 556, 833, 722, 778, 667, 778, 722, 667,  611, 722, 667, 944, 667,
    667, 611, 278, 278, 278, 469, 556, 333, 556, 556, 500, 556, 556, 278,  556, 556, 222, 222, 500,
    222, 833, 556, 556, 556, 556, 333, 500, 278, 556, 500, 722, 500, 500,  500, 334, 260, 334, 584};
constexpr std::array<short, 95> kHelveticaBold = {
    278, 333, 474, 556, 556, 889, 722, 238, 333, 333, 389, 584, 278, 333, 278, 278, 556, 556, 556,
    556, 556, 556, 556, 556, 556, 556, 333, 333, 584, 584, 584, 611, 975, 722, 722, 722, 722, 667,
    611, 778, 722, 278, 556, 722, 611, 833, 722, 778, 667, 778, 722, 667, 611, 722, 667, 944, 667,
    667, 611, 333, 278, 333, 584, 556, 333, 556, 611, 556, 611, 556, 333, 611, 611, 278, 278, 556,
    278, 889, 611, 611, 611, 611, 389, 556, 333, 611, 556, 778, 556, 556, 500, 389, 280, 389, 584};

double character_width(char32_t c, bool bold) {
  if (c >= 32 && c <= 126) return (bold ? kHelveticaBold : kHelvetica)[c - 32];
  switch (c) {
    case 0xB0:  // degree
      return 400;
    case 0xB7:  // middle dot
      return 278;
    case 0x2026:  // ellipsis
      return 1000;
    case 0xB2:  // superscript two
      return 333;
    default:
      return c < 0x2E80 ? 584 : 1000;  // East Asian characters are square
  }
}

}  // namespace

double text_width(std::string_view utf8, double size, bool bold) {
  double width = 0;
  for (const char32_t c : code_points(utf8)) width += character_width(c, bold);
  return width * size / 1000;
}

std::vector<char32_t> code_points(std::string_view utf8) {
  std::vector<char32_t> out;
  for (std::size_t i = 0; i < utf8.size();) {
    const auto lead = static_cast<unsigned char>(utf8[i++]);
    const int more = lead < 0x80                   ? 0
                     : lead >= 0xC2 && lead < 0xE0 ? 1
                     : lead >= 0xE0 && lead < 0xF0 ? 2
                     : lead >= 0xF0 && lead < 0xF5 ? 3
                                                   : -1;
    if (more < 0) {
      out.push_back(0xFFFD);
      continue;
    }
    char32_t c = more == 0 ? lead : lead & (0x3F >> more);
    int got = 0;
    for (; got < more && i < utf8.size() && (static_cast<unsigned char>(utf8[i]) & 0xC0) == 0x80; ++got)
      c = (c << 6) | (static_cast<unsigned char>(utf8[i++]) & 0x3F);
    out.push_back(got == more ? c : 0xFFFD);
  }
  return out;
}

std::uint8_t win_ansi(char32_t c) {
  if ((c >= 32 && c <= 126) || (c >= 0xA0 && c <= 0xFF)) return static_cast<std::uint8_t>(c);
  switch (c) {
    case 0x2026:
      return 0x85;
    case 0x2022:
      return 0x95;
    case 0x2013:
      return 0x96;
    case 0x2014:
      return 0x97;
    case 0x20AC:
      return 0x80;
    default:
      return '?';
  }
}

}  // namespace doppel
