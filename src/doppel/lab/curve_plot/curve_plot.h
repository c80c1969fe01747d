#pragma once
// Curves over time, or over another quantity, as an SVG picture: one panel below the other, with a common
// horizontal axis and a linear axis of values each. It is readable in print and without colours: later curves
// are dashed.

#include <string>
#include <vector>

#include "doppel/export.h"

namespace doppel {

struct PlotCurve {
  std::string label;
  std::vector<double> times, values;  // as the panel's axes say; a value that is not finite is a gap
};

// A range that a curve has to keep between two places of the horizontal axis, as a shaded band; an infinite
// end has no line.
struct PlotBand {
  std::string label;
  double low = 0, high = 0;   // in the panel's unit
  double begin = 0, end = 0;  // of the horizontal axis
};

struct PlotPanel {
  std::string title, unit;
  std::string remark = {};  // at the right of the title: "largest difference 0.12 rad at 3.4 s"
  std::vector<PlotCurve> curves;
  std::vector<PlotBand> bands = {};
  std::string x_axis = "s";  // of time its unit, else name and unit: "frequency, Hz"
};

// Values of a curve beyond what a screen can show are thinned, with the extremes of each pixel kept.
[[nodiscard]] DOPPEL_API std::string curve_plot(const std::string& title, const std::string& subtitle,
                                                const std::vector<PlotPanel>& panels);

}  // namespace doppel
