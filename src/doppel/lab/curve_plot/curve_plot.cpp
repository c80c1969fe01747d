#include "doppel/lab/curve_plot/curve_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

namespace doppel {
namespace {

constexpr double kWidth = 760, kLeft = 76, kRight = 20, kTop = 76, kPanel = 130, kPitch = 178, kLegend = 26;
constexpr double kInner = kWidth - kLeft - kRight;
// A limit further away than this many spans of the curves is not drawn: they would be a flat line.
constexpr double kMaxLimitSpans = 6;
constexpr std::size_t kMaxUnitLength = 3;       // characters that fit beside the numbers of an axis
constexpr double kHatch = 5, kHatchPitch = 11;  // of an edge, on the side where a value is not permitted
constexpr const char* kBandColor = "#3a7d44";
constexpr std::array<const char*, 4> kColors = {"#1f5f8b", "#d1495b", "#3a7d44", "#6b4c9a"};
constexpr std::array<const char*, 4> kDashes = {"", " stroke-dasharray='6 3'", " stroke-dasharray='2 3'",
                                                " stroke-dasharray='8 3 2 3'"};

struct Range {
  double low = std::numeric_limits<double>::infinity(), high = -std::numeric_limits<double>::infinity();

  void add(double value) {
    if (!std::isfinite(value)) return;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  // With some room, also where all values are equal or there are none.
  void widen(double share) {
    if (!(low <= high)) low = high = 0;
    const double span = std::max({high - low, 1e-3 * std::max(std::abs(low), std::abs(high)), 1e-9});
    low -= share * span;
    high += share * span;
  }
  [[nodiscard]] double share_of(double value) const { return (value - low) / (high - low); }
};

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '<') {
      out += "&lt;";
    } else if (c == '&') {
      out += "&amp;";
    } else {
      out += c;
    }
  }
  return out;
}

