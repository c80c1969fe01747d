// Panels of curves over time as SVG, and the drawing of a verification.

#include "doppel/lab/verification/detail/plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "doppel/base/xml/xml.h"
#include "doppel/lab/verification/verify.h"

namespace doppel {
namespace {

constexpr double kLeft = 74, kRight = 92, kTop = 62;
constexpr int kPoints = 400;    // of a curve: more are not visible
constexpr double kMin = 1e-12;  // rad, the lowest value that is drawn
constexpr const char* kColors[] = {"#c0392b", "#2471a3", "#1e8449", "#7d3c98"};
constexpr const char* kDashes[] = {"", " stroke-dasharray=\"7 3\"", " stroke-dasharray=\"2 3\"",
                                   " stroke-dasharray=\"9 2 2 2\""};

}  // namespace

LogPlot::LogPlot(std::size_t panels, double duration)
    : duration_(duration),
      out_(fmt::format(
          "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" "
          "viewBox=\"0 0 {0:g} {1:g}\" width=\"{0:g}\" height=\"{1:g}\" font-family=\"sans-serif\" "
          "font-size=\"12\" fill=\"#222\">\n<rect width=\"{0:g}\" height=\"{1:g}\" fill=\"#fff\"/>\n",
          kPlotWidth, kTop + static_cast<double>(panels) * kPanelPitch)) {}

void LogPlot::title(const std::string& large, const std::string& small) {
  text(kLeft, 24, large, "start", 15);
  text(kLeft, 42, small, "start", 12);
}

void LogPlot::text(double x, double y, const std::string& words, const char* anchor, int size,
                   const char* color) {
  fmt::format_to(
      std::back_inserter(out_),
      "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\" font-size=\"{}\" fill=\"{}\">{}</text>\n", x, y,
      anchor, size, color, escape_xml(words, false));
}

void LogPlot::line(double x1, double y1, double x2, double y2, const char* color) {
  fmt::format_to(std::back_inserter(out_),
                 "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\"/>\n", x1, y1,
                 x2, y2, color);
}

double LogPlot::at_time(double t) const {
  return kLeft + (kPlotWidth - kLeft - kRight) * t / duration_;
}

void LogPlot::panel(std::size_t index, const std::string& verdict, const std::vector<double>& time,
                    const std::vector<PlottedCurve>& curves, double chaotic_after) {
  const double top = kFirstPanel + static_cast<double>(index) * kPanelPitch;
  text(kLeft, top - 6, verdict, "start", 12);
  int low = 0, high = -20;  // decades
  for (const PlottedCurve& of : curves) {
    for (const double value : of.values) {
      if (!(value >= kMin)) continue;
      low = std::min(low, static_cast<int>(std::floor(std::log10(value))));
      high = std::max(high, static_cast<int>(std::ceil(std::log10(value))));
    }
  }
  if (high <= low) high = low + 1;
  if (high - low > 9) low = high - 9;
  axes(top, low, high);
  for (std::size_t i = 0; i < curves.size(); ++i) curve(time, curves[i], i, top, low, high);
  if (chaotic_after >= 0) {
    const double x = at_time(chaotic_after);
    line(x, top, x, top + kPanelHeight, "#888");
    text(x + 4, top + kPanelHeight - 6, "chaotic", "start", 11, "#666");
  }
}

void LogPlot::axes(double top, int low, int high) {
  for (int decade = low; decade <= high; ++decade) {
    const double y = top + kPanelHeight * (high - decade) / static_cast<double>(high - low);
    line(kLeft, y, kPlotWidth - kRight, y, decade == low ? "#444" : "#e3e3e3");
    text(kLeft - 8, y + 4, fmt::format("1e{}", decade), "end", 11, "#555");
  }
  for (int i = 0; i <= 4; ++i) {
    const double t = duration_ * i / 4, x = at_time(t);
    line(x, top + kPanelHeight, x, top + kPanelHeight + 4, "#444");
    text(x, top + kPanelHeight + 17, fmt::format("{:g} s", std::round(t * 1e3) / 1e3), "middle", 11, "#555");
  }
}

void LogPlot::curve(const std::vector<double>& time, const PlottedCurve& of, std::size_t index, double top,
                    int low, int high) {
  const char* const color = kColors[index % std::size(kColors)];
  const char* const dashes = kDashes[index % std::size(kDashes)];
  const std::size_t stride = std::max<std::size_t>(1, of.values.size() / kPoints);
  std::string points;
  for (std::size_t i = 0; i < of.values.size(); i += stride) {
    // The largest of the samples of a point, so that no peak is lost.
    const auto end = of.values.begin() + static_cast<std::ptrdiff_t>(std::min(of.values.size(), i + stride));
    const double value = *std::max_element(of.values.begin() + static_cast<std::ptrdiff_t>(i), end);
    const double decade = std::clamp(std::log10(std::max(value, kMin)), double(low), double(high));
    fmt::format_to(std::back_inserter(points), "{:.1f},{:.1f} ", at_time(time[i]),
                   top + kPanelHeight * (high - decade) / (high - low));
  }
  fmt::format_to(std::back_inserter(out_),
                 "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.6\"{}/>\n", points,
                 color, dashes);
  const double y = top + 12 + 16 * static_cast<double>(index);
  fmt::format_to(std::back_inserter(out_),
                 "<line x1=\"{0:.1f}\" y1=\"{1:.1f}\" x2=\"{2:.1f}\" y2=\"{1:.1f}\" stroke=\"{3}\" "
                 "stroke-width=\"1.6\"{4}/>\n",
                 kPlotWidth - kRight + 8, y - 4, kPlotWidth - kRight + 30, color, dashes);
  text(kPlotWidth - kRight + 34, y, of.label, "start", 11);
}

std::string verification_svg(const Verification& of) {
  LogPlot plot(of.motions.size(), of.duration);
  plot.title(fmt::format("{}: error of the worst joint, rad", of.robot),
             fmt::format("{}, steps of {:g}, {:g} and {:g} ms", name_of(of.integrator), of.step * 1e3,
                         of.step * 500, of.step * 250));
  for (std::size_t i = 0; i < of.motions.size(); ++i) {
    const MotionVerdict& motion = of.motions[i];
    std::vector<PlottedCurve> curves;
    for (int step = 0; step < 3; ++step)
      curves.push_back({fmt::format("{:g} ms", of.step * 1e3 / (1 << step)), motion.curve.error[step]});
    plot.panel(i, verdict_line(of, motion), motion.curve.time, curves, motion.chaotic_after.value_or(-1.0));
  }
  return plot.finished();
}

}  // namespace doppel
