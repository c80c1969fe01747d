#include "doppel/base/math/quantity.h"

#include <gtest/gtest.h>

#include <numbers>

namespace doppel {
namespace {

TEST(QuantityTest, UnitsConvertAndThoseOfAnotherKindAreRefused) {
  EXPECT_EQ(parse_quantity("0.5", QuantityKind::angle), 0.5);
  EXPECT_DOUBLE_EQ(*parse_quantity("180 deg", QuantityKind::position), std::numbers::pi);
  EXPECT_DOUBLE_EQ(*parse_quantity("20mm", QuantityKind::position), 0.02);
  EXPECT_DOUBLE_EQ(*parse_quantity("5%", QuantityKind::share), 0.05);
  EXPECT_FALSE(parse_quantity("5 kg", QuantityKind::time));
  EXPECT_FALSE(parse_quantity("20 mm", QuantityKind::angle));
  EXPECT_FALSE(parse_quantity("nan", QuantityKind::angle));
  EXPECT_FALSE(parse_quantity("1e308 N/mm", QuantityKind::stiffness));
  EXPECT_FALSE(parse_quantity("", QuantityKind::angle));
  EXPECT_FALSE(parse_quantity("5 deg deg", QuantityKind::angle));
}

}  // namespace
}  // namespace doppel
