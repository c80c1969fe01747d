#include "doppel/ros/server/detail/http_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <boost/asio/connect.hpp>
#include <boost/beast/zlib/inflate_stream.hpp>
#include <boost/crc.hpp>
#include <fstream>

#include "doppel/ros/server/server.h"
#include "fake_twin.h"
#include "raw_client.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
namespace http = boost::beast::http;
using ::testing::HasSubstr;

std::string inflated(std::string_view packed, std::size_t size) {
  namespace zlib = boost::beast::zlib;
  std::string out(size, '\0');
  zlib::inflate_stream stream;
  zlib::z_params state{};
  state.next_in = packed.data() + 10;
  state.avail_in = packed.size() - 18;
  state.next_out = out.data();
  state.avail_out = out.size();
  boost::system::error_code problem;
  stream.write(state, zlib::Flush::sync, problem);
  return out;
}

std::string patterned(std::size_t size) {
  std::string out;
  for (std::size_t i = 0; out.size() < size; ++i) out += "facet normal " + std::to_string(i % 97) + "\n";
  return out.substr(0, size);
}

TEST(HttpFiles, UriIsReadFromAddress) {
  EXPECT_EQ(requested_file("/files?uri=package%3A%2F%2Farm%2Fa%20b.stl"), "package://arm/a b.stl");
  EXPECT_EQ(requested_file("/files?token=x&uri=50%2520.stl"), "50%20.stl");
  EXPECT_EQ(requested_file("/files"), "");
  EXPECT_FALSE(requested_file("/filesystem?uri=a").has_value());
  EXPECT_FALSE(requested_file("/").has_value());
}

