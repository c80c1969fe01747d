#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <thread>

#include "doppel/base/core/diagnostic.h"
#include "doppel/ros/client/websocket_client.h"
#include "doppel/ros/server/announcement.h"
#include "doppel/ros/server/server.h"
#include "doppel/ros/server/test/fake_twin.h"
#include "doppel/ros/server/test/raw_client.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;
namespace http = boost::beast::http;
using std::chrono::milliseconds;
using std::chrono::seconds;
using std::chrono::steady_clock;
using ::testing::HasSubstr;
using ::testing::StartsWith;

// A connection that can send arbitrary bytes.
class RawConnection {
 public:
  explicit RawConnection(std::uint16_t port) {
    socket_.connect({boost::asio::ip::address_v4::loopback(), port});
    const timeval timeout{.tv_sec = 20, .tv_usec = 0};
    setsockopt(socket_.native_handle(), SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof(timeout));
  }
  bool say(const std::string& bytes) {
    boost::system::error_code failed;
    boost::asio::write(socket_, boost::asio::buffer(bytes), failed);
    return !failed;
  }
  // The next response; status 0: the server has closed the connection.
  http::response<http::string_body> receive(bool head = false) {
    http::response_parser<http::string_body> parser;
    parser.skip(head);
    boost::system::error_code failed;
    http::read(socket_, buffer_, parser, failed);
    if (failed) {
      http::response<http::string_body> none;
      none.result(0u);
      return none;
    }
    return parser.release();
  }
  http::response<http::string_body> get(const std::string& target, const std::string& more = "") {
    say("GET " + target + " HTTP/1.1\r\nHost: localhost\r\n" + more + "\r\n");
    return receive();
  }
  // Reads until the server closes; false: it has not done so within the socket's timeout.
  bool is_closed() {
    char byte = 0;
    boost::system::error_code failed;
    while (!failed) socket_.read_some(boost::asio::buffer(&byte, 1), failed);
    return failed != boost::asio::error::try_again && failed != boost::asio::error::would_block;
  }

 private:
  boost::asio::io_context io_;
  boost::asio::ip::tcp::socket socket_{io_};
  boost::beast::flat_buffer buffer_;
};

class HostileHttpTest : public ::testing::Test {
 protected:
  HostileHttpTest() {
    char name[] = "/tmp/doppel_http_XXXXXX";
    folder_ = mkdtemp(name);
    fs::create_directories(folder_ / "dist/assets");
    std::ofstream(folder_ / "dist/index.html") << "<html>page</html>";
    std::ofstream(folder_ / "dist/assets/main-AAAAAAAA.js") << "script";
    std::ofstream(folder_ / "secret.js") << "secret";
  }
  ~HostileHttpTest() override { fs::remove_all(folder_); }
  std::uint16_t start(ServerOptions options = {}) {
    options.port = 0;
    options.page_folder = folder_ / "dist";
    server_ = std::make_unique<Server>(twin_.bus(), options, log_);
    return server_->port();
  }

  fs::path folder_;
  Log log_;
  test::FakeTwin twin_;
  std::unique_ptr<Server> server_;
};

TEST_F(HostileHttpTest, OneConnectionServesPage) {
  RawConnection visitor(start());
  const auto page = visitor.get("/");
  EXPECT_EQ(page.body(), "<html>page</html>");
  EXPECT_EQ(page["X-Content-Type-Options"], "nosniff");
  EXPECT_EQ(page["Referrer-Policy"], "no-referrer");
  EXPECT_EQ(visitor.get("/assets/main-AAAAAAAA.js").body(), "script");
  const auto known = visitor.get("/", "If-None-Match: " + std::string(page["ETag"]) + "\r\n");
  EXPECT_EQ(known.result_int(), 304u);
  EXPECT_EQ(known.body(), "");
  visitor.say("HEAD / HTTP/1.1\r\nHost: localhost\r\n\r\n");
  const auto head = visitor.receive(true);
  EXPECT_EQ(head["Content-Length"], "17");
  EXPECT_EQ(visitor.get("/health").result_int(), 200u) << "expected the connection to stay in step";
  const auto ranged = visitor.get("/", "Range: bytes=0-3\r\n");
  EXPECT_EQ(ranged.result_int(), 200u);
  EXPECT_EQ(ranged.body(), "<html>page</html>");
  EXPECT_EQ(visitor.get("/", "Connection: close\r\n").result_int(), 200u);
  EXPECT_TRUE(visitor.is_closed());
}

