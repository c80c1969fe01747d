#pragma once
// The built page (web/dist) in memory: index.html and assets/*, each with its compressed form. Read once,
// when first requested; a request is only looked up in this table, never on the disk.

#include <filesystem>
#include <map>
#include <string>
#include <string_view>

namespace doppel {

struct PageFile {
  std::string content_type;
  std::string tag;          // of the content, for ETag, without quotes
  std::string bytes, gzip;  // gzip is empty if there is none
  bool immutable = false;   // the name contains a hash of the content
};

// Distinguishes contents by their hash (FNV-1a), without protection against forgery.
[[nodiscard]] std::string content_tag(std::string_view bytes);

class PageFiles {
 public:
  explicit PageFiles(std::filesystem::path folder) : folder_(std::move(folder)) {}

  // path: exactly "/" or "/assets/NAME"; nullptr: no such file. If the page is not built yet, the next call
  // reads the folder again. The result is valid as long as this object.
  [[nodiscard]] const PageFile* find(std::string_view path);

 private:
  void read();

  std::filesystem::path folder_;
  std::map<std::string, PageFile, std::less<>> files_;  // by the path of a request
};

}  // namespace doppel
