#pragma once
// A message as a file that other programs show.

#include <span>
#include <string>

#include "doppel/base/images/image.h"
#include "doppel/ros/messages/codec.h"

namespace doppel::app {

// Of a file's name, in small letters and with its dot: ".png"; empty if it has none.
std::string ending_of(const std::string& file);

bool is_picture(const std::string& ending);
// Precondition: is_picture(ending). Opacity is left out of JPEG, which has none.
std::string encoded_picture(const Bitmap& picture, const std::string& ending);

// The usual ending for a type: ".png" for pictures and depths, ".ply" for point clouds, ".csv" for scans, else ".yaml".
std::string usual_ending(const std::string& type);

// Throws InputError: messages of this type are not saved with that ending.
void check_ending(const std::string& type, const std::string& ending);

// The content of a file with this ending: .png .jpg (Image, CompressedImage), .ply (PointCloud2), .csv (LaserScan), .yaml
// (all). Depths in a picture are grey, from near (light) to far (dark); `note` says the range. Throws InputError: the type
// or its encoding has no such file; ClientError: the message contradicts itself.
std::string saved_message(const TypeSupport& type, std::span<const std::byte> cdr, const std::string& ending,
                          std::string& note);

}  // namespace doppel::app
