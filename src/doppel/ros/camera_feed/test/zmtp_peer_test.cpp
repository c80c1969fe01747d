#include "doppel/ros/camera_feed/detail/zmtp_peer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

namespace doppel {
namespace {

using namespace std::string_literals;

// The greeting of libzmq 4.3: version 3.1, NULL.
std::string greeting(char major = 3, const std::string& mechanism = "NULL") {
  std::string out = "\xFF\0\0\0\0\0\0\0\1\x7F"s + major + '\1' + mechanism;
  out.resize(64);
  return out;
}
std::string ready(const std::string& type) {
  const std::string body =
      "\5READY\xBSocket-Type\0\0\0"s + static_cast<char>(type.size()) + type + "\x8Identity\0\0\0\0"s;
  return "\4"s + static_cast<char>(body.size()) + body;
}
const std::string kSubscription = "\0\1\1"s;  // to everything

void take_all(ZmtpPeer& peer) {
  peer.take(peer.waiting().size());
}

TEST(ZmtpPeer, GreetsWithVersionAndMechanism) {
  const ZmtpPeer peer;
  ASSERT_EQ(peer.waiting().size(), 64U);
  EXPECT_EQ(peer.waiting().substr(0, 10), "\xFF\0\0\0\0\0\0\0\0\x7F"s);
  EXPECT_EQ(peer.waiting().substr(10, 6), "\3\0NULL"s);
}

TEST(ZmtpPeer, SubscriberByteByByteGetsMessage) {
  ZmtpPeer peer;
  for (const char byte : greeting() + ready("SUB") + kSubscription) {
    EXPECT_FALSE(peer.subscribes("{}"));
    ASSERT_TRUE(peer.receive({&byte, 1}));
  }
  EXPECT_EQ(peer.waiting().substr(64), "\4\x19\5READY\xBSocket-Type\0\0\0\3PUB"s);
  ASSERT_TRUE(peer.subscribes("{}"));
  take_all(peer);
  peer.send("{}");
  EXPECT_EQ(peer.waiting(), "\0\2{}"s);
}

TEST(ZmtpPeer, LongMessageHasEightBytesOfSize) {
  ZmtpPeer peer;
  take_all(peer);
  peer.send(std::string(300, 'x'));
  EXPECT_EQ(peer.waiting().substr(0, 10), "\2\0\0\0\0\0\0\1\x2Cx"s);
  peer.take(9);
  EXPECT_EQ(peer.waiting().size(), 300U);
}

TEST(ZmtpPeer, SubscriptionEndsWithItsCancellation) {
  ZmtpPeer peer;
  ASSERT_TRUE(peer.receive(greeting() + ready("SUB") + "\0\2\1{"s));
  EXPECT_TRUE(peer.subscribes("{1"));
  EXPECT_FALSE(peer.subscribes("x"));
  ASSERT_TRUE(peer.receive("\0\2\0{"s));
  EXPECT_FALSE(peer.subscribes("{1"));
  ASSERT_TRUE(peer.receive("\4\xB\x9SUBSCRIBE{"s));  // as of version 3.1
  EXPECT_TRUE(peer.subscribes("{1"));
}

TEST(ZmtpPeer, SubscriptionsBeyondTheirNumberAreIgnored) {
  ZmtpPeer peer;
  ASSERT_TRUE(peer.receive(greeting() + ready("SUB")));
  for (int i = 0; i < 63; ++i) ASSERT_TRUE(peer.receive("\0\2\1x"s));
  ASSERT_TRUE(peer.receive("\0\2\1y"s));
  ASSERT_TRUE(peer.receive("\0\2\1{"s));
  EXPECT_TRUE(peer.subscribes("y"));
  EXPECT_FALSE(peer.subscribes("{1"));
  ASSERT_TRUE(peer.receive("\0\2\0y"s));
  ASSERT_TRUE(peer.receive("\0\2\1{"s));
  EXPECT_TRUE(peer.subscribes("{1"));
}

TEST(ZmtpPeer, ReaderAtHalfRateCostsNoMoreThanWhatWaits) {
  ZmtpPeer peer;
  ASSERT_TRUE(peer.receive(greeting() + ready("SUB") + kSubscription));
  const std::string picture(300'000, 'x');
  for (int i = 0; i < 1000; ++i) {
    if (peer.has_room()) peer.send(picture);
    peer.take(std::min(peer.waiting().size(), picture.size() / 2));
    ASSERT_LE(peer.memory(), 4 * (ZmtpPeer::kMaxWaiting + picture.size())) << "after " << i << " pictures";
  }
  EXPECT_FALSE(peer.has_room()) << "expected the reader to be behind";
}

TEST(ZmtpPeer, PingsOfPeerThatReadsNothingAreNotKept) {
  ZmtpPeer peer;
  ASSERT_TRUE(peer.receive(greeting() + ready("SUB")));
  const std::string ping = "\6\0\0\0\0\0\0\xF\xA0\4PING\0\1"s + std::string(4000 - 7, 'x');
  for (int i = 0; i < 10'000; ++i) ASSERT_TRUE(peer.receive(ping));
  EXPECT_LE(peer.memory(), 4 * ZmtpPeer::kMaxWaiting);
}

TEST(ZmtpPeer, PingIsAnsweredWithItsContext) {
  ZmtpPeer peer;
  ASSERT_TRUE(peer.receive(greeting() + ready("SUB")));
  take_all(peer);
  ASSERT_TRUE(peer.receive("\4\x9\4PING\0\1ab"s));
  EXPECT_EQ(peer.waiting(), "\4\7\4PONGab"s);
}

TEST(ZmtpPeer, OthersAreClosed) {
  for (const std::string& bytes :
       {"GET / HTTP/1.1\r\n\r\n"s, greeting(1), greeting(3, "CURVE"), greeting() + ready("PUSH"),
        greeting() + kSubscription, greeting() + "\2\0\0\0\0\xFF\0\0\0"s, greeting() + "\x80\1x"s}) {
    ZmtpPeer peer;
    EXPECT_FALSE(peer.receive(bytes)) << bytes;
  }
}

}  // namespace
}  // namespace doppel
