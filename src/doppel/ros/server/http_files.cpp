#include "doppel/ros/server/detail/http_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/beast/zlib/deflate_stream.hpp>
#include <boost/crc.hpp>
#include <filesystem>

#include "doppel/ros/server/detail/header_text.h"

namespace doppel {
namespace {

constexpr std::string_view kPath = "/files", kUri = "uri=";
constexpr int kFastest = 1;  // of the levels of compression: the first picture waits for it
constexpr int kWindowBits = 15, kMemoryLevel = 8;
constexpr std::size_t kMinPacked = 1024;  // bytes; smaller files are sent as they are

// Pictures are compressed already.
bool is_picture(std::string_view uri) {
  const std::string extension = std::filesystem::path(uri).extension().string();
  return extension == ".png" || extension == ".jpg" || extension == ".jpeg";
}

void append_number(std::string& out, std::uint32_t number) {
  for (int i = 0; i < 4; ++i) out += static_cast<char>(number >> (8 * i));
}

}  // namespace

std::optional<std::string> requested_file(std::string_view target) {
  const std::size_t question = target.find('?');
  if (target.substr(0, question) != kPath) return std::nullopt;
  std::optional<std::string> uri = "";
  if (question == std::string_view::npos) return uri;
  any_entry(target.substr(question + 1), '&', [&uri](std::string_view entry) {
    if (!entry.starts_with(kUri)) return false;
    uri = percent_decoded(entry.substr(kUri.size()));
    return true;
  });
  return uri;
}

// RFC 1952: a header, the deflated bytes, the checksum and the length of the content.
std::string gzip_compressed(std::string_view bytes) {
  namespace zlib = boost::beast::zlib;
  constexpr std::array<char, 10> kHeader{'\x1f', '\x8b', 8, 0, 0, 0, 0, 0, 0, '\xff'};
  zlib::deflate_stream stream;
  stream.reset(kFastest, kWindowBits, kMemoryLevel, zlib::Strategy::normal);
  std::string out(kHeader.begin(), kHeader.end());
  out.resize(kHeader.size() + stream.upper_bound(bytes.size()));
  zlib::z_params state{};
  state.next_in = bytes.data();
  state.avail_in = bytes.size();
  state.next_out = out.data() + kHeader.size();
  state.avail_out = out.size() - kHeader.size();
  boost::system::error_code problem;
  stream.write(state, zlib::Flush::finish, problem);
  if (problem && problem != zlib::error::end_of_stream) return "";
  out.resize(out.size() - state.avail_out);
  boost::crc_32_type checksum;
  checksum.process_bytes(bytes.data(), bytes.size());
  append_number(out, checksum.checksum());
  append_number(out, static_cast<std::uint32_t>(bytes.size()));
  return out;
}

void HttpFiles::get(const std::string& uri, const HttpRequest& question, Done done) {
  if (!offers()) return done(http_problem(404, "this server has no files"));
  const std::uint64_t id = next_++;
  waiting_.emplace(id, std::move(done));
  reader_.fetch(uri, [this, id, uri, accepted = std::string(question.accept_encoding),
                      known = std::string(question.if_none_match)](const AssetLibrary::Answer& answer) {
    post_([this, id, response = response_to(uri, accepted, known, answer)] { finish(id, response); });
  });
}

void HttpFiles::finish(std::uint64_t id, HttpResponse response) {
  const auto found = waiting_.find(id);
  if (found == waiting_.end()) return;
  const Done done = std::move(found->second);
  waiting_.erase(found);
  done(std::move(response));
}

HttpResponse HttpFiles::response_to(const std::string& uri, const std::string& accept_encoding,
                                    const std::string& if_none_match, const AssetLibrary::Answer& answer) {
  if (answer.bytes == nullptr) return http_problem(404, answer.why);
  const std::string_view bytes(reinterpret_cast<const char*>(answer.bytes->data()), answer.bytes->size());
  const HttpRequest question{
      .method = "GET", .target = "", .accept_encoding = accept_encoding, .if_none_match = if_none_match};
  ServedFile file{.content_type = "application/octet-stream",
                  .tag = fmt::format("{}-{}", content_tag(bytes), bytes.size()),
                  .bytes = bytes,
                  .gzip = {},
                  .owner = answer.bytes};
  const bool may_pack = bytes.size() >= kMinPacked && !is_picture(uri) && accepts_gzip(accept_encoding);
  if (may_pack && !is_known(file, question)) {
    const auto pack = packed(file.tag, bytes);
    if (pack->size() < bytes.size()) {
      file.gzip = *pack;
      file.owner = pack;
    }
  }
  return file_response(file, question);
}

std::shared_ptr<const std::string> HttpFiles::packed(const std::string& tag, std::string_view bytes) {
  const auto known = std::ranges::find(packed_, tag, [](const auto& entry) { return entry.first; });
  if (known != packed_.end()) return known->second;
  auto made = std::make_shared<const std::string>(gzip_compressed(bytes));
  packed_.emplace_back(tag, made);
  packed_bytes_ += made->size();
  while (packed_bytes_ > kMaxPackedBytes && packed_.size() > 1) {
    packed_bytes_ -= packed_.front().second->size();
    packed_.pop_front();
  }
  return made;
}

}  // namespace doppel
