#include "doppel/ros/server/detail/range_files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/post.hpp>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <utility>

#include "doppel/ros/server/detail/header_text.h"

namespace doppel {
namespace {

constexpr std::size_t kPiece = std::size_t{128} << 10;  // bytes

std::optional<std::uint64_t> whole_number(std::string_view text) {
  std::uint64_t out = 0;
  const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), out);
  if (problem != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return out;
}

std::string path_of(std::string_view target) {
  return percent_decoded(target.substr(0, target.find('?')));
}

std::string version_tag(const struct stat& about) {
  return fmt::format("\"{:x}-{:x}-{:x}.{:x}\"", about.st_ino, about.st_size, about.st_mtim.tv_sec,
                     about.st_mtim.tv_nsec);
}

HttpResponse text_response(const std::string& text) {
  HttpResponse answer;
  answer.content_type = "text/plain; charset=utf-8";
  answer.body = text;
  return answer;
}

HttpResponse range_problem(std::string_view field, std::uint64_t size) {
  HttpResponse answer = http_problem(
      416, fmt::format("the range '{}' is not one of the file, which has {} bytes", field, size));
  answer.headers.emplace_back("Content-Range", fmt::format("bytes */{}", size));
  answer.headers.emplace_back("Accept-Ranges", "bytes");
  return answer;
}

}  // namespace

ByteRange byte_range(std::string_view field, std::uint64_t size) {
  using Kind = ByteRange::Kind;
  constexpr std::string_view kUnit = "bytes=";
  if (!field.starts_with(kUnit) || field.find(',') != std::string_view::npos) return {};
  field = trim_blanks(field.substr(kUnit.size()));
  const std::size_t dash = field.find('-');
  if (dash == std::string_view::npos) return {.kind = Kind::invalid};
  const auto first = whole_number(field.substr(0, dash)), last = whole_number(field.substr(dash + 1));
  if (dash == 0) {  // the last bytes
    if (!last || *last == 0 || size == 0) return {.kind = Kind::invalid};
    const std::uint64_t count = std::min(*last, size);
    return {.kind = Kind::part, .first = size - count, .count = count};
  }
  const bool is_open = dash + 1 == field.size();
  if (!first || *first >= size || (!last && !is_open) || (last && *last < *first))
    return {.kind = Kind::invalid};
  const std::uint64_t end = last ? std::min(*last, size - 1) : size - 1;
  return {.kind = Kind::part, .first = *first, .count = end - *first + 1};
}

bool FilePart::read_piece() {
  piece_.resize(static_cast<std::size_t>(std::min<std::uint64_t>(left_, kPiece)));
  for (std::size_t filled = 0; filled < piece_.size();) {
    const ssize_t got =
        pread(file_.get(), &piece_[filled], piece_.size() - filled, static_cast<off_t>(next_ + filled));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    filled += static_cast<std::size_t>(got);
  }
  next_ += piece_.size();
  left_ -= piece_.size();
  return true;
}

RangeFiles::RangeFiles(const std::vector<RangeFile>& files, Post post) : post_(std::move(post)) {
  for (const RangeFile& file : files) {
    Entry entry{.file = file};
    struct stat about {};
    if (!file.path.empty() && stat(file.path.c_str(), &about) == 0 && S_ISREG(about.st_mode)) {
      entry.device = about.st_dev;
      entry.node = about.st_ino;
    }
    files_.emplace(file.address, std::move(entry));
  }
}

RangeFiles::~RangeFiles() = default;

bool RangeFiles::has(std::string_view target) const {
  return !files_.empty() && files_.contains(path_of(target));
}

HttpResponse RangeFiles::open(const Entry& entry, const Ranges& conditions) {
  // Not blocking, if a pipe has taken the place of the file.
  const int file = ::open(entry.file.path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  const int problem = errno;
  auto part = std::make_shared<FilePart>(file);  // closes it
  struct stat about {};
  if (file < 0) return http_problem(404, fmt::format("it cannot be opened: {}", std::strerror(problem)));
  if (fstat(file, &about) != 0 || about.st_dev != entry.device || about.st_ino != entry.node)
    return http_problem(404, "another file has taken its place since the program was started");
  const auto size = static_cast<std::uint64_t>(about.st_size);
  const std::string tag = version_tag(about);
  const bool is_current = conditions.if_range.empty() || conditions.if_range == tag;
  const ByteRange range = is_current ? byte_range(conditions.range, size) : ByteRange{};
  if (range.kind == ByteRange::Kind::invalid) return range_problem(conditions.range, size);
  const bool is_part = range.kind == ByteRange::Kind::part;
  HttpResponse answer;
  answer.content_type = "application/octet-stream";
  answer.headers = {{"Accept-Ranges", "bytes"}, {"ETag", tag}};
  if (is_part) {
    answer.status = 206;
    answer.headers.emplace_back(
        "Content-Range", fmt::format("bytes {}-{}/{}", range.first, range.first + range.count - 1, size));
  }
  part->restrict_to(is_part ? range.first : 0, is_part ? range.count : size);
  answer.part = std::move(part);
  return answer;
}

template <class Result>
void RangeFiles::run(std::function<Result()> work, Result failed, std::function<void(Result)> done) {
  if (!reader_) reader_.emplace(1);
  const std::uint64_t id = next_++;
  waiting_.emplace(id, std::make_shared<std::function<void(Result)>>(std::move(done)));
  boost::asio::post(*reader_, [this, id, work = std::move(work), result = std::move(failed)]() mutable {
    try {
      result = work();
    } catch (...) {  // out of memory: the response of a failure
    }
    try {
      post_([this, id, result = std::move(result)]() mutable {
        const auto found = waiting_.find(id);
        const auto finish = std::static_pointer_cast<std::function<void(Result)>>(found->second);
        waiting_.erase(found);
        (*finish)(std::move(result));
      });
    } catch (...) {  // no memory for the result: this request stays unanswered
    }
  });
}

void RangeFiles::get(const HttpRequest& question, std::function<void(HttpResponse)> done) {
  const auto found = files_.find(path_of(question.target));
  const Entry& entry = found->second;
  if (entry.file.path.empty()) return done(text_response(entry.file.text));
  // A Range of HEAD has no meaning.
  const bool is_get = question.method == "GET";
  Ranges conditions{.range = std::string(is_get ? question.range : ""),
                    .if_range = std::string(question.if_range)};
  run<HttpResponse>([&entry, conditions = std::move(conditions)] { return open(entry, conditions); },
                    http_problem(500, "it cannot be read"), std::move(done));
}

void RangeFiles::read(std::shared_ptr<FilePart> part, std::function<void(bool)> done) {
  run<bool>([part = std::move(part)] { return part->read_piece(); }, false, std::move(done));
}

}  // namespace doppel
