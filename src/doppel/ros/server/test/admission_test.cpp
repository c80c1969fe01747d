#include "doppel/ros/server/admission.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>

namespace doppel {
namespace {

constexpr const char* kToken = "0123456789abcdef";

TEST(Admission, LocalHostNamesAreLocal) {
  for (const char* host :
       {"localhost", "LOCALHOST:8700", "127.0.0.1", "127.0.0.1:1", "127.0.1.1", "[::1]", "[::1]:8700"}) {
    EXPECT_TRUE(is_local_host(host)) << host;
  }
  for (const char* host : {"", "example.org", "localhost.example.org", "127.0.0.1.example.org",
                           "127.0.0.1:80@x", "[::1", "[::1]x", "0.0.0.0", "localhost:8700/x"}) {
    EXPECT_FALSE(is_local_host(host)) << host;
  }
}

TEST(Admission, ForeignOriginIsRefused) {
  EXPECT_TRUE(is_local_origin("http://localhost:8080"));
  EXPECT_TRUE(is_local_origin("https://127.0.0.1"));
  for (const char* origin : {"", "null", "file://", "https://example.org", "http://localhost.example.org",
                             "http://user@localhost", "localhost"}) {
    EXPECT_FALSE(is_local_origin(origin)) << origin;
  }
}

TEST(Admission, BeyondLoopbackTokenIsAcceptedInAddressOrCookie) {
  const Admission admission("0.0.0.0", false, kToken, 8700);
  const auto welcome = [&](std::string_view target, std::string_view cookies) {
    return admission
        .check({.host = "192.168.1.5:8700", .target = target, .cookies = cookies, .origin = std::nullopt})
        .ok();
  };
  EXPECT_TRUE(welcome("/?token=0123456789abcdef", ""));
  EXPECT_TRUE(welcome("/health?x=1&token=0123456789abcdef&y", ""));
  EXPECT_TRUE(welcome("/assets/a.js", "other=1; doppel_8700=0123456789abcdef"));
  for (const char* target :
       {"/", "/?token=", "/?token=0123456789abcde", "/?token=0123456789abcdef0", "/?token=0123456789abcdeF",
        "/?xtoken=0123456789abcdef", "/?token=%30123456789abcdef", "/token=0123456789abcdef"}) {
    EXPECT_FALSE(welcome(target, "")) << target;
  }
  EXPECT_FALSE(welcome("/", "doppel_8701=0123456789abcdef"))
      << "expected a rejection: the cookie is another twin's";
  EXPECT_EQ(admission.cookie_for("/?token=0123456789abcdef"),
            "doppel_8700=0123456789abcdef; Path=/; HttpOnly; SameSite=Strict");
  EXPECT_EQ(admission.cookie_for("/?token=x"), "");
}

TEST(Admission, BeyondLoopbackHostMustMatchOrigin) {
  std::array<char, 256> machine{};
  gethostname(machine.data(), machine.size() - 1);
  const Admission admission("arm.lab", false, kToken, 8700);
  const auto welcome = [&](std::string_view host, std::optional<std::string_view> origin = std::nullopt) {
    return admission
        .check({.host = host, .target = "/?token=0123456789abcdef", .cookies = "", .origin = origin})
        .ok();
  };
  for (const std::string& host :
       {std::string("192.168.1.5:8700"), std::string("10.0.0.1"), std::string("[fe80::1]:8700"),
        std::string("localhost:1"), std::string("ARM.lab:8700"), std::string(machine.data()) + ":8700"}) {
    EXPECT_TRUE(welcome(host)) << host;
    EXPECT_TRUE(welcome(host, "http://" + host)) << host;
  }
  for (const char* host : {"", "evil.example.org", "192.168.1.5.example.org", "arm.lab.example.org", "[x]",
                           "192.168.1", "arm.lab:8700@x"}) {
    EXPECT_FALSE(welcome(host)) << host;
  }
  for (const char* origin : {"", "null", "http://192.168.1.6:8700", "http://192.168.1.5", "http://localhost",
                             "http://192.168.1.5:8700/", "ftp://192.168.1.5:8700"}) {
    EXPECT_FALSE(welcome("192.168.1.5:8700", origin)) << origin;
  }
}

TEST(Admission, TokenIsLongAndUrlSafe) {
  EXPECT_EQ(make_token().size(), 32u);
  EXPECT_NE(make_token(), make_token());
  EXPECT_TRUE(check_token(make_token()).ok());
  EXPECT_TRUE(check_token("correct-horse_battery.staple~").ok());
  for (const char* token : {"", "short", "0123456789abcde", "0123456789abcdef&x", "0123456789 abcdef",
                            "0123456789abcdef;", "0123456789abcd\xc3\xa4"}) {
    EXPECT_FALSE(check_token(token).ok()) << token;
  }
}

}  // namespace
}  // namespace doppel
