#pragma once
// Requests for the files of range_files.h. Files are opened and read on a separate thread, piece by piece, so
// that neither the size of a file nor a slow disk is felt by other clients.

#include <sys/types.h>

#include <boost/asio/thread_pool.hpp>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "doppel/base/core/file_descriptor.h"
#include "doppel/export.h"
#include "doppel/ros/server/detail/http_responses.h"
#include "doppel/ros/server/range_files.h"

namespace doppel {

struct ByteRange {
  enum class Kind { whole, part, invalid };
  Kind kind = Kind::whole;
  std::uint64_t first = 0, count = 0;  // of a part
};
// The part that a Range field names in a file of that size. Other units than bytes, and several ranges, are
// answered by the whole file, as RFC 9110 permits; invalid: one that is malformed or beyond the end.
[[nodiscard]] DOPPEL_API ByteRange byte_range(std::string_view field, std::uint64_t size);

// The bytes of a response that are still to be read from its file.
class FilePart {
 public:
  explicit FilePart(int file) : file_(file) {}

  void restrict_to(std::uint64_t first, std::uint64_t count) {
    next_ = first;
    left_ = count;
  }
  [[nodiscard]] std::uint64_t left() const { return left_; }
  [[nodiscard]] std::span<const char> piece() const { return piece_; }
  // Reads the next piece. False: the file cannot be read, or has become shorter.
  [[nodiscard]] bool read_piece();

 private:
  FileDescriptor file_;
  std::uint64_t next_ = 0, left_ = 0;
  std::vector<char> piece_;
};

class RangeFiles {
 public:
  using Post = std::function<void(std::function<void()>)>;  // to the server's thread

  RangeFiles(const std::vector<RangeFile>& files, Post post);
  ~RangeFiles();
  RangeFiles(const RangeFiles&) = delete;
  RangeFiles& operator=(const RangeFiles&) = delete;

  // -- the server's thread, on which also `done` is called
  [[nodiscard]] bool has(std::string_view target) const;
  // Precondition: has(question.target), and the method is GET or HEAD.
  void get(const HttpRequest& question, std::function<void(HttpResponse)> done);
  // The next piece of a response; false: there is none.
  void read(std::shared_ptr<FilePart> part, std::function<void(bool)> done);

 private:
  struct Entry {
    RangeFile file;
    dev_t device = 0;
    ino_t node = 0;  // a file that takes its place is not served
  };
  struct Ranges {
    std::string range, if_range;
  };
  static HttpResponse open(const Entry& entry, const Ranges& conditions);
  // Runs `work` on the reader's thread, and `done` with its result on the server's.
  template <class Result>
  void run(std::function<Result()> work, Result failed, std::function<void(Result)> done);

  Post post_;
  std::map<std::string, Entry, std::less<>> files_;
  // The callbacks for results of the reader, so that connections end on the server's thread.
  std::map<std::uint64_t, std::shared_ptr<void>> waiting_;
  std::uint64_t next_ = 0;
  std::optional<boost::asio::thread_pool> reader_;  // last, so that its thread ends before the rest
};

}  // namespace doppel
