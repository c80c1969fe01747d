// The meshes that a recording brings are written to a folder of the session, wherever their names lead.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "doppel/ros/record/bag_writer.h"
#include "doppel/session/live/session.h"

namespace doppel {
namespace {

namespace fs = std::filesystem;

class BagSessionTest : public testing::Test {
 protected:
  BagSessionTest() {
    char name[] = "/tmp/doppel_bag_session_XXXXXX";
    folder_ = mkdtemp(name);
    if (const char* const set = std::getenv("TMPDIR")) former_ = set;
    fs::create_directories(folder_ / "tmp");
    ::setenv("TMPDIR", (folder_ / "tmp").c_str(), 1);  // the session's folder is in it
  }
  ~BagSessionTest() override {
    if (former_) {
      ::setenv("TMPDIR", former_->c_str(), 1);
    } else {
      ::unsetenv("TMPDIR");
    }
    fs::remove_all(folder_);
  }

  std::string write_bag(const std::vector<std::string>& attachments) {
    BagWriterOptions options;
    options.folder = folder_ / "bag";
    BagWriter bag(options);
    for (const std::string& one : attachments) bag.attach({one, "model/stl", {std::byte{'x'}}}, 0);
    bag.close();
    return options.folder.string();
  }
  [[nodiscard]] std::vector<std::string> meshes() const {
    std::vector<std::string> out;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder_)) {
      if (entry.path().extension() == ".stl")
        out.push_back(entry.path().lexically_relative(folder_).string());
    }
    return out;
  }

  fs::path folder_;
  std::optional<std::string> former_;
};

TEST_F(BagSessionTest, MeshWhoseNameLeadsOutIsNotWritten) {
  const std::string absolute = (folder_ / "absolute.stl").string();
  BagReader bag(write_bag({"package://arm/meshes/fore.stl", "package://../out.stl",
                           "package://arm/../../out.stl", "package://arm/meshes/../../../../out.stl",
                           "package://..", "file://" + absolute, "http://arm//../../out.stl"}));
  Bus bus;
  const Log log;
  {
    const BagSession session(bus, "bag", bag, {}, log);
    const std::vector<std::string> written = meshes();
    EXPECT_THAT(written, testing::Each(testing::StartsWith("tmp/doppel-meshes-")));
    EXPECT_THAT(written, testing::Contains(testing::EndsWith("/arm/meshes/fore.stl")));
    EXPECT_THAT(written, testing::Not(testing::Contains(testing::HasSubstr("out.stl"))));
    EXPECT_FALSE(fs::exists(absolute));
  }
  EXPECT_THAT(meshes(), testing::IsEmpty()) << "expected nothing to be left after the session";
}

}  // namespace
}  // namespace doppel
