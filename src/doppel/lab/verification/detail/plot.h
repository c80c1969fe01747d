#pragma once
// Private to this module: panels of curves over time on a logarithmic scale.

#include <string>
#include <vector>

namespace doppel {

inline constexpr double kPlotWidth = 720, kPanelHeight = 190, kPanelPitch = 248, kFirstPanel = 78;

struct PlottedCurve {
  std::string label;
  std::vector<double> values;  // [times]
};

class LogPlot {
 public:
  LogPlot(std::size_t panels, double duration);
  void title(const std::string& large, const std::string& small);
  // `chaotic_after`: s, negative: never.
  void panel(std::size_t index, const std::string& verdict, const std::vector<double>& time,
             const std::vector<PlottedCurve>& curves, double chaotic_after);
  [[nodiscard]] std::string finished() const { return out_ + "</svg>\n"; }

 private:
  void text(double x, double y, const std::string& words, const char* anchor, int size,
            const char* color = "#222");
  void line(double x1, double y1, double x2, double y2, const char* color);
  void axes(double top, int low, int high);
  void curve(const std::vector<double>& time, const PlottedCurve& of, std::size_t index, double top, int low,
             int high);
  [[nodiscard]] double at_time(double t) const;

  double duration_;
  std::string out_;
};

}  // namespace doppel
