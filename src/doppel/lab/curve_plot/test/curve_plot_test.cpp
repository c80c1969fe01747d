#include "doppel/lab/curve_plot/curve_plot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

namespace doppel {
namespace {

using testing::HasSubstr;

// The data of the first curve.
std::string path_of(const std::string& svg) {
  const std::size_t end = svg.find("' fill='none' stroke='#1f5f8b'");
  const std::size_t begin = svg.rfind("'", end - 1) + 1;
  return svg.substr(begin, end - begin);
}

std::vector<std::pair<double, double>> points_of(const std::string& svg) {
  std::string data = path_of(svg);
  std::ranges::replace_if(
      data, [](char c) { return c == 'M' || c == 'L'; }, ' ');
  std::istringstream numbers(data);
  std::vector<std::pair<double, double>> out;
  for (double x = 0, y = 0; numbers >> x >> y;) out.emplace_back(x, y);
  return out;
}

TEST(CurvePlot, PointsLieInPanelAndExtremesOfLongCurvesStay) {
  PlotCurve curve{"q", {}, {}};
  for (int i = 0; i < 100'000; ++i) {
    curve.times.push_back(1e-4 * i);
    curve.values.push_back(std::sin(1e-3 * i));
  }
  curve.values[54'321] = 3;  // a spike of one sample
  const auto points = points_of(curve_plot("t", "s", {{"joint", "rad", "", {curve}}}));
  EXPECT_LT(points.size(), 6000U);
  double highest = 1e9;
  for (const auto& [x, y] : points) {
    EXPECT_GE(x, 76);
    EXPECT_LE(x, 740);
    EXPECT_GE(y, 102);
    EXPECT_LE(y, 232);
    highest = std::min(highest, y);
  }
  EXPECT_LT(highest, 112);
}

TEST(CurvePlot, HorizontalAxisHasUnitOrName) {
  PlotPanel panel{"gain", "dB", "", {{"measured", {1, 2}, {0, -3}}}};
  EXPECT_THAT(curve_plot("t", "", {panel}), HasSubstr(">s</text>"));
  panel.x_axis = "frequency, Hz";
  const std::string svg = curve_plot("t", "", {panel});
  EXPECT_THAT(svg, HasSubstr(">frequency, Hz</text>"));
  EXPECT_THAT(svg, testing::Not(HasSubstr(">s</text>")));
}

TEST(CurvePlot, ValueThatIsNotFiniteIsGapAndNamesAreEscaped) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::string svg =
      curve_plot("a < b & c", "", {{"j", "rad", "", {{"run", {0, 1, 2, 3, 4}, {0, 1, nan, 1, 0}}}}});
  EXPECT_THAT(svg, HasSubstr("a &lt; b &amp; c"));
  EXPECT_EQ(std::ranges::count(path_of(svg), 'M'), 2);
}

TEST(CurvePlot, ConstantAndEmptyCurvesAreDrawn) {
  EXPECT_THAT(curve_plot("t", "", {{"j", "rad", "", {{"run", {0, 1}, {2, 2}}}}}), HasSubstr("</svg>"));
  EXPECT_THAT(curve_plot("t", "", {{"j", "rad", "", {{"run", {}, {}}}}}), HasSubstr("</svg>"));
  EXPECT_THAT(curve_plot("t", "", {}), HasSubstr("</svg>"));
}

PlotPanel banded(PlotBand band) {
  return {"j", "rad", "", {{"run", {0, 1, 2}, {0, 1, 1}}}, {std::move(band)}};
}

TEST(CurvePlot, BandIsShadedWithDashedEdgesAndLabel) {
  const std::string svg = curve_plot("t", "", {banded({"limit <1.2>", 0.5, 1.2, 1, 2})});
  EXPECT_THAT(svg, HasSubstr("<rect class='band' x='408.0'"));
  EXPECT_EQ(std::ranges::count(svg, '\n'), std::ranges::count(curve_plot("t", "", {banded({})}), '\n') + 6);
  EXPECT_THAT(svg, HasSubstr("H740.0' stroke='#3a7d44' stroke-dasharray='7 3'"));
  EXPECT_THAT(svg, HasSubstr("limit &lt;1.2>"));
}

TEST(CurvePlot, InfiniteEndOfBandHasNoLineAndLimitStaysInPanel) {
  const std::string svg = curve_plot("t", "", {banded({"limit", -INFINITY, 3, 0, 2})});
  const auto lines = [&svg] {
    std::size_t out = 0;
    for (std::size_t i = svg.find("class='limit'"); i != std::string::npos;
         i = svg.find("class='limit'", i + 1))
      ++out;
    return out;
  };
  EXPECT_EQ(lines(), 1U);
  for (const auto& [x, y] : points_of(svg)) EXPECT_GT(y, 180);  // the curve is below the limit
}

TEST(CurvePlot, DistantLimitDoesNotFlattenCurve) {
  const std::string svg = curve_plot("t", "", {banded({"limit", -INFINITY, 500, 0, 2})});
  EXPECT_EQ(svg.find("class='limit'"), std::string::npos);
  EXPECT_THAT(svg, HasSubstr("limit, outside of the picture"));
  double highest = 1e9;
  for (const auto& [x, y] : points_of(svg)) highest = std::min(highest, y);
  EXPECT_LT(highest, 120);
}

TEST(CurvePlot, LabelsOfBandsDoNotOverlap) {
  PlotPanel panel = banded({"first", -INFINITY, 1.1, 0, 2});
  panel.bands.push_back({"second", -INFINITY, 1.12, 0, 2});
  const std::string svg = curve_plot("t", "", {panel});
  const auto height = [&svg](const std::string& word) {
    const std::size_t end = svg.find(">" + word + "<"), begin = svg.rfind(" y='", end) + 4;
    return std::stod(svg.substr(begin));
  };
  EXPECT_GE(std::abs(height("first") - height("second")), 11.9);
}

}  // namespace
}  // namespace doppel
