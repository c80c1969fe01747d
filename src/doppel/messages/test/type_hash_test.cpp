// Type hashes against those that Jazzy's own generator makes (tests/ros2/jazzy_type_hashes.txt).

#include "doppel/messages/type_hash.h"

#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <set>
#include <sstream>

#include "messages_testing.h"

namespace doppel {
namespace {

const std::string kOurs = "doppel_msgs/";

std::map<std::string, std::string> published() {
  std::ifstream file(DOPPEL_SOURCE_DIR "/tests/ros2/jazzy_type_hashes.txt");
  EXPECT_TRUE(file.good());
  std::map<std::string, std::string> hashes;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string name, hash;
    if (!line.starts_with('#') && words >> name >> hash) hashes[name] = hash;
  }
  return hashes;
}

std::map<std::string, std::string> all_hashes() {
  std::map<std::string, std::string> hashes;
  for (const TypeSupport* type : messages_testing::all_types()) hashes[type->name] = type->hash();
  for (const std::string& name : service_names()) hashes[name] = find_service(name)->hash();
  for (const std::string& name : action_names()) hashes[name] = find_action(name)->hash();
  return hashes;
}

TEST(TypeHash, EveryTypeHasThePublishedOne) {
  const auto jazzy = published();
  ASSERT_GT(jazzy.size(), 500U);
  for (const auto& [name, hash] : all_hashes()) {
    if (name.starts_with(kOurs)) continue;  // nobody publishes these
    const auto found = jazzy.find(name);
    ASSERT_NE(found, jazzy.end()) << name << " is not in Jazzy";
    EXPECT_EQ(hash, found->second) << name;
  }
}

// gazebo_msgs as far as the twin serves them; an event message is no struct, only part of its service's hash.
TEST(TypeHash, NoTypeOfAListedPackageIsMissing) {
  const auto ours = all_hashes();
  std::string missing;
  for (const auto& [name, hash] : published()) {
    if (name.ends_with("_Event") || name.starts_with("gazebo_msgs/")) continue;
    if (!ours.contains(name)) missing += name + "\n";
  }
  EXPECT_EQ(missing, "");
}

// What `ros2 topic info --verbose` prints in other people's documentation and logs.
TEST(TypeHash, AsOthersHavePublished) {
  EXPECT_EQ(find_type("std_msgs/msg/String")->hash(),
            "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18");
  EXPECT_EQ(find_type("rosgraph_msgs/msg/Clock")->hash(),
            "RIHS01_692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564");
}

}  // namespace
}  // namespace doppel
