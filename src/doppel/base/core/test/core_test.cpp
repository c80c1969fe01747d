#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <string>
#include <thread>

#include "doppel/base/core/byte_ring.h"
#include "doppel/base/core/diagnostic.h"
#include "doppel/base/core/file_descriptor.h"
#include "doppel/base/core/inbox.h"
#include "doppel/base/core/names.h"
#include "doppel/base/core/text.h"
#include "doppel/base/core/time.h"
#include "doppel/base/core/yaml_fix.h"

namespace doppel {
namespace {

TEST(SourceLocation, TextListsPathOutermostFirst) {
  SourceLocation inner = make_location("joints.xacro", 14, 3);
  inner.within = std::make_shared<SourceLocation::Within>(
      SourceLocation::Within{make_location("arm.xacro", 210, 5), "in macro 'servo_joint'"});
  EXPECT_EQ(inner.str(), "arm.xacro:210:5: in macro 'servo_joint' (joints.xacro:14:3)");
  EXPECT_EQ(inner.place(), "joints.xacro:14:3");
}

TEST(Diagnostics, CondensedCountsEqualMessagesAndThoseBeyondMostOfRule) {
  Diagnostics all;
  for (int i = 0; i < 40; ++i) all.warning("mesh.missing", {}, "mesh " + std::to_string(i), "add it");
  for (int i = 0; i < 4; ++i) all.warning("urdf.limit", {}, "limit " + std::to_string(i));
  for (int i = 0; i < 3; ++i) all.note("up.use_sim", {}, "use_sim");
  all.note("mesh.missing", {}, "a note of the same rule");
  for (int i = 0; i < 9; ++i) all.error("urdf.name", {}, "name " + std::to_string(i));
  std::string text;
  for (const Diagnostic& d : condensed(all, 3)) text += d.rule + " " + d.message + "\n";
  EXPECT_EQ(text,
            "mesh.missing mesh 0\nmesh.missing mesh 1\nmesh.missing mesh 2\n"
            "mesh.missing 37 more warnings of this kind; 'doppel check' lists them\n"
            "urdf.limit limit 0\nurdf.limit limit 1\nurdf.limit limit 2\nurdf.limit limit 3\n"
            "up.use_sim at 3 places: use_sim\nmesh.missing a note of the same rule\n"
            "urdf.name name 0\nurdf.name name 1\nurdf.name name 2\nurdf.name name 3\nurdf.name name 4\n"
            "urdf.name name 5\nurdf.name name 6\nurdf.name name 7\nurdf.name name 8\n");
  EXPECT_EQ(condensed(all).size(), 40u + 4 + 1 + 1 + 9);
}

TEST(Diagnostics, ThrowIfErrorsThrowsAllErrors) {
  Diagnostics d;
  d.warning("a.b", make_location("x", 1, 1), "odd");
  EXPECT_NO_THROW(d.throw_if_errors());
  d.error("c.d", make_location("x", 2, 3), "wrong", "do this");
  d.error("e.f", make_location("x", 4, 5), "worse");
  try {
    d.throw_if_errors();
    FAIL() << "expected an InputError with both errors";
  } catch (const InputError& e) {
    EXPECT_STREQ(e.what(), "x:2:3: error: wrong [c.d]\n  fix: do this\nx:4:5: error: worse [e.f]");
  }
}

TEST(Names, NearestNameMatchesTypoOnly) {
  const std::vector<std::string> names{"Revolute 1", "Revolute 2", "length"};
  EXPECT_EQ(nearest_name("lenght", names), "length");
  EXPECT_EQ(nearest_name("Revolute1", names), "Revolute 1");
  EXPECT_EQ(nearest_name("camera", names), std::nullopt);
  EXPECT_EQ(did_you_mean("camera", names), "; there are: Revolute 1, Revolute 2, length");
}

TEST(Names, PartOfNameGetsNamesThatContainIt) {
  const auto meant = [](const char* name, const std::vector<std::string>& more) {
    std::vector<std::string> names{"base", "shoulder", "upper_arm", "forearm", "wrist",
                                   "palm", "thumb",    "finger",    "camera"};
    names.insert(names.end(), more.begin(), more.end());
    return did_you_mean(name, names);
  };
  EXPECT_EQ(meant("tool", {"tool_link_1"}), "; did you mean 'tool_link_1'?");
  EXPECT_EQ(meant("Tool", {"left_tool_1", "tool_link_1"}), "; did you mean 'tool_link_1' or 'left_tool_1'?")
      << "expected the name that begins with it first";
  std::vector<std::string> many;
  for (int i = 1; i <= 5; ++i) many.push_back("tool_link_" + std::to_string(i));
  EXPECT_EQ(meant("tool", many),
            "; did you mean 'tool_link_1', 'tool_link_2', 'tool_link_3', 'tool_link_4' "
            "or 'tool_link_5'?");
  for (int i = 6; i <= 200; ++i) many.push_back("tool_link_" + std::to_string(i));
  EXPECT_EQ(meant("tool", many),
            "; did you mean 'tool_link_1', 'tool_link_2', 'tool_link_3', 'tool_link_4' "
            "or one of 196 others?");
  EXPECT_EQ(meant("t", many), "") << "expected no suggestion: a letter is in too many names";
  EXPECT_EQ(meant("lidar", many), "");
}

TEST(Names, SiblingNameIsLastSuggestion) {
  const auto nearest = [](const char* name, const std::vector<std::string>& names) {
    return nearest_name(name, names).value_or("");
  };
  EXPECT_EQ(nearest("Revolute 4", {"Revolute 1", "Revolute 2", "Revolute 44"}), "Revolute 44");
  EXPECT_EQ(nearest("joint12", {"joint13", "joint1"}), "joint1");
  EXPECT_EQ(nearest("left_finger", {"right_finger", "left_fnger"}), "left_fnger");
  EXPECT_EQ(nearest("lower_arm", {"upper_arm", "lowr_arms"}), "lowr_arms");
  EXPECT_EQ(nearest("elbow_joint", {"elbow_point", "joint_elbow"}), "joint_elbow");
  EXPECT_EQ(nearest("ds3241", {"ds3218", "ds3240"}), "ds3240")
      << "expected the sibling that is nearer than the others";
  EXPECT_EQ(nearest("Revolute 7", {"Revolute 1", "Revolute 2"}), "")
      << "expected no suggestion: both are equally near";
  EXPECT_EQ(nearest("Revolute 7", {"Revolute 1", "Revolute 1"}), "Revolute 1");
}

TEST(Time, RoundTripsToNanosecond) {
  EXPECT_EQ(from_seconds(0.001).count(), 1'000'000);
  EXPECT_EQ(from_seconds(-1.5).count(), -1'500'000'000);
  EXPECT_DOUBLE_EQ(to_seconds(Duration(2'500'000'000)), 2.5);
}

TEST(Inbox, TasksOfManyThreadsRunInOrder) {
  Inbox inbox;
  constexpr int kEach = 2000;
  std::vector<int> last(4, -1);
  bool ordered = true;
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      for (int i = 0; i < kEach; ++i) {
        inbox.post([&, t, i] {
          ordered = ordered && last[static_cast<std::size_t>(t)] == i - 1;
          last[static_cast<std::size_t>(t)] = i;
        });
      }
    });
  }
  std::size_t count = 0;
  while (count < 4 * kEach) count += inbox.run();
  for (auto& t : threads) t.join();
  EXPECT_TRUE(ordered);
  EXPECT_TRUE(inbox.empty());
}

TEST(Inbox, LanesTakeTurns) {
  Inbox inbox;
  const auto busy = std::make_shared<Inbox::Lane>(), polite = std::make_shared<Inbox::Lane>();
  std::string order;
  for (int i = 0; i < 50; ++i)
    inbox.post(
        busy, [&] { order += 'b'; }, 100);
  inbox.post(polite, [&] { order += 'p'; });
  inbox.post([&] { order += 'o'; });
  EXPECT_EQ(busy->pending(), 50u);
  EXPECT_EQ(busy->pending_bytes(), 5000u);
  EXPECT_EQ(inbox.run(), 52u);
  EXPECT_EQ(order.substr(0, 3), "obp") << "expected a lane not to wait for all tasks of another one";
  EXPECT_EQ(busy->pending() + busy->pending_bytes() + polite->pending(), 0u);
}

TEST(Inbox, TasksBeyondAllowanceWait) {
  Inbox inbox;
  const auto lane = std::make_shared<Inbox::Lane>();
  std::vector<int> order;
  for (int i = 0; i < 10; ++i) {
    inbox.post(lane, [&order, i] {
      order.push_back(i);
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    });
  }
  for (int runs = 1; runs <= 10; ++runs) {
    auto allowance = std::chrono::nanoseconds(std::chrono::milliseconds(1));
    EXPECT_EQ(inbox.run(&allowance), 1u);
    EXPECT_LT(allowance.count(), 0);
    EXPECT_EQ(inbox.empty(), runs == 10);
  }
  EXPECT_TRUE(std::ranges::is_sorted(order));
  inbox.post(lane, [] {});
  auto none = std::chrono::nanoseconds(-1);
  EXPECT_EQ(inbox.run(&none), 0u);
  inbox.post([] {});
  EXPECT_EQ(inbox.run(&none), 1u) << "expected tasks without a lane to run in any case";
}

TEST(Inbox, WaitingTasksAreFreedWithInbox) {
  const auto kept = std::make_shared<int>(1);
  {
    Inbox inbox;
    const auto lane = std::make_shared<Inbox::Lane>();
    for (int i = 0; i < 3; ++i) inbox.post(lane, [kept] {});
    auto none = std::chrono::nanoseconds(0);
    inbox.run(&none);
    EXPECT_EQ(kept.use_count(), 4);
  }
  EXPECT_EQ(kept.use_count(), 1);
}

TEST(Inbox, WaitEndsOnPost) {
  Inbox inbox;
  EXPECT_FALSE(inbox.wait(std::chrono::milliseconds(1)));
  constexpr int kRounds = 1000;
  std::thread poster([&] {
    for (int i = 0; i < kRounds; ++i) inbox.post([] {});
  });
  for (std::size_t count = 0; count < kRounds; count += inbox.run())
    ASSERT_TRUE(inbox.wait(std::chrono::seconds(60)));  // a lost wake-up would take as long
  poster.join();
}

TEST(ByteRing, RecordsStayWholeAcrossWrapAndDropWhenFull) {
  ByteRing ring(256);
  std::string seen, sent;
  for (int i = 0; i < 200; ++i) {
    const std::string record(static_cast<std::size_t>(i % 60), static_cast<char>('a' + i % 26));
    auto room = ring.begin_write(record.size());
    ASSERT_TRUE(record.empty() || room.data() != nullptr);
    std::memcpy(room.data(), record.data(), record.size());
    ring.commit(record.size());
    sent += record + '|';
    if (i % 2 == 1) {
      for (int k = 0; k < 2; ++k) {
        const auto front = ring.front();
        ASSERT_NE(front.data(), nullptr);
        seen.append(reinterpret_cast<const char*>(front.data()), front.size());
        seen += '|';
        ring.pop();
      }
    }
  }
  EXPECT_EQ(seen, sent);
  EXPECT_EQ(ring.dropped(), 0u);
  EXPECT_EQ(ring.begin_write(1000).data(), nullptr);
  EXPECT_EQ(ring.dropped(), 1u);
}

TEST(ByteRing, FastReaderUsesEighthOfLargeRing) {
  ByteRing ring(std::size_t{32} << 20);
  constexpr std::size_t kSize = 10'000;
  const std::byte* const front = ring.begin_write(0).data();
  std::ptrdiff_t furthest = 0;
  for (int i = 0; i < 10'000; ++i) {
    const auto record = ring.begin_write(kSize);
    ASSERT_EQ(record.size(), kSize);
    record[0] = static_cast<std::byte>(i);
    ring.commit(kSize);
    const auto read = ring.front();
    ASSERT_EQ(read.size(), kSize);
    EXPECT_EQ(read[0], static_cast<std::byte>(i));
    furthest = std::max(furthest, read.data() - front);
    ring.pop();
  }
  EXPECT_LE(furthest, (4 << 20) + 2 * static_cast<std::ptrdiff_t>(kSize));
  EXPECT_EQ(ring.dropped(), 0u);
}

TEST(ByteRing, ConcurrentWriterAndReaderKeepOrder) {
  ByteRing ring(4096);
  constexpr std::uint64_t kCount = 200000;
  std::thread writer([&] {
    for (std::uint64_t i = 0; i < kCount;) {
      auto room = ring.begin_write(8 + i % 24);
      if (room.data() == nullptr) continue;
      std::memcpy(room.data(), &i, 8);
      ring.commit(room.size());
      ++i;
    }
  });
  for (std::uint64_t expected = 0; expected < kCount;) {
    const auto record = ring.front();
    if (record.data() == nullptr) continue;
    std::uint64_t value = 0;
    std::memcpy(&value, record.data(), 8);
    ASSERT_EQ(value, expected);
    ASSERT_EQ(record.size(), 8 + expected % 24);
    ring.pop();
    ++expected;
  }
  writer.join();
}

TEST(Text, LoweredChangesAsciiOnly) {
  EXPECT_EQ(lowered("Arm_B.STL"), "arm_b.stl");
  EXPECT_EQ(lowered("@[`{\xC3\x84"), "@[`{\xC3\x84");
}

TEST(FileDescriptor, ReadReturnsAllAndDestructorCloses) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  const int left = ends[0];
  {
    const FileDescriptor in(ends[0]);
    {
      const FileDescriptor out(ends[1]);
      ASSERT_EQ(write(out.get(), "abc", 3), 3);
      ASSERT_EQ(write(out.get(), "de", 2), 2);
    }
    std::array<std::byte, 4> four{};
    EXPECT_EQ(read_all(in.get(), four), 4);
    EXPECT_EQ(four[3], std::byte{'d'});
    EXPECT_EQ(read_all(in.get(), four), 1) << "expected 1: the other end is closed";
    EXPECT_EQ(read_all(in.get(), four), 0);
  }
  EXPECT_EQ(fcntl(left, F_GETFD), -1);
  EXPECT_FALSE(FileDescriptor(-1).is_open());
  std::array<std::byte, 1> one{};
  EXPECT_LT(read_all(-1, one), 0);
}

TEST(YamlFix, FixFollowsCause) {
  EXPECT_NE(yaml_fix("end of sequence flow not found").find("'['"), std::string::npos);
  EXPECT_NE(yaml_fix("end of map flow not found").find("'{'"), std::string::npos);
  EXPECT_NE(yaml_fix("illegal map value").find("quote"), std::string::npos);
  EXPECT_NE(yaml_fix("something else").find("before this place"), std::string::npos);
}

}  // namespace
}  // namespace doppel
