#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "doppel/ros/server/detail/http_responses.h"

namespace doppel {
namespace {

TEST(HttpResponses, KnownSubprotocolIsChosen) {
  EXPECT_EQ(choose_subprotocol("foxglove.websocket.v1"), "foxglove.websocket.v1");
  EXPECT_EQ(choose_subprotocol("x, foxglove.sdk.v1 ,y"), "foxglove.sdk.v1");
  EXPECT_EQ(choose_subprotocol("foxglove.websocket.v10"), "");
  EXPECT_EQ(choose_subprotocol(""), "");
}

TEST(HttpResponses, MissingPageShowsTwinSummary) {
  const ServerSummary facts{.name = "arm \"<b>\"", .url = "ws://127.0.0.1:8700", .clients = 2, .topics = 7};
  PageFiles none("/nowhere/dist");
  const auto get = [&](std::string_view target, std::string_view method = "GET") {
    return http_response_to({.method = method, .target = target, .accept_encoding = "", .if_none_match = ""},
                            none, facts);
  };
  const HttpResponse page = get("/?x=1");
  EXPECT_EQ(page.status, 200u);
  EXPECT_NE(page.body.find("ws://127.0.0.1:8700"), std::string::npos);
  EXPECT_NE(page.body.find("<code>./doppel</code> builds it"), std::string::npos);
  EXPECT_EQ(page.body.find("<b>"), std::string::npos)
      << "expected names to be escaped: they are text, not markup";
  const auto health = nlohmann::json::parse(get("/health").body);
  EXPECT_EQ(health["name"], facts.name);
  EXPECT_EQ(get("/../etc/passwd").status, 404u);
  EXPECT_EQ(get("/", "POST").status, 405u);
}

}  // namespace
}  // namespace doppel
