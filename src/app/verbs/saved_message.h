#pragma once
// A message as a file that other programs show.

#include <span>
#include <string>

#include "doppel/messages/codec.h"

namespace doppel::app {

// The usual ending for a type: ".png" for pictures and depths, ".ply" for point clouds, ".csv" for scans, else ".yaml".
std::string usual_ending(const std::string& type);

// The content of a file with this ending: .png .jpg (Image, CompressedImage), .ply (PointCloud2), .csv (LaserScan), .yaml
// .json (all). Depths in a .png are grey, from near (light) to far (dark); `note` says the range. Throws InputError: the
// type has no such file.
std::string saved_message(const TypeSupport& type, std::span<const std::byte> cdr, const std::string& ending,
                          std::string& note);

}  // namespace doppel::app
