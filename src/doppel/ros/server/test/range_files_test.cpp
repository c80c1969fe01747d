#include "doppel/ros/server/detail/range_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <boost/asio/connect.hpp>
#include <fstream>
#include <memory>
#include <thread>

#include "doppel/ros/server/server.h"
#include "fake_twin.h"
#include "raw_client.h"
#include "resident_memory.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
namespace http = boost::beast::http;
using boost::asio::ip::tcp;
using ::testing::HasSubstr;
using ::testing::Not;

std::string asked_of(std::string_view field, std::uint64_t size) {
  const ByteRange range = byte_range(field, size);
  if (range.kind == ByteRange::Kind::whole) return "whole";
  if (range.kind == ByteRange::Kind::invalid) return "invalid";
  return std::to_string(range.first) + "+" + std::to_string(range.count);
}

TEST(ByteRange, FieldGivesPartOfFile) {
  EXPECT_EQ(asked_of("bytes=0-0", 100), "0+1");
  EXPECT_EQ(asked_of("bytes=10-19", 100), "10+10");
  EXPECT_EQ(asked_of("bytes=90-1000", 100), "90+10");
  EXPECT_EQ(asked_of("bytes=99-", 100), "99+1");
  EXPECT_EQ(asked_of("bytes=-30", 100), "70+30");
  EXPECT_EQ(asked_of("bytes=-1000", 100), "0+100");
  EXPECT_EQ(asked_of("bytes=9000000000-9000000009", 10'000'000'000), "9000000000+10");
  EXPECT_EQ(asked_of("bytes=0-18446744073709551615", 100), "0+100");
}

TEST(ByteRange, RangeBeyondFileOrMalformedIsInvalid) {
  for (const char* field :
       {"bytes=100-", "bytes=100-200", "bytes=20-10", "bytes=-0", "bytes=-", "bytes=", "bytes=5", "bytes=a-b",
        "bytes=1-b", "bytes=+1-2", "bytes=1--2", "bytes=99999999999999999999-", "bytes=0x1-2"})
    EXPECT_EQ(asked_of(field, 100), "invalid") << field;
  EXPECT_EQ(asked_of("bytes=0-", 0), "invalid");
  EXPECT_EQ(asked_of("bytes=-5", 0), "invalid");
}

TEST(ByteRange, OtherUnitsAndListsGiveWholeFile) {
  for (const char* field : {"", "lines=1-2", "bytes=0-1,4-5", "Bytes"})
    EXPECT_EQ(asked_of(field, 100), "whole") << field;
}

class RangeFilesTest : public ::testing::Test {
 protected:
  using Response = http::response<http::string_body>;
  static constexpr const char* kRun = "/recordings/1/my%20run.mcap";
  static constexpr std::uint64_t kHuge = 10'000'000'000;  // bytes

  RangeFilesTest() {
    char name[] = "/tmp/doppel_ranges_XXXXXX";
    folder_ = mkdtemp(name);
    for (int i = 0; content_.size() < 300'000; ++i) content_ += std::to_string(i) + " ";
    write("run.mcap", content_);
    write("secret.txt", "secret");
    write("huge.mcap", "huge");
    fs::resize_file(folder_ / "huge.mcap", kHuge);  // without blocks on the disk
    options_.port = 0;
    options_.range_files = {{.address = "/recordings/1/my run.mcap", .path = folder_ / "run.mcap"},
                            {.address = "/recordings/1/huge.mcap", .path = folder_ / "huge.mcap"},
                            {.address = "/recordings/1/metadata.yaml", .text = "files: []\n"},
                            {.address = "/recordings/1/gone.mcap", .path = folder_ / "gone.mcap"}};
  }
  ~RangeFilesTest() override { fs::remove_all(folder_); }

  void write(const fs::path& file, const std::string& text) const {
    std::ofstream(folder_ / file, std::ios::binary) << text;
  }

  // A connection that has sent its request.
  class Visit {
   public:
    Visit(std::uint16_t port, const std::string& target, const std::string& range = "",
          http::verb method = http::verb::get, const std::string& host = "localhost",
          const std::string& if_range = "")
        : socket_(io_) {
      socket_.connect({boost::asio::ip::address_v4::loopback(), port});
      http::request<http::empty_body> request(method, target, 11);
      request.set(http::field::host, host);
      if (!range.empty()) request.set(http::field::range, range);
      if (!if_range.empty()) request.set(http::field::if_range, if_range);
      http::write(socket_, request);
      parser_.skip(method == http::verb::head);
    }
    Response response() {
      http::read(socket_, buffer_, parser_);
      return parser_.release();
    }
    // Reads the header alone.
    std::uint64_t content_length() {
      http::response_parser<http::empty_body> header;
      header.body_limit(std::uint64_t{1} << 40);
      http::read_header(socket_, buffer_, header);
      return header.content_length().value_or(0);
    }
    // Bytes until the connection ends.
    std::uint64_t read_until_end() {
      std::vector<char> bytes(std::size_t{1} << 20);
      std::uint64_t count = 0;
      for (boost::system::error_code failed; !failed;)
        count += socket_.read_some(boost::asio::buffer(bytes), failed);
      return count;
    }

   private:
    boost::asio::io_context io_;
    tcp::socket socket_;
    boost::beast::flat_buffer buffer_;
    http::response_parser<http::string_body> parser_;
  };

  fs::path folder_;
  std::string content_;
  ServerOptions options_;
  test::FakeTwin twin_;
  const Log silent_;
};

TEST_F(RangeFilesTest, FileIsSentWholeAndInParts) {
  const Server server(twin_.bus(), options_, silent_);
  const Response whole = Visit(server.port(), kRun).response();
  EXPECT_EQ(whole.result_int(), 200u);
  EXPECT_EQ(whole.body(), content_);
  EXPECT_EQ(whole["Accept-Ranges"], "bytes");
  EXPECT_EQ(whole["Content-Type"], "application/octet-stream");
  const std::string size = std::to_string(content_.size());
  for (const auto& [first, last] : {std::pair{0, 0}, {7, 200'006}, {131'072, 131'073}, {250'000, 299'999}}) {
    const std::string bounds = std::to_string(first) + "-" + std::to_string(last);
    const Response part = Visit(server.port(), kRun, "bytes=" + bounds).response();
    EXPECT_EQ(part.result_int(), 206u) << bounds;
    EXPECT_EQ(part["Content-Range"], "bytes " + bounds + "/" + size);
    EXPECT_EQ(part.body(), content_.substr(first, last - first + 1)) << bounds;
  }
  const Response end = Visit(server.port(), kRun, "bytes=-5").response();
  EXPECT_EQ(end.body(), content_.substr(content_.size() - 5));
}

TEST_F(RangeFilesTest, HeadGivesSizeAlone) {
  const Server server(twin_.bus(), options_, silent_);
  const Response head = Visit(server.port(), kRun, "bytes=0-9", http::verb::head).response();
  EXPECT_EQ(head.result_int(), 200u);
  EXPECT_EQ(head["Content-Length"], std::to_string(content_.size()));
  EXPECT_EQ(head["Accept-Ranges"], "bytes");
  const Response posted = Visit(server.port(), kRun, "", http::verb::post).response();
  EXPECT_EQ(posted.result_int(), 405u);
}

TEST_F(RangeFilesTest, InvalidRangeGives416WithSize) {
  const Server server(twin_.bus(), options_, silent_);
  for (const char* range : {"bytes=900000-", "bytes=9-3", "bytes=x"}) {
    const Response refused = Visit(server.port(), kRun, range).response();
    EXPECT_EQ(refused.result_int(), 416u) << range;
    EXPECT_EQ(refused["Content-Range"], "bytes */" + std::to_string(content_.size())) << range;
  }
}

TEST_F(RangeFilesTest, IfRangeOfFormerFileGivesWholeFile) {
  const Server server(twin_.bus(), options_, silent_);
  const std::string tag(Visit(server.port(), kRun).response()["ETag"]);
  const auto get = [&] {
    return Visit(server.port(), kRun, "bytes=0-9", http::verb::get, "localhost", tag).response();
  };
  EXPECT_EQ(get().result_int(), 206u);
  std::ofstream(folder_ / "run.mcap", std::ios::app) << "more";
  const Response later = get();
  EXPECT_EQ(later.result_int(), 200u);
  EXPECT_EQ(later.body(), content_ + "more");
}

TEST_F(RangeFilesTest, OnlyNamedFilesAreServed) {
  const Server server(twin_.bus(), options_, silent_);
  for (const char* target :
       {"/recordings/1/secret.txt", "/recordings/1/../secret.txt", "/recordings/1/%2e%2e/1/my%20run.mcap",
        "/recordings/1/", "/recordings/1/my%20run.mcap/../secret.txt", "/run.mcap",
        "//recordings/1/huge.mcap", "/recordings/1/my%20run.mcap%00", "/recordings/1/gone.mcap"}) {
    const Response refused = Visit(server.port(), target).response();
    EXPECT_EQ(refused.result_int(), 404u) << target;
    EXPECT_THAT(refused.body(), Not(HasSubstr("secret\n"))) << target;
  }
  const Response elsewhere = Visit(server.port(), kRun, "", http::verb::get, "elsewhere.example").response();
  EXPECT_EQ(elsewhere.result_int(), 403u);
  const Response text = Visit(server.port(), "/recordings/1/metadata.yaml").response();
  EXPECT_EQ(text.body(), "files: []\n");
}

TEST_F(RangeFilesTest, FileThatTookItsPlaceIsNotServed) {
  const Server server(twin_.bus(), options_, silent_);
  write("other.mcap", "another file");
  fs::rename(folder_ / "other.mcap", folder_ / "run.mcap");
  const Response refused = Visit(server.port(), kRun).response();
  EXPECT_EQ(refused.result_int(), 404u);
  EXPECT_THAT(refused.body(), HasSubstr("another file has taken its place"));
  fs::remove(folder_ / "run.mcap");
  fs::create_symlink(folder_ / "secret.txt", folder_ / "run.mcap");
  EXPECT_EQ(Visit(server.port(), kRun).response().result_int(), 404u);
}

TEST_F(RangeFilesTest, HugeFileIsStreamedWithoutMemoryAndWithoutBlockingOthers) {
  const Server server(twin_.bus(), options_, silent_);
  const long before = resident_kilobytes();
  std::vector<std::unique_ptr<Visit>> silent;
  for (int i = 0; i < 8; ++i) {  // of all ten gigabytes, and the client stops reading
    silent.push_back(std::make_unique<Visit>(server.port(), "/recordings/1/huge.mcap"));
    EXPECT_EQ(silent.back()->content_length(), kHuge);
  }
  std::vector<std::thread> readers;
  std::atomic<int> right = 0;
  for (int i = 0; i < 4; ++i) {
    readers.emplace_back([&, i] {
      for (int k = 0; k < 5; ++k) {
        const std::uint64_t first = 2'000'000'000ull * static_cast<std::uint64_t>(i) + 1'000'000;
        const std::string bounds = std::to_string(first) + "-" + std::to_string(first + 999'999);
        const Response part = Visit(server.port(), "/recordings/1/huge.mcap", "bytes=" + bounds).response();
        right += part.result_int() == 206 && part.body() == std::string(1'000'000, '\0') ? 1 : 0;
      }
    });
  }
  for (std::thread& reader : readers) reader.join();
  EXPECT_EQ(right, 20);
  EXPECT_EQ(Visit(server.port(), "/health").response().result_int(), 200u);
  EXPECT_LT(resident_kilobytes() - before, growth_bound(64'000));
}

TEST_F(RangeFilesTest, FileThatGetsShorterEndsItsResponse) {
  const Server server(twin_.bus(), options_, silent_);
  Visit visit(server.port(), "/recordings/1/huge.mcap");
  EXPECT_EQ(visit.content_length(), kHuge);
  fs::resize_file(folder_ / "huge.mcap", 1000);
  EXPECT_LT(visit.read_until_end(), std::uint64_t{100'000'000});
  EXPECT_EQ(Visit(server.port(), kRun).response().body(), content_);
}

}  // namespace
}  // namespace doppel
