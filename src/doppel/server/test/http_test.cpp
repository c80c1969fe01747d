#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "doppel/server/http_answers.h"

namespace doppel {
namespace {

TEST(Http, OnlyThisMachineIsLocal) {
  for (const char* host :
       {"localhost", "LOCALHOST:8700", "127.0.0.1", "127.0.0.1:1", "[::1]", "[::1]:8700"}) {
    EXPECT_TRUE(is_local_host(host)) << host;
  }
  for (const char* host : {"", "example.org", "localhost.example.org", "127.0.0.1.example.org",
                           "127.0.0.1:80@x", "[::1", "[::1]x", "0.0.0.0", "localhost:8700/x"}) {
    EXPECT_FALSE(is_local_host(host)) << host;
  }
}

TEST(Http, PagesFromElsewhereAreStrangers) {
  EXPECT_TRUE(is_local_origin("http://localhost:8080"));
  EXPECT_TRUE(is_local_origin("https://127.0.0.1"));
  for (const char* origin : {"", "null", "file://", "https://example.org", "http://localhost.example.org",
                             "http://user@localhost", "localhost"}) {
    EXPECT_FALSE(is_local_origin(origin)) << origin;
  }
}

TEST(Http, ChoosesAKnownSubprotocol) {
  EXPECT_EQ(choose_subprotocol("foxglove.websocket.v1"), "foxglove.websocket.v1");
  EXPECT_EQ(choose_subprotocol("x, foxglove.sdk.v1 ,y"), "foxglove.sdk.v1");
  EXPECT_EQ(choose_subprotocol("foxglove.websocket.v10"), "");
  EXPECT_EQ(choose_subprotocol(""), "");
}

TEST(Http, AnswersItsThreeKindsOfPath) {
  const HttpFacts facts{
      .name = "arm \"<b>\"", .url = "ws://127.0.0.1:8700", .clients = 2, .topics = 7, .sim_time = 1.5};
  const HttpAnswer page = answer_http("GET", "/?x=1", facts);
  EXPECT_EQ(page.status, 200u);
  EXPECT_NE(page.body.find("ws://127.0.0.1:8700"), std::string::npos);
  EXPECT_EQ(page.body.find("<b>"), std::string::npos) << "names are text, not markup";
  const auto health = nlohmann::json::parse(answer_http("GET", "/health", facts).body);
  EXPECT_EQ(health["name"], facts.name);
  EXPECT_EQ(health["sim_time"], 1.5);
  EXPECT_EQ(answer_http("GET", "/../etc/passwd", facts).status, 404u);
  EXPECT_EQ(answer_http("POST", "/", facts).status, 405u);
}

}  // namespace
}  // namespace doppel