TEST_F(HostileHttpTest, PipelinedRequestsAreAnsweredInOrder) {
  RawConnection visitor(start());
  std::string ahead;
  for (const char* target : {"/health", "/nothing", "/assets/main-AAAAAAAA.js", "/"})
    ahead += std::string("GET ") + target + " HTTP/1.1\r\nHost: localhost\r\n\r\n";
  visitor.say(ahead);
  EXPECT_EQ(visitor.receive()["Content-Type"], "application/json");
  EXPECT_EQ(visitor.receive().result_int(), 404u);
  EXPECT_EQ(visitor.receive().body(), "script");
  EXPECT_EQ(visitor.receive().body(), "<html>page</html>");
}

TEST_F(HostileHttpTest, RequestsPerConnectionAreBounded) {
  RawConnection visitor(start());
  int answered = 0;
  while (visitor.get("/health").result_int() == 200 && answered < 10'000) ++answered;
  EXPECT_GE(answered, 100);
  EXPECT_LE(answered, 1000);
}

TEST_F(HostileHttpTest, PathTraversalIsRefused) {
  const std::uint16_t port = start();
  using std::string_literals::operator""s;
  for (const std::string& target :
       {"/../secret.js"s, "/assets/../../secret.js"s, "/assets/..%2f..%2fsecret.js"s, "/%2e%2e/secret.js"s,
        "//secret.js"s, "/assets//main-AAAAAAAA.js"s, "/assets/main-AAAAAAAA.js%00.png"s, "/etc/passwd"s,
        "//etc/passwd"s, "/assets\\..\\secret.js"s, "/%c0%ae%c0%ae/secret.js"s,
        "http://localhost/../secret.js"s, "file:///etc/passwd"s, "*"s}) {
    RawConnection visitor(port);
    const auto answer = visitor.get(target);
    EXPECT_EQ(answer.result_int(), 404u) << target;
    EXPECT_EQ(answer.body().find("secret"), std::string::npos) << target;
  }
  RawConnection visitor(port);
  visitor.say("GET /assets/main-AAAAAAAA.js\0.png HTTP/1.1\r\nHost: localhost\r\n\r\n"s);
  EXPECT_EQ(visitor.receive().result_int(), 400u);
}

TEST_F(HostileHttpTest, InvalidRequestIsAnsweredAndClosed) {
  const std::uint16_t port = start();
  const std::pair<std::string, unsigned> cases[] = {
      {"hello\r\n\r\n", 400},
      {std::string(100, '\x16') + "\r\n\r\n", 400},
      {"GET / HTTP/9.9\r\n\r\n", 400},
      {"GET / HTTP/1.1\r\nHost: localhost\r\nX: " + std::string(20'000, 'x') + "\r\n\r\n", 431},
      {"GET /" + std::string(20'000, 'x') + " HTTP/1.1\r\nHost: localhost\r\n\r\n", 431},
      {"POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 5000\r\n\r\n" + std::string(5000, 'x'), 413},
      {"POST / HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\n1388\r\n" +
           std::string(5000, 'x') + "\r\n0\r\n\r\n",
       413},
      {"GET / HTTP/1.1\r\nHost: localhost\r\nHost: evil.example.org\r\n\r\n", 400},
      {"GET / HTTP/1.1\r\n\r\n", 403},
      {"GET / HTTP/1.0\r\n\r\n", 403},
      {"GET / HTTP/1.1\r\nHost: evil.example.org\r\n\r\n", 403},
      {"GET / HTTP/1.1\r\nHost: localhost\r\nOrigin: http://evil.example.org\r\n\r\n", 403},
  };
  for (const auto& [bytes, status] : cases) {
    RawConnection visitor(port);
    visitor.say(bytes);
    EXPECT_EQ(visitor.receive().result_int(), status) << bytes.substr(0, 80);
  }
  for (const char* method : {"POST", "PUT", "DELETE", "OPTIONS", "TRACE", "PATCH", "FROB"}) {
    RawConnection visitor(port);
    visitor.say(std::string(method) + " / HTTP/1.1\r\nHost: localhost\r\n\r\n");
    const auto answer = visitor.receive();
    EXPECT_TRUE(answer.result_int() == 405 || answer.result_int() == 400) << method;
    EXPECT_EQ(answer.body().find("page"), std::string::npos);
  }
  EXPECT_EQ(RawConnection(port).get("/").result_int(), 200u);
}

TEST_F(HostileHttpTest, SlowRequestIsClosed) {
  const std::uint16_t port = start({.http_timeout = milliseconds(300)});
  RawConnection dripping(port), silent(port);
  const auto begin = steady_clock::now();
  std::string request = "GET / HTTP/1.1\r\nHost: localhost\r\nX: ";
  while (dripping.say(request.empty() ? "x" : std::exchange(request, ""))) {
    ASSERT_LT(steady_clock::now() - begin, seconds(15))
        << "expected the server to close the connection of a slow client";
    std::this_thread::sleep_for(milliseconds(20));
  }
  EXPECT_TRUE(silent.is_closed());
}

TEST_F(HostileHttpTest, ManySlowRequestsDoNotBlockOthers) {
  const std::uint16_t port = start();
  std::vector<std::unique_ptr<RawConnection>> crowd;
  for (int i = 0; i < 200; ++i) {
    crowd.push_back(std::make_unique<RawConnection>(port));
    crowd.back()->say("GET / HTTP/1.1\r\nHost: loc");
    if (i % 20 == 0) {
      EXPECT_EQ(RawConnection(port).get("/").result_int(), 200u) << i;
    }
  }
  test::RawClient client(port);
  EXPECT_EQ(client.handshake(), "");
}

TEST_F(HostileHttpTest, BeyondLoopbackRequestNeedsToken) {
  const std::uint16_t port = start({.host = "0.0.0.0"});
  const std::string token = server_->token();
  EXPECT_EQ(token.size(), 32u) << "expected a token to be created by default";
  EXPECT_THAT(server_->page_url(), HasSubstr("/?token=" + token));
  EXPECT_THAT(server_->url(), HasSubstr("/?token=" + token));
  const std::string wrong(32, '0');
  for (const std::string& target : {std::string("/"), std::string("/health"),
                                    std::string("/assets/main-AAAAAAAA.js"), "/?token=" + wrong}) {
    EXPECT_EQ(RawConnection(port).get(target).result_int(), 403u) << target;
  }
  EXPECT_THAT(test::RawClient(port).handshake(), StartsWith("403"));
  RawConnection visitor(port);
  const auto page = visitor.get("/?token=" + token);
  EXPECT_EQ(page.result_int(), 200u);
  const std::string cookie(page["Set-Cookie"]);
  EXPECT_THAT(cookie, HasSubstr("HttpOnly; SameSite=Strict"));
  const std::string back = cookie.substr(0, cookie.find(';'));
  EXPECT_EQ(visitor.get("/assets/main-AAAAAAAA.js", "Cookie: " + back + "\r\n").result_int(), 200u);
  EXPECT_EQ(test::RawClient(port).handshake("localhost", {{"Cookie", back}}), "");
  EXPECT_THAT(
      test::RawClient(port).handshake("localhost", {{"Cookie", back}, {"Origin", "http://localhost:1"}}),
      StartsWith("403"))
      << "expected a rejection: another page on this machine sends the cookie, too";
  EXPECT_EQ(
      test::RawClient(port).handshake("localhost:7", {{"Cookie", back}, {"Origin", "http://localhost:7"}}),
      "");
}

TEST_F(HostileHttpTest, ShellOfSameUserFindsToken) {
  setenv("XDG_RUNTIME_DIR", folder_.c_str(), 1);
  start({.host = "0.0.0.0", .token = "correct-horse-battery"});
  const Announcement announcement("arm", server_->port(), server_->own_address(), server_->token());
  const auto twins = find_running();
  ASSERT_EQ(twins.size(), 1u);
  for (const auto& entry : fs::directory_iterator(announcement_folder())) {
    EXPECT_EQ(entry.status().permissions(), fs::perms::owner_read | fs::perms::owner_write);
  }
  ClientOptions options;
  options.host = twins[0].address;
  options.port = twins[0].port;
  options.timeout = seconds(20);
  EXPECT_THROW(WebSocketClient{options}, ClientError);
  options.token = twins[0].token;
  EXPECT_TRUE(WebSocketClient(options).topics().contains("/joint_states"));
}

TEST_F(HostileHttpTest, ShortTokenIsRefused) {
  EXPECT_THROW(start({.token = "short"}), InputError);
  EXPECT_THROW(start({.token = "not fit for an address"}), InputError);
  start({.token = "0123456789abcdef"});
  EXPECT_EQ(RawConnection(server_->port()).get("/").result_int(), 403u)
      << "expected a token that is set to be required on loopback as well";
}

}  // namespace
}  // namespace doppel
