#pragma once
// The picture that the plugin module for images returns.

#include <cstdint>
#include <string>
#include <vector>

namespace doppel {

struct GreyImage {
  int width = 0, height = 0;          // pixels
  int brightest = 255;                // the greatest value of the format: 255 or 65535
  int brightest_of_all = 0;           // of all channels but opacity
  std::vector<std::uint16_t> values;  // [height][width], of the first channel; the first row is the top
};

}  // namespace doppel
