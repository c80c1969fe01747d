// A verification as a picture: errors over time, logarithmic, for h, h/2 and h/4.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "doppel/description/xml.h"
#include "doppel/verification/verify.h"

namespace doppel {
namespace {

constexpr double kWidth = 720, kPanel = 190, kLeft = 74, kRight = 92, kTop = 62, kGap = 58;
constexpr int kPoints = 400;      // of a curve: more are not seen
constexpr double kLeast = 1e-12;  // rad, the lowest error that is drawn
constexpr const char* kColors[] = {"#c0392b", "#2471a3", "#1e8449"};
constexpr const char* kDashes[] = {"", " stroke-dasharray=\"7 3\"", " stroke-dasharray=\"2 3\""};

class Plot {
 public:
  explicit Plot(const Verification& of) : of_(of) {}

  std::string write() {
    const double height = kTop + static_cast<double>(of_.motions.size()) * (kPanel + kGap);
    out_ = fmt::format(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" "
        "viewBox=\"0 0 {0:g} {1:g}\" width=\"{0:g}\" height=\"{1:g}\" font-family=\"sans-serif\" "
        "font-size=\"12\" fill=\"#222\">\n<rect width=\"{0:g}\" height=\"{1:g}\" fill=\"#fff\"/>\n",
        kWidth, height);
    text(kLeft, 24, fmt::format("{}: error of the joint that is farthest off, rad", of_.robot), "start", 15);
    text(kLeft, 42,
         fmt::format("{}, steps of {:g}, {:g} and {:g} ms", name_of(of_.integrator), of_.step * 1e3,
                     of_.step * 500, of_.step * 250),
         "start", 12);
    for (std::size_t i = 0; i < of_.motions.size(); ++i)
      panel(of_.motions[i], kTop + static_cast<double>(i) * (kPanel + kGap) + 16);
    return out_ + "</svg>\n";
  }

 private:
  void text(double x, double y, const std::string& words, const char* anchor, int size,
            const char* color = "#222") {
    fmt::format_to(
        std::back_inserter(out_),
        "<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\" font-size=\"{}\" fill=\"{}\">{}</text>\n", x, y,
        anchor, size, color, escape_xml(words, false));
  }
  void line(double x1, double y1, double x2, double y2, const char* color) {
    fmt::format_to(std::back_inserter(out_),
                   "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\"/>\n", x1, y1,
                   x2, y2, color);
  }
  void panel(const MotionVerdict& motion, double top) {
    text(kLeft, top - 6, verdict_line(of_, motion), "start", 12);
    int low = 0, high = -20;  // decades
    for (const auto& errors : motion.curve.error) {
      for (const double error : errors) {
        if (!(error >= kLeast)) continue;
        low = std::min(low, static_cast<int>(std::floor(std::log10(error))));
        high = std::max(high, static_cast<int>(std::ceil(std::log10(error))));
      }
    }
    if (high <= low) high = low + 1;
    if (high - low > 9) low = high - 9;
    axes(top, low, high);
    for (int step = 0; step < 3; ++step) curve(motion, step, top, low, high);
    if (motion.chaotic_after) {
      const double x = at_time(*motion.chaotic_after);
      line(x, top, x, top + kPanel, "#888");
      text(x + 4, top + kPanel - 6, "chaotic", "start", 11, "#666");
    }
  }

  void axes(double top, int low, int high) {
    for (int decade = low; decade <= high; ++decade) {
      const double y = top + kPanel * (high - decade) / static_cast<double>(high - low);
      line(kLeft, y, kWidth - kRight, y, decade == low ? "#444" : "#e3e3e3");
      text(kLeft - 8, y + 4, fmt::format("1e{}", decade), "end", 11, "#555");
    }
    for (int i = 0; i <= 4; ++i) {
      const double t = of_.duration * i / 4, x = at_time(t);
      line(x, top + kPanel, x, top + kPanel + 4, "#444");
      text(x, top + kPanel + 17, fmt::format("{:g} s", std::round(t * 1e3) / 1e3), "middle", 11, "#555");
    }
  }

  void curve(const MotionVerdict& motion, int step, double top, int low, int high) {
    const auto& errors = motion.curve.error[step];
    const std::size_t stride = std::max<std::size_t>(1, errors.size() / kPoints);
    std::string points;
    double last = top + kPanel;
    for (std::size_t i = 0; i < errors.size(); i += stride) {
      // Of the samples that a point stands for, the largest: no peak is lost.
      const auto end = errors.begin() + static_cast<std::ptrdiff_t>(std::min(errors.size(), i + stride));
      const double error = *std::max_element(errors.begin() + static_cast<std::ptrdiff_t>(i), end);
      const double decade = std::clamp(std::log10(std::max(error, kLeast)), double(low), double(high));
      last = top + kPanel * (high - decade) / (high - low);
      fmt::format_to(std::back_inserter(points), "{:.1f},{:.1f} ", at_time(motion.curve.time[i]), last);
    }
    fmt::format_to(std::back_inserter(out_),
                   "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.6\"{}/>\n", points,
                   kColors[step], kDashes[step]);
    const double y = top + 12 + 16 * step;
    fmt::format_to(std::back_inserter(out_),
                   "<line x1=\"{0:.1f}\" y1=\"{1:.1f}\" x2=\"{2:.1f}\" y2=\"{1:.1f}\" stroke=\"{3}\" "
                   "stroke-width=\"1.6\"{4}/>\n",
                   kWidth - kRight + 8, y - 4, kWidth - kRight + 30, kColors[step], kDashes[step]);
    text(kWidth - kRight + 34, y, fmt::format("{:g} ms", of_.step * 1e3 / (1 << step)), "start", 11);
  }

  [[nodiscard]] double at_time(double t) const {
    return kLeft + (kWidth - kLeft - kRight) * t / of_.duration;
  }

  const Verification& of_;
  std::string out_;
};

}  // namespace

std::string verification_svg(const Verification& of) {
  return Plot(of).write();
}

}  // namespace doppel
