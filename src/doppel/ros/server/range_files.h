#pragma once
// Files that a server sends by HTTP ranges (RFC 9110), each at its address: those of a recording, however
// large. Nothing else of their folders is served.

#include <filesystem>
#include <string>

namespace doppel {

struct RangeFile {
  std::string address;           // the path of its address, decoded: "/recordings/1/run.mcap"
  std::filesystem::path path{};  // an absolute one; the file that is there when the server starts
  std::string text{};            // the content, where there is no path
};

}  // namespace doppel