// 1, 2 or 5 times a power of ten, so that there are about `count` of them.
double tick_step(const Range& range, int count) {
  const double raw = (range.high - range.low) / count, power = std::pow(10, std::floor(std::log10(raw)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (raw <= factor * power) return factor * power;
  }
  return 10 * power;
}

std::vector<double> ticks(const Range& range, double step) {
  std::vector<double> out;
  for (auto i = static_cast<std::int64_t>(std::ceil(range.low / step));
       static_cast<double>(i) * step <= range.high; ++i)
    out.push_back(static_cast<double>(i) * step);
  return out;
}

class Drawing {
 public:
  Drawing(const std::string& title, const std::string& subtitle, std::size_t panels) {
    const double height = kTop + kPitch * static_cast<double>(panels) + 10;
    out_ = fmt::format(
        "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {0:g} {1:g}' width='{0:g}' height='{1:g}' "
        "font-family='system-ui, sans-serif'>\n<rect width='100%' height='100%' fill='#fff'/>\n",
        kWidth, height);
    text(kLeft, 30, title, "start", 17, "#111");
    text(kLeft, 50, subtitle, "start", 12, "#555");
  }

  void panel(const PlotPanel& panel, const Range& time, double top) {
    text(kLeft, top - 8, panel.title, "start", 13, "#111");
    if (!panel.remark.empty()) text(kWidth - kRight, top - 8, panel.remark, "end", 12, "#555");
    Range values;
    for (const PlotCurve& curve : panel.curves) {
      for (const double value : curve.values) values.add(value);
    }
    add_limits(panel.bands, values);
    values.widen(panel.bands.empty() ? 0.06 : 0.16);  // with room for labels
    for (const PlotBand& band : panel.bands) shade(band, time, values, top);
    axes(time, values, panel, top);
    for (std::size_t i = 0; i < panel.curves.size(); ++i) curve(panel.curves[i], time, values, top, i);
    std::vector<double> label_heights;
    for (const PlotBand& band : panel.bands) label(band, time, values, top, label_heights);
  }

  void legend(const std::vector<PlotCurve>& curves) {
    double x = kLeft;
    for (std::size_t i = 0; i < curves.size(); ++i) {
      out_ += fmt::format("<path d='M{:g} {:g}h24' stroke='{}' stroke-width='2'{}/>\n", x,
                          kTop - kLegend + 14, kColors[i % kColors.size()], kDashes[i % kDashes.size()]);
      text(x + 30, kTop - kLegend + 18, curves[i].label, "start", 12, "#333");
      x += 48 + 7.0 * static_cast<double>(curves[i].label.size());
    }
  }

  [[nodiscard]] std::string finished() const { return out_ + "</svg>\n"; }

 private:
  void text(double x, double y, const std::string& words, const char* anchor, int size, const char* color) {
    out_ += fmt::format("<text x='{:g}' y='{:g}' text-anchor='{}' font-size='{}' fill='{}'>{}</text>\n", x, y,
                        anchor, size, color, escaped(words));
  }

  static void add_limits(const std::vector<PlotBand>& bands, Range& values) {
    const Range curves = values;
    const double room = kMaxLimitSpans * (curves.high - curves.low);
    for (const PlotBand& band : bands) {
      for (const double limit : {band.low, band.high}) {
        if (!(curves.low <= curves.high) || (limit > curves.low - room && limit < curves.high + room))
          values.add(limit);
      }
    }
  }

  struct BandBox {
    double left = 0, right = 0, upper = 0, lower = 0;
  };
  // The part of the band inside the panel.
  static BandBox box_of(const PlotBand& band, const Range& time, const Range& values, double top) {
    const auto share = [](double value) { return std::clamp(value, 0.0, 1.0); };
    return {kLeft + kInner * share(time.share_of(band.begin)),
            kLeft + kInner * share(time.share_of(band.end)),
            top + kPanel * (1 - share(values.share_of(band.high))),
            top + kPanel * (1 - share(values.share_of(band.low)))};
  }

  static bool is_drawn(double limit, const Range& values) {
    return std::isfinite(limit) && limit >= values.low && limit <= values.high;
  }

  void shade(const PlotBand& band, const Range& time, const Range& values, double top) {
    const BandBox box = box_of(band, time, values, top);
    if (!(box.right > box.left) || box.lower < box.upper) return;
    out_ += fmt::format(
        "<rect class='band' x='{:.1f}' y='{:.1f}' width='{:.1f}' height='{:.1f}' fill='{}' "
        "fill-opacity='0.12'/>\n",
        box.left, box.upper, box.right - box.left, box.lower - box.upper, kBandColor);
    const bool is_narrow = box.lower - box.upper < 4 * kHatch;  // strokes would hide the curve
    if (is_drawn(band.high, values)) edge(box, box.upper, is_narrow ? 0 : -kHatch);
    if (is_drawn(band.low, values)) edge(box, box.lower, is_narrow ? 0 : kHatch);
  }

  // A dashed line with short strokes on its outer side; `outwards` is their height in pixels, down.
  void edge(const BandBox& box, double y, double outwards) {
    out_ +=
        fmt::format("<path class='limit' d='M{:.1f} {:.1f}H{:.1f}' stroke='{}' stroke-dasharray='7 3'/>\n",
                    box.left, y, box.right, kBandColor);
    std::string strokes;
    const int count =
        outwards == 0 ? 0 : static_cast<int>(std::floor((box.right - box.left - kHatch) / kHatchPitch)) + 1;
    for (int i = 0; i < count; ++i)
      strokes += fmt::format("M{:.1f} {:.1f}l{:g} {:g}", box.left + kHatchPitch * i, y, kHatch, outwards);
    if (!strokes.empty())
      out_ += fmt::format("<path d='{}' stroke='{}' stroke-width='0.8'/>\n", strokes, kBandColor);
  }

  // At the right end of the band, outside of its edge where there is room, and not over another label.
  void label(const PlotBand& band, const Range& time, const Range& values, double top,
             std::vector<double>& used) {
    const BandBox box = box_of(band, time, values, top);
    if (band.label.empty() || !(box.right > box.left)) return;
    const bool upper = is_drawn(band.high, values), lower = is_drawn(band.low, values);
    std::string words = band.label;
    if (!upper && !lower && (std::isfinite(band.high) || std::isfinite(band.low)))
      words += ", outside of the picture";
    const bool is_narrow = box.lower - box.upper < 4 * kHatch;
    double y = is_narrow && upper && lower ? box.lower + 13
               : upper                     ? box.upper - kHatch - 4
               : lower                     ? box.lower + kHatch + 11
                                           : top + 14;
    if (y < top + 11) y = box.upper + 13;
    if (y > top + kPanel - 3) y = box.lower - 5;
    const auto is_used = [&](double height) {
      return std::ranges::any_of(used, [&](double other) { return std::abs(other - height) < 12; });
    };
    while (is_used(y) && y < top + kPanel - 15) y += 12;
    used.push_back(y);
    out_ += fmt::format(
        "<text x='{:.1f}' y='{:.1f}' text-anchor='end' font-size='11' fill='#24572f' stroke='#fff' "
        "stroke-width='3' stroke-linejoin='round' paint-order='stroke'>{}</text>\n",
        box.right - 4, y, escaped(words));
  }

  void axes(const Range& time, const Range& values, const PlotPanel& panel, double top) {
    const double down = tick_step(values, 4), across = tick_step(time, 8);
    for (const double tick : ticks(values, down)) {
      const double y = top + kPanel * (1 - values.share_of(tick));
      out_ += fmt::format("<path d='M{:g} {:.1f}h{:g}' stroke='#e3e6ea'/>\n", kLeft, y, kInner);
      text(kLeft - 6, y + 4, fmt::format("{:g}", std::abs(tick) < 1e-9 * down ? 0 : tick), "end", 11, "#555");
    }
    for (const double tick : ticks(time, across)) {
      const double x = kLeft + kInner * time.share_of(tick);
      out_ += fmt::format("<path d='M{:.1f} {:g}v{:g}' stroke='#e3e6ea'/>\n", x, top, kPanel);
      text(x, top + kPanel + 15, fmt::format("{:g}", tick), "middle", 11, "#555");
    }
    out_ += fmt::format("<rect x='{:g}' y='{:g}' width='{:g}' height='{:g}' fill='none' stroke='#9aa3ad'/>\n",
                        kLeft, top, kInner, kPanel);
    text(kLeft - 6, top - 8, panel.unit, "end", 11, "#555");
    // A name has a line of its own below the numbers.
    const bool is_unit = panel.x_axis.size() <= kMaxUnitLength;
    text(kWidth - kRight, top + kPanel + (is_unit ? 15 : 28), panel.x_axis, "end", 11, "#555");
  }

  // The first, least, greatest and last value of each half pixel.
  void curve(const PlotCurve& line, const Range& time, const Range& values, double top, std::size_t index) {
    std::string path;
    bool is_open = false;
    const auto point = [&](double t, double value) {
      path += fmt::format("{}{:.1f} {:.1f}", is_open ? "L" : "M", kLeft + kInner * time.share_of(t),
                          top + kPanel * (1 - values.share_of(value)));
      is_open = true;
    };
    const std::size_t count = std::min(line.times.size(), line.values.size());
    for (std::size_t i = 0; i < count;) {
      const auto column = std::floor(2 * kInner * time.share_of(line.times[i]));
      std::size_t end = i, least = i, most = i;
      for (; end < count && std::floor(2 * kInner * time.share_of(line.times[end])) == column; ++end) {
        if (!std::isfinite(line.values[end])) break;
        if (line.values[end] < line.values[least]) least = end;
        if (line.values[end] > line.values[most]) most = end;
      }
      if (end == i) {  // a gap
        is_open = false;
        ++i;
        continue;
      }
      for (const std::size_t k : {i, std::min(least, most), std::max(least, most), end - 1})
        point(line.times[k], line.values[k]);
      i = end;
    }
    out_ += fmt::format("<path d='{}' fill='none' stroke='{}' stroke-width='1.5'{}/>\n", path,
                        kColors[index % kColors.size()], kDashes[index % kDashes.size()]);
  }

  std::string out_;
};

}  // namespace

std::string curve_plot(const std::string& title, const std::string& subtitle,
                       const std::vector<PlotPanel>& panels) {
  Range time;
  for (const PlotPanel& panel : panels) {
    for (const PlotCurve& curve : panel.curves) {
      for (const double t : curve.times) time.add(t);
    }
  }
  time.widen(0);
  if (!(time.low < time.high)) time.high = time.low + 1;
  Drawing drawing(title, subtitle, panels.size());
  if (!panels.empty()) drawing.legend(panels.front().curves);
  for (std::size_t i = 0; i < panels.size(); ++i)
    drawing.panel(panels[i], time, kTop + kLegend + kPitch * static_cast<double>(i));
  return drawing.finished();
}

}  // namespace doppel