TEST(HttpFiles, CompressedBytesHaveTheirLengthAndChecksum) {
  for (const std::size_t size : {0u, 1u, 5000u, 300'000u}) {
    const std::string content = patterned(size), packed = gzip_compressed(content);
    ASSERT_GE(packed.size(), 18u);
    EXPECT_EQ(inflated(packed, size), content);
    const auto number = [&packed](std::size_t from_end) {
      std::uint32_t out = 0;
      for (std::size_t k = 0; k < 4; ++k)
        out |= std::uint32_t{static_cast<unsigned char>(packed[packed.size() - from_end + k])} << (8 * k);
      return out;
    };
    boost::crc_32_type checksum;
    checksum.process_bytes(content.data(), content.size());
    EXPECT_EQ(number(8), checksum.checksum());
    EXPECT_EQ(number(4), size);
    EXPECT_LT(packed.size() * 4, size + 100);
  }
}

class HttpFilesTest : public ::testing::Test {
 protected:
  using Response = http::response<http::string_body>;
  using Header = std::pair<http::field, std::string>;

  HttpFilesTest() {
    char name[] = "/tmp/doppel_files_XXXXXX";
    folder_ = mkdtemp(name);
    write("arm/package.xml", "<package><name>arm</name></package>");
    write("arm/meshes/a.stl", mesh_);
    write("arm/meshes/tex.png", patterned(4000));
    write("arm/config/secret.yaml", "secret");
    RobotFiles files;
    files.description = folder_ / "arm/urdf/arm.urdf";
    files.meshes.push_back({kUri, folder_ / "arm/meshes/a.stl"});
    library_->offer(files);
  }
  ~HttpFilesTest() override { fs::remove_all(folder_); }

  void write(const fs::path& file, const std::string& text) const {
    fs::create_directories((folder_ / file).parent_path());
    std::ofstream(folder_ / file, std::ios::binary) << text;
  }
  static Response get(std::uint16_t port, const std::string& target, const std::vector<Header>& headers = {},
                      http::verb method = http::verb::get, const std::string& host = "localhost") {
    boost::asio::io_context io;
    boost::asio::ip::tcp::socket socket(io);
    socket.connect({boost::asio::ip::address_v4::loopback(), port});
    http::request<http::empty_body> request(method, target, 11);
    request.set(http::field::host, host);
    for (const auto& [name, value] : headers) request.set(name, value);
    http::write(socket, request);
    boost::beast::flat_buffer buffer;
    http::response_parser<http::string_body> parser;
    parser.skip(method == http::verb::head);
    http::read(socket, buffer, parser);
    return parser.release();
  }

  static constexpr const char* kUri = "package://arm/meshes/a.stl";
  static constexpr const char* kTarget = "/files?uri=package%3A%2F%2Farm%2Fmeshes%2Fa.stl";
  const std::string mesh_ = patterned(50'000);
  fs::path folder_;
  std::shared_ptr<AssetLibrary> library_ = std::make_shared<AssetLibrary>();
  test::FakeTwin twin_;
  const Log silent_;
};

TEST_F(HttpFilesTest, MeshIsSentCompressedAndKnownTagGivesNotModified) {
  const Server server(twin_.bus(), {.port = 0, .assets = library_}, silent_);
  const Response plain = get(server.port(), kTarget);
  EXPECT_EQ(plain.result_int(), 200u);
  EXPECT_EQ(plain.body(), mesh_);
  EXPECT_EQ(plain["Cache-Control"], "no-cache");
  const Response packed = get(server.port(), kTarget, {{http::field::accept_encoding, "gzip"}});
  EXPECT_EQ(packed["Content-Encoding"], "gzip");
  EXPECT_EQ(packed["Vary"], "Accept-Encoding");
  EXPECT_EQ(inflated(packed.body(), mesh_.size()), mesh_);
  const std::vector<Header> known{{http::field::accept_encoding, "gzip"},
                                  {http::field::if_none_match, std::string(packed["ETag"])}};
  const Response again = get(server.port(), kTarget, known);
  EXPECT_EQ(again.result_int(), 304u);
  EXPECT_EQ(again["ETag"], packed["ETag"]);
  write("arm/meshes/a.stl", patterned(40'000));
  const Response changed = get(server.port(), kTarget, known);
  EXPECT_EQ(changed.result_int(), 200u);
  EXPECT_EQ(inflated(changed.body(), 40'000), patterned(40'000));
  const Response head = get(server.port(), kTarget, {}, http::verb::head);
  EXPECT_EQ(head["Content-Length"], "40000");
}

TEST_F(HttpFilesTest, PicturesAreNotCompressed) {
  const Server server(twin_.bus(), {.port = 0, .assets = library_}, silent_);
  const Response picture =
      get(server.port(), "/files?uri=package://arm/meshes/tex.png", {{http::field::accept_encoding, "gzip"}});
  EXPECT_EQ(picture.result_int(), 200u);
  EXPECT_EQ(picture["Content-Encoding"], "");
}

TEST_F(HttpFilesTest, AccessIsThatOfOtherRequests) {
  const Server server(twin_.bus(), {.port = 0, .assets = library_}, silent_);
  for (const char* uri : {"package://arm/config/secret.yaml", "file:///etc/passwd", "/etc/passwd", "",
                          "package://arm/meshes/../config/secret.yaml", "package://arm/meshes/a.stl%00"}) {
    const Response refused = get(server.port(), std::string("/files?uri=") + uri);
    EXPECT_EQ(refused.result_int(), 404u) << uri;
    EXPECT_THAT(refused.body(), ::testing::Not(HasSubstr("secret\n"))) << uri;
  }
  EXPECT_EQ(get(server.port(), kTarget, {{http::field::origin, "http://elsewhere.example"}}).result_int(),
            403u);
  EXPECT_EQ(get(server.port(), kTarget, {}, http::verb::get, "elsewhere.example").result_int(), 403u);
  EXPECT_EQ(get(server.port(), kTarget, {}, http::verb::post).result_int(), 405u);
  const Server without(twin_.bus(), {.port = 0}, silent_);
  EXPECT_EQ(get(without.port(), kTarget).result_int(), 404u);
  const Server guarded(
      twin_.bus(), {.host = "0.0.0.0", .port = 0, .token = "0123456789abcdef", .assets = library_}, silent_);
  EXPECT_EQ(get(guarded.port(), kTarget).result_int(), 403u);
  EXPECT_EQ(get(guarded.port(), std::string(kTarget) + "&token=0123456789abcdef").result_int(), 200u);
}

}  // namespace
}  // namespace doppel
