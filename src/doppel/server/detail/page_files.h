#pragma once
// The built page (web/dist) in memory: index.html and assets/*, each with its compressed form beside it. Read
// once, when first requested; a request only ever looks into this table, never at the disk.

#include <filesystem>
#include <map>
#include <string>
#include <string_view>

namespace doppel {

struct PageFile {
  std::string content_type;
  std::string tag;          // of the content, for ETag, without quotes
  std::string bytes, gzip;  // gzip is empty where there is none
  bool immutable = false;   // the name holds a hash of the content
};

class PageFiles {
 public:
  explicit PageFiles(std::filesystem::path folder) : folder_(std::move(folder)) {}

  // path: "/" or "/assets/NAME", exactly; nullptr: there is none. Where nothing has been built yet, the next
  // call looks again. The answer lives as long as this.
  [[nodiscard]] const PageFile* find(std::string_view path);

 private:
  void read();

  std::filesystem::path folder_;
  std::map<std::string, PageFile, std::less<>> files_;  // by the path of a request
};

}  // namespace doppel
