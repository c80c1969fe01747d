#include "doppel/base/core/lateness_histogram.h"

#include <gtest/gtest.h>

namespace doppel {
namespace {

using std::chrono::microseconds;
using std::chrono::nanoseconds;

TEST(LatenessHistogram, PercentilesAreUpperBinEdges) {
  LatenessHistogram histogram;
  for (int i = 1; i <= 1000; ++i) histogram.add(microseconds(i));
  EXPECT_EQ(histogram.count(), 1000u);
  EXPECT_GE(histogram.percentile(0.5), 500.0);
  EXPECT_LE(histogram.percentile(0.5), 500.0 * 1.16);
  EXPECT_GE(histogram.percentile(0.99), 990.0);
  EXPECT_LE(histogram.percentile(0.99), 990.0 * 1.16);
  EXPECT_EQ(histogram.worst(), 1000.0);
}

TEST(LatenessHistogram, EmptyAndExtremeValuesAreSafe) {
  LatenessHistogram histogram;
  EXPECT_EQ(histogram.percentile(0.99), 0.0);
  histogram.add(nanoseconds(0));
  histogram.add(std::chrono::hours(1));
  EXPECT_EQ(histogram.count(), 2u);
  EXPECT_LE(histogram.percentile(0.5), 1.0);
}

}  // namespace
}  // namespace doppel
