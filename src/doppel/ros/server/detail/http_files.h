#pragma once
// The files of fetchAsset over HTTP, GET /files?uri=URI, so that a browser receives them compressed and keeps
// them: each file is compressed once, and its ETag is the hash of its content. Which files are served is the
// decision of asset_library.h, which clients are accepted that of admission.h, for both ways the same.

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "doppel/export.h"
#include "doppel/ros/server/asset_reader.h"
#include "doppel/ros/server/detail/http_responses.h"

namespace doppel {

// The percent-decoded URI of a request for a file; nullopt: it is another request.
DOPPEL_API std::optional<std::string> requested_file(std::string_view target);
DOPPEL_API std::string gzip_compressed(std::string_view bytes);

class DOPPEL_API HttpFiles {
 public:
  using Post = std::function<void(std::function<void()>)>;  // to the server's thread
  using Done = std::function<void(HttpResponse)>;

  HttpFiles(std::shared_ptr<AssetLibrary> library, Post post)
      : post_(std::move(post)), reader_(std::move(library)) {}

  [[nodiscard]] bool offers() const { return reader_.offers(); }
  // Reads and compresses on the reader's thread; `done` is called on the server's thread.
  void get(const std::string& uri, const HttpRequest& question, Done done);

 private:
  static constexpr std::size_t kMaxPackedBytes = std::size_t{48} << 20;  // kept in memory

  HttpResponse response_to(const std::string& uri, const std::string& accept_encoding,
                           const std::string& if_none_match, const AssetLibrary::Answer& answer);
  std::shared_ptr<const std::string> packed(const std::string& tag, std::string_view bytes);
  void finish(std::uint64_t id, HttpResponse response);

  Post post_;
  std::uint64_t next_ = 0;
  std::map<std::uint64_t, Done> waiting_;  // the server's thread
  // The reader's thread: compressed files by the hash of their content, oldest first.
  std::deque<std::pair<std::string, std::shared_ptr<const std::string>>> packed_;
  std::size_t packed_bytes_ = 0;
  AssetReader reader_;  // last, so that its thread ends before the rest
};

}  // namespace doppel
